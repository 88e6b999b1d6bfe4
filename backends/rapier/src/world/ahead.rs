//! The step after a state that was set.

use super::{StepInput, World};
use crate::compiled::Compiled;
use crate::state::State;

impl World {
    /// The state a step later, under the command of the first keyframe, or none.
    ///
    /// rapier finds contacts and their forces in a step. Those of a state that was set are
    /// therefore the ones of this step.
    pub(super) fn ahead(&self, compiled: &Compiled) -> State {
        let mut copy = Self::new(compiled);
        copy.tables.clone_from(&self.tables);
        copy.adopt(compiled, &self.state);
        let layout = &compiled.layout;
        let none = vec![0.0; layout.nu()];
        let ctrl = layout.keyframes.first().map_or(&none, |key| &key.ctrl);
        copy.step(
            compiled,
            &StepInput {
                ctrl,
                wrenches: &[],
                hook: None,
                slots: &[],
                row: 0,
                step: 0,
            },
        );
        copy.state
    }
}
