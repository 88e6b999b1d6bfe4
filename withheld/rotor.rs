//! The rotor of a drive, separate from the joint that it drives.
//!
//! The transmission between them, play or elasticity, is a law of the difference of their angles.
//! The rotor is integrated by hand in many small steps within one step of the engine, while the
//! joint moves on at constant speed. The mean of the transmitted force acts on the joint. The
//! engine's own actuator and armature are off.

use crate::anatomy::{Anatomy, Drive, DriveKind};
use crate::engine::Sim;
use crate::world::{Force, World};

/// Inertia of a servo's rotor if the model gives none, as a share of the joint's inertia.
///
/// It is too small to be seen and large enough to be integrated.
const LIGHT: f64 = 0.003;
/// Largest phase, rad, of the rotor's fastest oscillation within a small step.
const PHASE: f64 = 0.2;
/// Maximum number of small steps within a step.
const MOST: f64 = 400.0;
/// Damping ratio of the transmission's own oscillation: metal on metal with grease.
const RATIO: f64 = 0.3;

/// The transmission between rotor and joint.
#[derive(Clone, Copy, Debug)]
pub enum Transmission {
    /// Play of this width, rad or m, between slightly compliant ends.
    Play(f64),
    /// Compliance, rad/(N m) or m/N.
    Compliance(f64),
}

/// The rotor of a joint's drive.
pub struct Rotor {
    transmission: Transmission,
    drive: Drive,
    actuator: usize,
    qpos: usize,
    dof: usize,
    armature: f64,
    /// Inertia, set when an episode begins.
    inertia: f64,
    stiffness: f64,
    damping: f64,
    angle: f64,
    speed: f64,
}

impl Rotor {
    /// Removes a joint's drive from the engine and puts a rotor in its place.
    pub fn install(machine: &Anatomy, joint: usize, how: Transmission, world: &mut World) {
        let Some(actuator) = machine.drive_of(joint) else {
            return;
        };
        let mut drive = machine.drives[actuator].clone();
        let j = &machine.joints[joint];
        let element = world.document.find("joint", Some(&j.name));
        let armature = element.and_then(|e| e.number("armature")).unwrap_or(0.0);
        world.edit_joint(&j.name, "armature", |_| 0.0);
        if let Some(e) = world.document.find_in_mut("actuator", &drive.name) {
            // Other causes may have changed the drive's values.
            drive.kp = e.number("kp").unwrap_or(drive.kp);
            drive.kv = e.number("kv").unwrap_or(drive.kv);
            drive.limit = e
                .numbers("forcerange")
                .last()
                .copied()
                .unwrap_or(drive.limit);
            // The engine's actuator becomes a motor without gear; the command goes to the rotor
            // instead.
            e.tag = "motor".into();
            e.attributes.retain(|(n, _)| {
                !matches!(
                    &**n,
                    "kp" | "kv" | "forcerange" | "forcelimited" | "dampratio"
                )
            });
            e.set("gear", "0");
        }
        world.forces.push(Box::new(Self {
            transmission: how,
            drive,
            actuator,
            qpos: j.qpos,
            dof: j.dof,
            armature,
            inertia: 0.0,
            stiffness: 0.0,
            damping: 0.0,
            angle: 0.0,
            speed: 0.0,
        }));
    }

    /// Force of the drive on the rotor.
    fn drive_force(&self, command: f64) -> f64 {
        let d = &self.drive;
        let (x, v) = (d.gear * self.angle, d.gear * self.speed);
        let force = match d.kind {
            DriveKind::Position => d.kp * (command - x) - d.kv * v,
            DriveKind::Velocity => d.kv * (command - v),
            DriveKind::Motor | DriveKind::Thrust => command,
        };
        d.gear * force.clamp(-d.limit, d.limit)
    }

    /// Force on the joint if the rotor is ahead of it by `twist` and faster by `rate`.
    fn transmitted(&self, twist: f64, rate: f64) -> f64 {
        match self.transmission {
            Transmission::Compliance(_) => self.stiffness * twist + self.damping * rate,
            Transmission::Play(width) => {
                let depth = twist.abs() - width / 2.0;
                if depth <= 0.0 {
                    return 0.0;
                }
                let side = twist.signum();
                // The ends push but never pull.
                side * (self.stiffness * depth + self.damping * rate * side).max(0.0)
            }
        }
    }
}

impl Force for Rotor {
    fn begin(&mut self, sim: &mut Sim) {
        let link = sim.inertia(self.dof);
        self.inertia = if self.armature > 0.0 {
            self.armature
        } else {
            LIGHT * link
        };
        // The largest stiffness that the engine's step allows on the joint's side: a phase of 0.3
        // per step.
        let most = link * (0.3 / sim.dt).powi(2);
        self.stiffness = match self.transmission {
            Transmission::Play(_) => most,
            Transmission::Compliance(c) => (1.0 / c).min(most),
        };
        let reduced = self.inertia * link / (self.inertia + link);
        self.damping = 2.0 * RATIO * (self.stiffness * reduced).sqrt();
        if let Transmission::Compliance(_) = self.transmission {
            // Elastic elements of drives dissipate little.
            self.damping *= 0.1;
        }
        self.angle = sim.qpos()[self.qpos];
        self.speed = sim.qvel()[self.dof];
    }

    fn act(&mut self, sim: &mut Sim) {
        let command = sim.ctrl()[self.actuator];
        let (mut joint, rate) = (sim.qpos()[self.qpos], sim.qvel()[self.dof]);
        let servo = self.drive.kp * self.drive.gear.powi(2);
        let fastest = ((self.stiffness + servo) / self.inertia).sqrt();
        let small = (sim.dt * fastest / PHASE).ceil().clamp(1.0, MOST);
        let dt = sim.dt / small;
        let viscous = match self.drive.kind {
            DriveKind::Position | DriveKind::Velocity => self.drive.kv * self.drive.gear.powi(2),
            _ => 0.0,
        };
        let mut sum = 0.0;
        for _ in 0..small as usize {
            let force = self.transmitted(self.angle - joint, self.speed - rate);
            sum += force;
            // The drive's damping is integrated implicitly; an explicit step would be unstable for
            // a light rotor.
            let push = (self.drive_force(command) - force) * dt;
            self.speed += push / (self.inertia + viscous * dt);
            self.angle += self.speed * dt;
            joint += rate * dt;
        }
        sim.push_joint(self.dof, sum / small);
    }
}
