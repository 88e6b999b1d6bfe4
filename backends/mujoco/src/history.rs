//! An actuator's memory at the start of an episode.
//!
//! Before the first row of a log the command was the same as in that row. An actuator with a delay
//! therefore has a history of that command, as a hook leaves it, and one with a first-order filter
//! has settled on it. MuJoCo itself starts both at zero.

use mujoco_rs::mujoco_c::mjtDyn;
use mujoco_rs::wrappers::mj_model::MjModel;

use crate::ffi::Sim;

/// A number that takes a command.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Its entry among the activations or the histories.
    entry: usize,
    actuator: usize,
    /// Limits of the command.
    range: Option<[f64; 2]>,
}

impl Place {
    fn fill(&self, command: &[f64], memory: &mut [f64]) {
        let value = command[self.actuator];
        memory[self.entry] = self
            .range
            .map_or(value, |[low, high]| value.clamp(low, high));
    }
}

/// What of a simulation remembers commands.
#[derive(Clone, Debug, Default)]
pub struct CommandMemory {
    activations: Vec<Place>,
    histories: Vec<Place>,
}

impl CommandMemory {
    /// Finds the entries.
    ///
    /// An activation set by the first keyframe stays as it is; `activations` are those right after
    /// a reset.
    pub fn of(model: &MjModel, activations: &[f64]) -> Self {
        let mut found = Self::default();
        for actuator in 0..model.nu() as usize {
            let range = model.actuator_ctrllimited()[actuator]
                .then(|| model.actuator_ctrlrange()[actuator]);
            let place = |entry: usize| Place {
                entry,
                actuator,
                range,
            };
            let filter = matches!(
                model.actuator_dyntype()[actuator],
                mjtDyn::mjDYN_FILTER | mjtDyn::mjDYN_FILTEREXACT
            );
            if let (true, Ok(at)) = (filter, usize::try_from(model.actuator_actadr()[actuator]))
                && activations[at] == 0.0
            {
                found.activations.push(place(at));
            }
            // A buffer holds two numbers of its own, then the times of its samples, then the
            // samples.
            if let Ok(at) = usize::try_from(model.actuator_historyadr()[actuator]) {
                let samples = model.actuator_history()[actuator][0] as usize;
                let entries = (0..samples).map(|k| at + 2 + samples + k);
                found.histories.extend(entries.map(place));
            }
        }
        found
    }

    /// Fills them as if the present command had been held for a long time.
    pub fn hold(&self, sim: &mut Sim<'_>) {
        let (command, activations, histories) = sim.command_memory();
        for place in &self.activations {
            place.fill(command, activations);
        }
        for place in &self.histories {
            place.fill(command, histories);
        }
    }
}
