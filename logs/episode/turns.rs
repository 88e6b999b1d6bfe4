//! Angles that a machine reports within one turn: encoders, yaw of an IMU, wheels.
//!
//! A simulated hinge counts its turns. Where such a log passes the end of its turn, its readings jump
//! by a turn, and a model that is right seems to miss by `2 pi`. The jumps are taken out before
//! anything interpolates between two readings.

use std::f64::consts::TAU;

use asid_core::layout::JointKind;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use super::mapping::{ColumnMapping, Source};

/// Share of a turn beyond which a step from one reading to the next is the end of a turn: a wrapped
/// angle jumps by a turn less its motion.
const JUMP: f64 = 0.75;
/// Largest motion from one reading to the next, as a share of a turn, with which [`JUMP`] is the end
/// of a turn and no motion.
const MOTION: f64 = 1.0 - JUMP;
/// Share of the readings that lie within one turn. The others may be spikes.
const WITHIN: f64 = 0.98;
/// Width of one turn with the noise at its two ends, in turns.
const TURN: f64 = 1.01;

/// A sensor that reads the angle of a hinge.
#[derive(Clone, Debug, PartialEq)]
pub struct Angle {
    /// The sensor's name.
    pub sensor: String,
    /// The column that holds it.
    pub column: String,
    /// Factor from the column to rad.
    factor: f64,
    /// Added after the factor, rad.
    offset: f64,
    /// Middle of the joint's range, rad; `None` for a joint without limits.
    middle: Option<f64>,
}

/// The sensors that read hinges' angles, with the columns in which these mappings find them.
#[must_use]
pub fn angles(plant: &Plant, mappings: &[ColumnMapping]) -> Vec<Angle> {
    let sensors = plant.layout.sensors.iter().zip(&plant.sensors);
    let angle = |(sensor, reads): (&asid_core::layout::Sensor, &Reads)| {
        let Reads::Joint(joint) = *reads else {
            return None;
        };
        if sensor.kind != "jointpos" || plant.joint_kind(joint) != JointKind::Hinge {
            return None;
        }
        let source = Source::of(mappings, &sensor.name, None);
        let range = plant.joints.get(joint)?.range;
        Some(Angle {
            sensor: sensor.name.clone(),
            column: source.column,
            factor: source.factor,
            offset: source.offset,
            middle: range.map(|[low, high]| (low + high) / 2.0),
        })
    };
    sensors.filter_map(angle).collect()
}

impl Angle {
    /// Takes the jumps out of the numbers of its column, and returns how many there were.
    pub fn unwrap_column(&self, values: &mut [f64]) -> usize {
        let middle = self.middle.map(|m| (m - self.offset) / self.factor);
        unwrap(values, TAU / self.factor.abs(), middle)
    }

    /// Takes the jumps out of readings in rad, and returns how many there were.
    pub(super) fn unwrap_readings(&self, values: &mut [f64]) -> usize {
        unwrap(values, TAU, self.middle)
    }
}

