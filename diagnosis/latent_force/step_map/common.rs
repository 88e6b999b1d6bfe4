//! What all parts of a map share: the logs, the machine, and what each value acts on.

use asid_core::layout::{Layout, Recording};

use crate::batch_columns::BatchColumns;
use crate::data::Logs;
use crate::latent_force::islands::Islands;
use crate::latent_force::walk::Walk;

use super::sensors::Sensors;
use super::{Derivatives, Variation};

/// What all parts share.
pub(super) struct Common<'a> {
    pub(super) logs: &'a Logs,
    pub(super) walks: &'a [Walk],
    pub(super) layout: Layout,
    pub(super) columns: BatchColumns,
    pub(super) states: Recording,
    pub(super) readings: Recording,
    /// Both in one row: first the state.
    pub(super) states_and_readings: Recording,
    /// Largest number of roles in one pass.
    pub(super) capacity: usize,
    /// Whether a step may depend on time or on earlier states: by an effect on commands, forces or
    /// readings, or by what the model's own actuators remember.
    pub(super) depends_on_past: bool,
    /// Whether an effect makes readings depend on earlier ones.
    pub(super) remembers_readings: bool,
    /// Whether each entry of a row is of a sensor with such an effect.
    pub(super) late: Vec<bool>,
    /// Whether an effect changes what sensors read.
    pub(super) alters_readings: bool,
    /// Whether one physics step gives a row's derivatives with respect to the state.
    pub(super) one_step: bool,
    /// Uncoupled degrees of freedom, which one simulation perturbs together.
    pub(super) islands: Islands,
    /// Whether each parameter acts in every physics step alike, as a property of the model does.
    pub(super) at_once: Vec<bool>,
    /// Whether each parameter belongs to an effect on readings.
    pub(super) measured: Vec<bool>,
    /// What the readings depend on.
    pub(super) sensors: Sensors,
}

impl Common<'_> {
    /// Returns the number of the episode that a walk belongs to.
    pub(super) fn episode(&self, walk: usize) -> usize {
        self.logs.episodes[self.walks[walk].episode].number
    }

    /// Whether a walk is replayed from its first row, with the derivatives of the whole replay.
    ///
    /// True for a segment, unless derivatives with respect to forces are wanted: those are
    /// derivatives over single rows.
    pub(super) fn rolls(&self, walk: usize, want: Derivatives) -> bool {
        self.walks[walk].segment.is_some() && !want.force
    }

    /// Writes what the log reads at row `k` of a walk less a reading of the model; NaN where it
    /// does not count.
    pub(super) fn residual(&self, (walk, k): (&Walk, usize), read: &[f64], out: &mut [f64]) {
        self.logs
            .reading_difference(walk.readings(self.logs, k), read, out);
        if walk.segment.is_some_and(|lead| k < lead) {
            out.fill(f64::NAN);
        }
        if k == 0 && walk.rows[0] > 0 {
            // The command before it, which a force follows, is in another walk.
            for (x, entry) in out.iter_mut().zip(&self.logs.entries) {
                if self.logs.sensors[entry.sensor].jumps {
                    *x = f64::NAN;
                }
            }
        }
    }

    /// Whether a variation changes only parameters that act in every physics step alike.
    ///
    /// False where sensors have memory, since their readings depend on other steps too.
    pub(super) fn acts_at_once(&self, theta: &[f64], variation: &Variation) -> bool {
        let values = theta.iter().zip(&variation.theta).zip(&self.at_once);
        let mut varied = values.filter(|((a, b), _)| a != b);
        !self.remembers_readings && varied.all(|(_, at_once)| *at_once)
    }

    /// Whether a variation changes effects on readings alone.
    ///
    /// Its motion is that of the unperturbed model, so it is only read.
    pub(super) fn is_read_alone(&self, theta: &[f64], variation: &Variation) -> bool {
        let values = theta.iter().zip(&variation.theta).zip(&self.measured);
        values
            .filter(|((a, b), _)| a != b)
            .all(|(_, measured)| *measured)
    }

    /// Whether a variation changes the readings of an unchanged state.
    pub(super) fn is_read(&self, theta: &[f64], variation: &Variation) -> bool {
        let values = theta.iter().zip(&variation.theta);
        let mut of_values = values.zip(&self.sensors.of_readings);
        !self.sensors.read_the_state
            || of_values.any(|((a, b), of_readings)| *of_readings && a != b)
    }
}
