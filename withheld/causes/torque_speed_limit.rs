//! `torque-speed-limit`: the largest force of a drive falls with speed, `F (1 - |v| / v0)`, as in a
//! motor on a battery.
//!
//! The size says how close the limit comes: `v0` is the typical speed divided by the size. `F` is
//! the largest force that the machine needed.

use crate::anatomy::{Anatomy, DriveKind};
use crate::cause::{Cause, Place, Standing, Values, joint_drives};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct TorqueSpeedLimit;

struct Limit {
    actuator: usize,
    kind: DriveKind,
    /// `kp`, `kv`, gear.
    gains: [f64; 3],
    /// Indices of position and velocity.
    at: [usize; 2],
    force: f64,
    speed: f64,
}

impl Force for Limit {
    fn act(&mut self, sim: &mut Sim) {
        let [kp, kv, gear] = self.gains;
        let [q, v] = self.at;
        let (x, rate) = (gear * sim.qpos()[q], gear * sim.qvel()[v]);
        let share = (1.0 - sim.qvel()[v].abs() / self.speed).max(0.0);
        let most = self.force * share / gear.abs();
        let command = sim.ctrl()[self.actuator];
        // Sends the command that gives the limited force.
        sim.ctrl()[self.actuator] = match self.kind {
            DriveKind::Position => {
                let force = (kp * (command - x) - kv * rate).clamp(-most, most);
                (force + kv * rate) / kp + x
            }
            DriveKind::Velocity => {
                let force = (kv * (command - rate)).clamp(-most, most);
                force / kv + rate
            }
            DriveKind::Motor | DriveKind::Thrust => command.clamp(-most, most),
        };
    }
}

impl Cause for TorqueSpeedLimit {
    fn name(&self) -> &'static str {
        "torque-speed-limit"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        joint_drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        1.5
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let (drive, joint) = (place.drive(), place.joint());
        let (force, speed) = (place.typical.peak[joint.dof], place.speed() / size);
        world.forces.push(Box::new(Limit {
            actuator: place.drive_index(),
            kind: drive.kind,
            gains: [drive.kp, drive.kv, drive.gear],
            at: [joint.qpos, joint.dof],
            force,
            speed,
        }));
        vec![("force", force), ("speed", speed)]
    }
}
