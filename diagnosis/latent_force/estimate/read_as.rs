//! Initial states of segments according to their readings, in a model that reads differently from
//! the given one.
//!
//! A shift of a reading also shifts the position that it stands for. A ball that seems to come to
//! rest 3 cm above its floor was also thrown from 3 cm lower. Derivatives do not lead an initial
//! state there, because each bounce that comes earlier or later is a local minimum of its own. So
//! where the model's readings change, the initial states that leave the readings unchanged are
//! tried in addition to those that derivatives suggest.

use asid_core::Result;

use crate::latent_force::context::Context;
use crate::latent_force::initial::position_entries;
use crate::latent_force::step_map::StepMap;
use crate::latent_force::tangent::{difference, retract};

use super::Estimate;

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
            let entries = position_entries(context.plant(), context.logs);
            let now = map.readings_at(theta, &context.read)?;
            let mut differ = vec![0.0; context.logs.entries.len()];
            let mut change = vec![0.0; 2 * layout.nv];
            let each = now.iter().zip(&context.as_read).zip(&mut read);
            for ((now, as_given), state) in each {
                context.logs.reading_difference(now, as_given, &mut differ);
                for (change, entry) in change.iter_mut().zip(&entries) {
                    *change = entry.map_or(0.0, |e| -differ[e]);
                }
                if change.iter().all(|x| x.is_finite()) {
                    retract(layout, state, &change);
                }
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
