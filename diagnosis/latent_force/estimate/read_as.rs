//! Initial states of segments according to their readings, in a model that reads differently from
//! the given one.
//!
//! A shift of a reading also shifts the position that it stands for. A ball that seems to come to
//! rest 3 cm above its floor was also thrown from 3 cm lower. Derivatives do not lead an initial
//! state there, because each bounce that comes earlier or later is a local minimum of its own. So
//! where the model's readings change, the initial states that leave the readings unchanged are
//! tried in addition to those that derivatives suggest.

use asid_core::{Layout, Result};

use crate::latent_force::context::Context;
use crate::latent_force::initial::position_entries;
use crate::latent_force::step_map::StepMap;
use crate::latent_force::tangent::{difference, retract, rotation};

use super::Estimate;

/// Least response of a reading to its position, relative to that of a sensor without error, that a
/// step may rely on. A sensor's scale is 0.3 at least; one that responds less is stuck.
const LEAST_RESPONSE: f64 = 0.1;

/// Returns by how much each position reads more at some states than the given model reads at the
/// segments' own, `nx` per walk; 0 for coordinates that no sensor reads directly.
fn misread(
    context: &Context<'_>,
    map: &mut StepMap<'_>,
    theta: &[f64],
    states: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>> {
    let entries = position_entries(context.plant(), context.logs);
    let mut differ = vec![0.0; context.logs.entries.len()];
    let now = map.readings_at(theta, states)?;
    let each = now.iter().zip(&context.as_read).map(|(now, as_given)| {
        context.logs.reading_difference(now, as_given, &mut differ);
        let off = entries.iter().map(|entry| entry.map_or(0.0, |e| differ[e]));
        let mut off: Vec<f64> = off.collect();
        off.resize(2 * entries.len(), 0.0);
        off
    });
    Ok(each.collect())
}

/// Returns the change of a position that makes up for a reading that is `off`, of which a change by
/// `-off` leaves `left`.
///
/// It is a step of the secant method, which is exact for a bias and a scale.
fn made_up(off: f64, left: f64) -> f64 {
    let response = (off - left) / off;
    if response.is_finite() && response > LEAST_RESPONSE {
        -off / response
    } else {
        -off
    }
}

/// Moves a state by a change, unless a reading failed.
fn retract_finite(layout: &Layout, state: &mut [f64], change: &[f64]) {
    if change.iter().all(|x| x.is_finite()) {
        retract(layout, state, change);
    }
}

impl Estimate {
    /// Updates the segments' initial states according to their readings, so that the model at given
    /// values reads the same there.
    ///
    /// Returns the changes, `nx` per walk, or nothing if nothing changes.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn read_as(
        &mut self,
        context: &Context<'_>,
        map: &mut StepMap<'_>,
        theta: &[f64],
    ) -> Result<Vec<Vec<f64>>> {
        let layout = &context.plant().layout;
        let mut read = context.read.clone();
        if map.has_segments() && map.alters_readings() {
            let before = misread(context, map, theta, &read)?;
            let mut tried = read.clone();
            for (state, off) in tried.iter_mut().zip(&before) {
                let change: Vec<f64> = off.iter().map(|off| -off).collect();
                retract_finite(layout, state, &change);
            }
            let after = misread(context, map, theta, &tried)?;
            // Turns about several axes do not add up, and no effect scales an orientation.
            let turns = |i: usize| {
                let mut joints = layout.joints.iter().filter_map(rotation);
                joints.any(|(_, dof)| (dof..dof + 3).contains(&i))
            };
            for ((state, before), after) in read.iter_mut().zip(&before).zip(&after) {
                let each = before.iter().zip(after).enumerate();
                let change = each.map(|(i, (off, left))| {
                    let left = if turns(i) { 0.0 } else { *left };
                    made_up(*off, left)
                });
                let change: Vec<f64> = change.collect();
                retract_finite(layout, state, &change);
            }
        }
        let pairs = read.iter().zip(&self.read);
        let changes: Vec<Vec<f64>> = pairs
            .map(|(to, from)| {
                let mut change = vec![0.0; 2 * layout.nv];
                difference(layout, to, from, &mut change);
                change
            })
            .collect();
        self.read = read;
        let moves = changes.iter().flatten().any(|x| *x != 0.0);
        Ok(if moves { changes } else { Vec::new() })
    }

    /// Replays the segments from initial states `before` that follow their readings by `changes`.
    ///
    /// A segment takes its replay if that leaves less than the residuals `left` so far.
    pub(super) fn follow(
        &mut self,
        map: &mut StepMap<'_>,
        theta: &[f64],
        (before, changes): (&[Vec<f64>], &[Vec<f64>]),
        left: &mut [f64],
    ) -> Result<()> {
        if changes.is_empty() {
            return Ok(());
        }
        let layout = map.layout().clone();
        let width = layout.nq + layout.nv;
        let mut other = before.to_vec();
        for (states, change) in other.iter_mut().zip(changes) {
            retract(&layout, &mut states[..width], change);
        }
        let most: Vec<Option<f64>> = left.iter().map(|left| Some(*left)).collect();
        self.take_better(map, theta, (other, &most), left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Change of a position of which its sensor reads as much as 0.5 m reads to one without error.
    fn found(reads: impl Fn(f64) -> f64) -> f64 {
        let off = reads(0.5) - 0.5;
        0.5 + made_up(off, reads(0.5 - off) - 0.5)
    }

    /// Symptom: the prior of a segment's initial state contradicted the true scale of an encoder by
    /// several deviations. Cause: a step to first order, `(2 - s) x` in place of `x / s`.
    #[test]
    fn a_position_that_reads_the_same_is_found_for_a_bias_and_a_scale() {
        for scale in [0.3, 0.7, 1.1, 1.3, 2.0, 3.0] {
            let at = found(|x| scale * x + 0.1);
            assert!((at - 0.4 / scale).abs() < 1e-12, "{scale}: {at}");
        }
        assert!((found(|x| x + 0.04) - 0.46).abs() < 1e-12);
        assert_eq!(found(|x| x), 0.5);
        // A sensor that is stuck at 0.6 m shows no position: the step is that of a bias.
        assert!((found(|_| 0.6) - 0.4).abs() < 1e-12);
    }
}
