//! The perturbation that is drawn for one perturbed world.

use std::collections::{BTreeMap, BTreeSet};

use asid_core::layout::{JointKind, Sensor};
use asid_core::rng::Rng;
use asid_core::{Layout, Result, Streams};
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;
use rand::Rng as _;
use serde::Serialize;

use crate::PerturbationRanges;

/// The values drawn by a world's seed. Each has its own random stream, so that a changed range
/// affects no other value.
#[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
#[schemars(rename = "DrawnPerturbation")]
pub struct Perturbation {
    /// Physics steps in one of the simulator's.
    pub steps: usize,
    /// Factor of the contacts' time constant.
    pub contact_time: f64,
    /// Factor of the contacts' damping ratio.
    pub contact_damping: f64,
    /// Time constant of the servos' lag, s.
    pub servo_lag: f64,
    /// Factor of the mass of each body that lies free, with all that hangs on it.
    pub mass: BTreeMap<String, f64>,
    /// The tracker.
    pub tracker: TrackerPerturbation,
}

/// What is off in a tracker.
#[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
pub struct TrackerPerturbation {
    /// Age of a reading, s.
    pub latency: f64,
    /// Constant error of each signal: numbers and vectors in their unit, a rotation vector (rad)
    /// for an orientation.
    pub offset: BTreeMap<String, Vec<f64>>,
    /// Names of the signals whose error is in radians.
    #[serde(skip)]
    angles: BTreeSet<String>,
    /// Frames from one reading to the next.
    pub every: usize,
    /// Share of readings that are lost.
    pub dropout: f64,
}

/// Uniform draw; exactly `low` where the range is a single value.
fn uniform([low, high]: [f64; 2], rng: &mut Rng) -> f64 {
    let u: f64 = rng.random();
    if low == high {
        low
    } else {
        low + u * (high - low)
    }
}

/// Log-uniform draw.
fn factor(range: [f64; 2], rng: &mut Rng) -> f64 {
    if range[0] == range[1] {
        return uniform(range, rng);
    }
    uniform(range.map(f64::ln), rng).exp()
}

/// A vector of this length in a uniformly random direction (Archimedes: the height on a sphere is
/// uniform).
fn direction(length: f64, rng: &mut Rng) -> [f64; 3] {
    let z = rng.random_range(-1.0..1.0_f64);
    let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let r = (1.0 - z * z).sqrt();
    [r * cos, r * sin, z].map(|x| length * x)
}

/// Whether the constant error of a sensor is a rotation: that of an orientation, or of the position
/// of a joint that is no slide.
fn is_angle(plant: &Plant, sensor: &Sensor) -> bool {
    let own = plant.layout.sensors.iter().zip(&plant.sensors);
    let mut reads = own.filter(|(s, _)| s.name == sensor.name).map(|(_, r)| *r);
    let slides = match reads.next() {
        Some(Reads::Joint(j)) => plant.layout.joints[j].kind == JointKind::Slide,
        _ => false,
    };
    sensor.len == 4 || (sensor.kind == "jointpos" && !slides)
}

/// Draws the constant error of a sensor, which is a rotation where `angle` is true.
fn offset(sensor: &Sensor, angle: bool, ranges: &PerturbationRanges, rng: &mut Rng) -> Vec<f64> {
    let range = if angle {
        ranges.tracker_rotation
    } else {
        ranges.tracker_offset
    };
    match (&*sensor.kind, sensor.len) {
        (_, 4) | ("framepos" | "subtreecom", _) => direction(uniform(range, rng), rng).into(),
        ("jointpos", _) => {
            let sign = if rng.random() { 1.0 } else { -1.0 };
            vec![sign * uniform(range, rng)]
        }
        // Speeds and forces are not tracked.
        _ => vec![0.0; sensor.len],
    }
}

