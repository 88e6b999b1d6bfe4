//! `unknown:hysteretic-spring`: rubber, whose force depends on the path (Bouc 1967, Wen 1976).
//!
//! The force is `-F z` with `dz/dt = (v - |v| z) / s`. The state `z` stays between -1 and 1 and
//! reverses over a travel of `s`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct HystereticSpring;

struct Law {
    dof: usize,
    force: f64,
    travel: f64,
    state: f64,
}

impl Force for Law {
    fn begin(&mut self, _sim: &mut Sim) {
        self.state = 0.0;
    }
    fn act(&mut self, sim: &mut Sim) {
        let v = sim.qvel()[self.dof];
        self.state += sim.dt * (v - v.abs() * self.state) / self.travel;
        sim.push_joint(self.dof, -self.force * self.state);
    }
}

impl Cause for HystereticSpring {
    fn name(&self) -> &'static str {
        "unknown:hysteretic-spring"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let travel = place.between(0, 0.3, 1.0) * place.roam();
        world.forces.push(Box::new(Law {
            dof: place.joint().dof,
            force: size,
            travel,
            state: 0.0,
        }));
        vec![("force", size), ("travel", travel)]
    }
}
