//! An actuator's memory at the start of an episode.
//!
//! Before the first row of a log the command was the same as in that row. An actuator with a delay
//! therefore has a history of that command, and one with a first-order filter has settled on it.
//! MuJoCo itself starts both at zero.

use mujoco_rs::mujoco_c::mjtDyn;
use mujoco_rs::wrappers::mj_model::MjModel;

/// An entry of a state row that takes a command.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Entry of the row.
    entry: usize,
    actuator: usize,
    /// Limits of the command.
    range: Option<[f64; 2]>,
}

/// Entries of a simulation's state row that remember commands.
#[derive(Clone, Debug, Default)]
pub struct CommandMemory {
    places: Vec<Place>,
}

impl CommandMemory {
    /// Finds the entries; activations begin at `act` and histories at `history` of a row.
    ///
    /// An activation set by the first keyframe stays as it is; `fresh` is the row right after a
    /// reset.
    pub fn of(model: &MjModel, act: usize, history: usize, fresh: &[f64]) -> Self {
        let mut places = Vec::new();
        for actuator in 0..model.nu() as usize {
            let range = model.actuator_ctrllimited()[actuator]
                .then(|| model.actuator_ctrlrange()[actuator]);
            let mut put = |entry: usize| {
                places.push(Place {
                    entry,
                    actuator,
                    range,
                });
            };
            let filter = matches!(
                model.actuator_dyntype()[actuator],
                mjtDyn::mjDYN_FILTER | mjtDyn::mjDYN_FILTEREXACT
            );
            if let (true, Ok(at)) = (filter, usize::try_from(model.actuator_actadr()[actuator]))
                && fresh[act + at] == 0.0
            {
                put(act + at);
            }
            // A buffer holds two numbers of its own, then the times of its samples, then the
            // samples.
            if let Ok(at) = usize::try_from(model.actuator_historyadr()[actuator]) {
                let samples = model.actuator_history()[actuator][0] as usize;
                (0..samples).for_each(|k| put(history + at + 2 + samples + k));
            }
        }
        Self { places }
    }

    /// Fills a row as if the command had been held for a long time.
    pub fn hold(&self, row: &mut [f64], command: &[f64]) {
        for place in &self.places {
            let value = command[place.actuator];
            row[place.entry] = place
                .range
                .map_or(value, |[low, high]| value.clamp(low, high));
        }
    }

    /// Whether nothing is remembered.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }
}