impl Perturbation {
    /// Draws a world from its own streams. `tracked` names the sensors of the tracker.
    ///
    /// # Errors
    /// When the layout has no such sensor.
    pub fn draw(
        ranges: &PerturbationRanges,
        plant: &Plant,
        layout: &Layout,
        tracked: &[String],
        streams: Streams,
    ) -> Result<Self> {
        let streams = streams.child("perturbation");
        let of = |name: &str| streams.stream(name);
        let free = (1..plant.bodies.len()).filter(|&b| plant.free_joint(b).is_some());
        let mass = free
            .map(|b| {
                let name = plant.layout.bodies[b].clone();
                let drawn = factor(ranges.mass, &mut of(&format!("mass of {name}")));
                (name, drawn)
            })
            .collect();
        let mut angles = BTreeSet::new();
        let offsets = tracked
            .iter()
            .map(|name| {
                let sensor = layout.sensor(name)?;
                let angle = is_angle(plant, sensor);
                if angle {
                    angles.insert(name.clone());
                }
                let mut rng = of(&format!("offset of {name}"));
                Ok((name.clone(), offset(sensor, angle, ranges, &mut rng)))
            })
            .collect::<Result<_>>()?;
        let [low, high] = ranges.tracker_every;
        Ok(Self {
            steps: ranges.steps,
            contact_time: factor(ranges.contact_time, &mut of("contact time")),
            contact_damping: factor(ranges.contact_damping, &mut of("contact damping")),
            servo_lag: uniform(ranges.servo_lag, &mut of("servo lag")),
            mass,
            tracker: TrackerPerturbation {
                latency: uniform(ranges.tracker_latency, &mut of("tracker latency")),
                offset: offsets,
                angles,
                every: of("tracker rate").random_range(low..=high),
                dropout: uniform(ranges.tracker_dropout, &mut of("tracker dropout")),
            },
        })
    }

    /// Describes the perturbation in words.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let ms = |s: f64| format!("{:.1} ms", 1e3 * s);
        let largest = |angle: bool| {
            let offsets = self.tracker.offset.iter();
            let chosen = offsets.filter(|(name, _)| self.tracker.angles.contains(*name) == angle);
            chosen
                .map(|(_, v)| v.iter().map(|x| x * x).sum::<f64>().sqrt())
                .fold(0.0, f64::max)
        };
        let mut words = vec![
            format!("{} physics steps in one of the simulator's", self.steps),
            format!(
                "contacts' time constant x {:.2}, damping x {:.2}",
                self.contact_time, self.contact_damping
            ),
            format!("servos lag by {}", ms(self.servo_lag)),
        ];
        let masses = self.mass.iter();
        words.extend(masses.map(|(body, f)| format!("mass of {body} x {f:.3}")));
        words.push(format!(
            "tracker late by {}, off by up to {:.1} mm and {:.1} mrad, {:.1} % of readings lost",
            ms(self.tracker.latency),
            1e3 * largest(false),
            1e3 * largest(true),
            100.0 * self.tracker.dropout
        ));
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Scene;

    const DOOR: &str = r#"<mujoco>
  <worldbody>
    <body name="door">
      <joint name="hinge"/>
      <geom name="leaf" type="box" size="0.4 0.02 0.8"/>
      <body name="bolt">
        <joint name="lock" type="slide"/>
        <geom name="rod" type="box" size="0.1 0.01 0.01"/>
      </body>
    </body>
  </worldbody>
  <sensor>
    <framepos name="handle" objtype="body" objname="door"/>
    <framequat name="leaning" objtype="body" objname="door"/>
    <jointpos name="angle" joint="hinge"/>
    <jointpos name="thrown" joint="lock"/>
  </sensor>
</mujoco>"#;

    /// Symptom: a report said that the angle of a hinge was off by 10 mm. Cause: orientations were
    /// told by names that end in `_quat`, and anything else counted as metres.
    #[test]
    fn an_angle_is_off_by_milliradians_whatever_its_sensor_is_called() {
        let plant = Plant::of(&Scene::from_xml("door", DOOR, &[]).unwrap()).unwrap();
        let ranges = PerturbationRanges {
            tracker_offset: [0.002; 2],
            tracker_rotation: [0.01; 2],
            ..PerturbationRanges::off()
        };
        for (sensor, expected) in [
            ("angle", "off by up to 0.0 mm and 10.0 mrad"),
            ("leaning", "off by up to 0.0 mm and 10.0 mrad"),
            ("handle", "off by up to 2.0 mm and 0.0 mrad"),
            ("thrown", "off by up to 2.0 mm and 0.0 mrad"),
        ] {
            let tracked = [sensor.to_owned()];
            let streams = Streams::new(0);
            let drawn =
                Perturbation::draw(&ranges, &plant, &plant.layout, &tracked, streams).unwrap();
            let words = drawn.words().join("; ");
            assert!(words.contains(expected), "{sensor}: {words}");
        }
    }
}
