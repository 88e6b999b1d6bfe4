//! `actuator-deadband`: a small command has no effect; for a position servo, a small error.

use crate::anatomy::{Anatomy, DriveKind};
use crate::cause::{Cause, Place, Values, joint_drives};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct ActuatorDeadband;

struct Deadband {
    actuator: usize,
    /// Index of the position and gear of the joint that a position servo holds.
    servo: Option<(usize, f64)>,
    width: f64,
}

impl Force for Deadband {
    fn act(&mut self, sim: &mut Sim) {
        let zero = self.servo.map_or(0.0, |(q, gear)| gear * sim.qpos()[q]);
        let command = sim.ctrl()[self.actuator] - zero;
        let left = command.signum() * (command.abs() - self.width).max(0.0);
        sim.ctrl()[self.actuator] = zero + left;
    }
}

impl Cause for ActuatorDeadband {
    fn name(&self) -> &'static str {
        "actuator-deadband"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        joint_drives(machine)
    }
    fn largest(&self, place: &Place<'_>) -> f64 {
        2.0 * place.command()
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let drive = place.drive();
        let joint = place.joint();
        world.forces.push(Box::new(Deadband {
            actuator: place.drive_index(),
            servo: (drive.kind == DriveKind::Position).then_some((joint.qpos, drive.gear)),
            width: size,
        }));
        vec![("width", size)]
    }
}
