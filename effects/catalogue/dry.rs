//! Dry friction of a hinge or slide, the same in every engine.
//!
//! A joint that slides feels the force `F` against its speed. One that stands, or is about to stop,
//! feels damping of `F / max(|v|, v0)`, which engines integrate implicitly. It comes to rest
//! without chatter, is held except for a creep below `v0`, and slides again in the step after its
//! speed has passed `v0`. It is about to stop where its speed is less than the last step's change
//! of it. (MuJoCo's own `frictionloss` has by default a time constant of 20 ms, over which a joint
//! that should stand still glides.)

use crate::Site;
use asid_core::Result;
use asid_core::simulator::StepView;

use super::at_least;

/// Default speed below which a joint counts as standing, rad/s or m/s.
pub const CREEP: f64 = 0.01;

/// Dry friction at a joint. The joint's damping is the first target of the effect.
pub struct DryFriction {
    damping: usize,
    dof: usize,
    creep: f64,
    /// Speed at the start of the previous step.
    pub before: Option<f64>,
}

impl DryFriction {
    /// For a site that is a joint; below the speed `creep` it counts as standing.
    pub fn new(site: &Site<'_>, creep: f64) -> Result<Self> {
        Ok(Self {
            damping: site.columns[0],
            dof: site.plant.layout.joint(site.name)?.qvel,
            creep: at_least(site, "creep", creep, 1e-9)?,
            before: None,
        })
    }

    /// Resists motion with a force (N or N m) in the coming step.
    pub fn resist(&mut self, view: &mut StepView<'_>, friction: f64) {
        let speed = view.qvel[self.dof];
        let change = speed - self.before.unwrap_or(speed);
        if speed.abs() > change.abs() + self.creep {
            view.force[self.dof] -= friction.copysign(speed);
        } else {
            view.parameters[self.damping] += friction.max(0.0) / speed.abs().max(self.creep);
        }
        self.before = Some(speed);
    }
}
