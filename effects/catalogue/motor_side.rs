//! The motor side of a transmission: a rotor with its drive, behind a spring or a gap.
//!
//! [`transmission`] has the equations of a time step.

mod transmission;

use std::cell::Cell;

use crate::{Acting, Site};
use asid_core::simulator::StepView;
use asid_core::{Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::plant::{Drive, DriveLaw, ForceLimit};

use super::drive::gains;
use super::target;

use transmission::{Begun, Between, Law, Transmission};

/// Names of the joints with a single drive whose rotor can be told from the joint.
pub fn sites(plant: &Plant) -> Vec<String> {
    let joints = plant.scalar_joints();
    joints
        .filter(|&j| {
            let mut drives = plant.drives_of(j);
            match (drives.next(), drives.next()) {
                (Some((_, drive)), None) => {
                    drive.is_memoryless()
                        && (drive.law != DriveLaw::Motor || plant.joints[j].armature > 0.0)
                }
                _ => false,
            }
        })
        .map(|j| plant.layout.joints[j].name.clone())
        .collect()
}

/// Parameters that move from the joint to the rotor, and the damping that the coupling changes.
///
/// They are the joint's damping, its rotor inertia, and the gains of a servo.
pub fn targets(plant: &Plant, site: &str) -> Vec<Target> {
    let mut targets = vec![
        target("joint", site, "damping", 0),
        target("joint", site, "armature", 0),
    ];
    let joint = plant.layout.joints.iter().position(|j| j.name == site);
    if let Some((i, _)) = joint.and_then(|j| plant.drives_of(j).next()) {
        targets.extend(gains(plant, i));
    }
    targets
}

/// A rotor and its drive.
pub struct MotorSide {
    actuator: usize,
    qpos: usize,
    dof: usize,
    damping: usize,
    armature: usize,
    gains: Vec<usize>,
    drive: Drive,
    /// Limits of its force by other effects.
    force_limits: Vec<ForceLimit>,
    timestep: f64,
    between: Between,
    /// Rotor inertia and gains of the simulation, from before the joint's were set to zero.
    inertia: Cell<f64>,
    kp: Cell<f64>,
    kv: Cell<f64>,
    /// Angle and speed of the rotor, and the step that begins there.
    ///
    /// There is no step where the rotor was just moved along with its joint.
    state: Option<([f64; 2], Option<Begun>)>,
}

impl MotorSide {
    /// Attaches it behind a spring of a compliance (rad/(N m) or m/N) and a damping ratio.
    pub fn with_spring(site: &Site<'_>, compliance: f64, loss: f64) -> Result<Self> {
        Ok(Self {
            between: Between {
                compliance,
                loss,
                half_gap: 0.0,
            },
            ..Self::rigid(site)?
        })
    }

    /// Attaches it behind a gap (rad or m).
    pub fn with_gap(site: &Site<'_>, gap: f64) -> Result<Self> {
        Ok(Self {
            between: Between {
                half_gap: gap / 2.0,
                ..Between::default()
            },
            ..Self::rigid(site)?
        })
    }

    fn rigid(site: &Site<'_>) -> Result<Self> {
        let joint = site.plant.layout.joint(site.name)?;
        let joints = &site.plant.layout.joints;
        let index = joints.iter().position(|j| j.name == site.name);
        let found = index.and_then(|j| site.plant.drives_of(j).next());
        let Some((actuator, drive)) = found else {
            return Err(asid_core::Error::Failed(format!(
                "joint `{}` has no drive",
                site.name
            )));
        };
        let limits = site.plant.force_limits.iter();
        let of_drive = limits.filter(|(of, _)| *of == actuator);
        Ok(Self {
            actuator,
            qpos: joint.qpos,
            dof: joint.qvel,
            damping: site.columns[0],
            armature: site.columns[1],
            gains: site.columns[2..].to_vec(),
            drive: *drive,
            force_limits: of_drive.map(|(_, limit)| *limit).collect(),
            timestep: site.plant.layout.timestep,
            between: Between::default(),
            inertia: Cell::new(0.0),
            kp: Cell::new(0.0),
            kv: Cell::new(0.0),
            state: None,
        })
    }

    fn law(&self, command: f64) -> Law {
        let (g, kp, kv) = (self.drive.gear, self.kp.get(), self.kv.get());
        match self.drive.law {
            DriveLaw::Motor => Law {
                a: g * command,
                b: 0.0,
                d: 0.0,
            },
            DriveLaw::Position { .. } => Law {
                a: g * kp * command,
                b: g * g * kp,
                d: g * g * kv,
            },
            DriveLaw::Velocity { .. } => Law {
                a: g * kv * command,
                b: 0.0,
                d: g * g * kv,
            },
        }
    }

    fn transmission(&self) -> Transmission {
        Transmission {
            between: self.between,
            inertia: self.inertia.get(),
            dt: self.timestep,
        }
    }

    /// The force of the drive where its law asks for one, at a speed of the rotor; and its law
    /// there, if it is at a limit.
    fn limited(&self, asked: f64, speed: f64) -> (f64, Option<Law>) {
        let constant = |a: f64| Some(Law { a, b: 0.0, d: 0.0 });
        let (mut force, mut law) = (asked, None);
        if let Some(range) = self.drive.force_range {
            let [x, y] = range.map(|f| f * self.drive.gear);
            let [low, high] = [x.min(y), x.max(y)];
            if force < low || force > high {
                force = if force < low { low } else { high };
                law = constant(force);
            }
        }
        for limit in &self.force_limits {
            let most = limit.at(speed);
            if force.abs() > most {
                force = most.copysign(force);
                law = if force * speed > 0.0 {
                    // The fall with speed is a damper of the rotor.
                    Some(Law {
                        a: limit.force.copysign(force),
                        b: 0.0,
                        d: limit.force / limit.speed,
                    })
                } else {
                    constant(force)
                };
            }
        }
        (force, law)
    }
}

impl Acting for MotorSide {
    fn set(&self, columns: &mut [f64]) {
        self.inertia
            .set(std::mem::take(&mut columns[self.armature]));
        let mut take = |i: usize| std::mem::take(&mut columns[self.gains[i]]);
        match self.drive.law {
            DriveLaw::Motor => {}
            DriveLaw::Position { .. } => {
                self.kp.set(take(0));
                self.kv.set(take(1));
            }
            DriveLaw::Velocity { .. } => self.kv.set(take(0)),
        }
    }

    fn before_step(&mut self, view: &mut StepView<'_>) {
        let (q, v) = (view.qpos[self.qpos], view.qvel[self.dof]);
        let law = self.law(view.ctrl[self.actuator]);
        let transmission = self.transmission();
        let rotor = match &self.state {
            Some((rotor, Some(begun))) => transmission.complete(begun, *rotor, q),
            Some((rotor, None)) => *rotor,
            None => transmission.settled(law, |asked| self.limited(asked, v).0, q, v),
        };
        let mut begun = transmission.begin(law, rotor, q, v);
        let [angle, speed] = transmission.complete(&begun, rotor, q + v * self.timestep);
        let asked = law.a - law.b * angle - law.d * speed;
        if let (_, Some(held)) = self.limited(asked, rotor[1]) {
            begun = transmission.begin(held, rotor, q, v);
        }
        if self.drive.law == DriveLaw::Motor {
            view.ctrl[self.actuator] = 0.0;
        }
        view.force[self.dof] += begun.force;
        view.parameters[self.damping] += begun.damping;
        self.state = Some((rotor, Some(begun)));
    }

    /// Moves the rotor along until its spring and its drive are in balance.
    fn displaced(&mut self, from: [&[f64]; 2], to: [&[f64]; 2]) {
        let place = |[qpos, qvel]: [&[f64]; 2]| [qpos[self.qpos], qvel[self.dof]];
        let (from, to) = (place(from), place(to));
        let Some((rotor, begun)) = self.state else {
            return;
        };
        let law = begun.map_or_else(|| self.law(0.0), |b| b.law);
        let transmission = self.transmission();
        let rotor = begun.map_or(rotor, |b| transmission.complete(&b, rotor, from[0]));
        let moved = transmission.taken_along(law, rotor, (from, to));
        let is_finite = moved.iter().all(|x| x.is_finite());
        self.state = is_finite.then_some((moved, None));
    }

    fn restart(&mut self) {
        self.state = None;
    }

    fn save(&self, memory: &mut Vec<f64>) {
        let Some((rotor, begun)) = &self.state else {
            return;
        };
        memory.extend(rotor);
        if let Some(begun) = begun {
            memory.extend(begun.numbers());
        }
    }

    fn load(&mut self, memory: &[f64]) {
        self.state = match *memory {
            [angle, speed] => Some(([angle, speed], None)),
            [angle, speed, ref begun @ ..] => Begun::of(begun).map(|b| ([angle, speed], Some(b))),
            _ => None,
        };
    }
}
