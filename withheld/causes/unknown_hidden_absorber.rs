//! `unknown:hidden-absorber`: a mass on a spring is attached to a joint and oscillates by itself.
//!
//! The size is its inertia. Its frequency is between 2 and 6 Hz, its damping ratio 0.05.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, scalar_joints};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct HiddenAbsorber;

struct Law {
    dof: usize,
    qpos: usize,
    inertia: f64,
    stiffness: f64,
    damping: f64,
    place: f64,
    speed: f64,
}

impl Force for Law {
    fn begin(&mut self, sim: &mut Sim) {
        self.place = sim.qpos()[self.qpos];
        self.speed = sim.qvel()[self.dof];
    }
    fn act(&mut self, sim: &mut Sim) {
        let (twist, rate) = (
            self.place - sim.qpos()[self.qpos],
            self.speed - sim.qvel()[self.dof],
        );
        let force = self.stiffness * twist + self.damping * rate;
        self.speed -= sim.dt * force / self.inertia;
        self.place += sim.dt * self.speed;
        sim.push_joint(self.dof, force);
    }
}

impl Cause for HiddenAbsorber {
    fn name(&self) -> &'static str {
        "unknown:hidden-absorber"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        scalar_joints(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        3.0 * place.force() / place.speed()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let frequency = std::f64::consts::TAU * place.between(0, 2.0, 6.0);
        let joint = place.joint();
        world.forces.push(Box::new(Law {
            dof: joint.dof,
            qpos: joint.qpos,
            inertia: size,
            stiffness: size * frequency.powi(2),
            damping: 2.0 * 0.05 * size * frequency,
            place: 0.0,
            speed: 0.0,
        }));
        vec![("inertia", size), ("frequency", frequency)]
    }
}