/// Takes jumps by a `turn` out of numbers, where they are jumps and not motion.
///
/// NaN is a missing number. Where there is a `middle`, the numbers are shifted by whole turns so that
/// their median is nearest to it: a joint with limits is within them.
fn unwrap(values: &mut [f64], turn: f64, middle: Option<f64>) -> usize {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if sorted.len() < 2 || !turn.is_finite() {
        return 0;
    }
    sorted.sort_by(f64::total_cmp);
    let spikes = ((1.0 - WITHIN) / 2.0 * sorted.len() as f64) as usize;
    if sorted[sorted.len() - 1 - spikes] - sorted[spikes] > TURN * turn {
        return 0;
    }
    let (mut jumps, mut motions) = (0, 0);
    let mut last = f64::NAN;
    for &x in values.iter().filter(|x| x.is_finite()) {
        let step = (x - last).abs() / turn;
        jumps += usize::from(step > JUMP && step < 1.0 + MOTION);
        motions += usize::from(step > MOTION && step <= JUMP);
        last = x;
    }
    // Each spike makes two steps.
    if jumps == 0 || motions > 2 * spikes {
        return 0;
    }
    let (mut shift, mut last) = (0.0, f64::NAN);
    for x in values.iter_mut().filter(|x| x.is_finite()) {
        let step = (*x - last) / turn;
        if step.abs() > JUMP && step.abs() < 1.0 + MOTION {
            shift -= turn * step.signum();
        }
        last = *x;
        *x += shift;
    }
    if let Some(middle) = middle {
        let mut counted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        let half = counted.len() / 2;
        let median = *counted.select_nth_unstable_by(half, f64::total_cmp).1;
        let turns = ((median - middle) / turn).round() * turn;
        values.iter_mut().for_each(|x| *x -= turns);
    }
    jumps
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An angle as a sensor reports it that counts from `low` to `low` and a turn.
    fn wrapped(angle: f64, low: f64) -> f64 {
        (angle - low).rem_euclid(TAU) + low
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        apart.fold(0.0, f64::max)
    }

    #[test]
    fn a_wheel_counts_its_turns_in_either_convention_and_unit() {
        let angle: Vec<f64> = (0..400).map(|k| 0.05 * f64::from(k) - 3.0).collect();
        for (low, unit) in [(-TAU / 2.0, 1.0), (0.0, 1.0), (0.0, 360.0 / TAU)] {
            let mut log: Vec<f64> = angle.iter().map(|a| unit * wrapped(*a, low)).collect();
            let first = log[0] / unit - angle[0];
            log[77] = f64::NAN;
            assert_eq!(unwrap(&mut log, unit * TAU, None), 3);
            log[77] = unit * (angle[77] + first);
            let found: Vec<f64> = log.iter().map(|x| x / unit - first).collect();
            assert!(apart(&found, &angle) < 1e-9);
        }
    }

    #[test]
    fn a_joint_with_limits_is_within_them() {
        // It swings about 0 and is reported from 0 to a turn, so that the first reading is nearly one.
        let angle: Vec<f64> = (0..300)
            .map(|k| 0.8 * (0.05 * f64::from(k)).sin() - 0.1)
            .collect();
        let mut log: Vec<f64> = angle.iter().map(|a| wrapped(*a, 0.0)).collect();
        assert!(unwrap(&mut log, TAU, Some(0.2)) > 3);
        assert!(apart(&log, &angle) < 1e-9);
    }

    #[test]
    fn what_is_no_wrapped_angle_stays() {
        let swing = |amplitude: f64, step: f64| -> Vec<f64> {
            let angle = |k: i32| amplitude * (step * f64::from(k)).sin();
            (0..300).map(angle).collect()
        };
        let mut spiky = swing(1.0, 0.05);
        spiky[40] += 5.5;
        // An angle in degrees whose unit is not stated, a swing within a turn, one that turns more than
        // a quarter from row to row, and a spike.
        for log in [swing(170.0, 0.05), swing(3.1, 0.05), swing(3.1, 2.0)] {
            let mut read = log.clone();
            assert_eq!(unwrap(&mut read, TAU, None), 0);
            assert_eq!(read, log);
        }
        let mut read = spiky.clone();
        unwrap(&mut read, TAU, None);
        let moved = read.iter().zip(&spiky).filter(|(a, b)| a != b).count();
        assert!(moved <= 1, "a spike is still one: {moved}");
    }

    #[test]
    fn noise_at_the_end_of_a_turn_is_no_turn() {
        // At rest there, readings go to and fro between the two ends.
        let mut log: Vec<f64> = (0..100)
            .map(|k| wrapped(TAU / 2.0 + 0.001 * f64::from(k % 3 - 1), -TAU / 2.0))
            .collect();
        assert!(unwrap(&mut log, TAU, None) > 20);
        let apart = log.iter().map(|x| (x - log[0]).abs()).fold(0.0, f64::max);
        assert!(apart < 0.0021, "{apart}");
    }
}
