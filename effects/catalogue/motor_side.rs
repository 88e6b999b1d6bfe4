//! The motor side of a transmission: a rotor with its drive, coupled to the joint by a spring, a gap,
//! or both.
//!
//! With the drive's law `a - b θ - d ω` on the rotor (angle `θ`, speed `ω`, inertia `J`, all seen
//! from the joint), a spring of compliance `C` between rotor and joint and a gap of `w`, one step of
//! `dt` of backward Euler is
//!
//! `J (ω1 - ω) / dt = a - b θ1 - d ω1 - T`, `θ1 = θ + ω1 dt`, `C T = θ1 - q1 ∓ w/2`, `q1 = q + v1 dt`,
//!
//! so the transmitted force is linear in the joint's speed at the end of the step:
//!
//! `T = K (θ + dt X / A ∓ w/2 - q) - K dt v1`, with `A = J/dt + b dt + d`, `X = J ω / dt + a - b θ`,
//! `K = 1 / (C + dt/A)`.
//!
//! The first part is applied as a force and `K dt` as damping of the joint, which engines
//! integrate implicitly: it is stable however stiff the spring is, a gap's ends are rigid and do
//! not bounce, and as `C` and `w` vanish it becomes the drive at the joint with the rotor's inertia
//! added. What the damping took over the step, however an engine divides it, follows from the way that
//! the joint went: `v1` is then `(q1 - q) / dt`, so that rotor and joint exchange equal impulses. A
//! rotor without inertia needs a law with `b` or `d`.

use std::cell::Cell;

use crate::{Acting, Site};
use asid_core::simulator::StepView;
use asid_core::{Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::plant::{Drive, DriveLaw};

use super::drive::gains;
use super::target;

/// Names of the joints that have one drive, whose motor side can be told from the joint.
pub fn sites(plant: &Plant) -> Vec<String> {
    let joints = plant.scalar_joints();
    joints
        .filter(|&j| {
            let mut drives = plant.drives_of(j);
            match (drives.next(), drives.next()) {
                (Some((_, drive)), None) => {
                    drive.law != DriveLaw::Motor || plant.joints[j].armature > 0.0
                }
                _ => false,
            }
        })
        .map(|j| plant.layout.joints[j].name.clone())
        .collect()
}

/// What is taken from the joint and given to the rotor: damping (which the coupling changes),
/// rotor inertia, and the gains of a servo.
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

/// A drive's force on its rotor, `a - b θ - d ω`, seen from the joint.
#[derive(Clone, Copy, Debug)]
struct Law {
    a: f64,
    b: f64,
    d: f64,
}

/// A step that was begun, to be completed once the joint's speed after it is known.
#[derive(Clone, Copy, Debug)]
struct Begun {
    law: Law,
    /// Transmitted force `force - damping v1`.
    force: f64,
    damping: f64,
    /// Where the joint was.
    from: f64,
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
    timestep: f64,
    compliance: f64,
    half_gap: f64,
    /// Rotor inertia and gains, as the simulation's parameters were before they were taken.
    inertia: Cell<f64>,
    kp: Cell<f64>,
    kv: Cell<f64>,
    /// Angle and speed of the rotor, and the step that leads on from there; none where it has just been taken along.
    state: Option<([f64; 2], Option<Begun>)>,
}

impl MotorSide {
    /// Attaches it with a compliance (rad/(N m) or m/N) and a gap (rad or m).
    pub fn new(site: &Site<'_>, compliance: f64, gap: f64) -> Result<Self> {
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
        Ok(Self {
            actuator,
            qpos: joint.qpos,
            dof: joint.qvel,
            damping: site.columns[0],
            armature: site.columns[1],
            gains: site.columns[2..].to_vec(),
            drive: *drive,
            timestep: site.plant.layout.timestep,
            compliance,
            half_gap: gap / 2.0,
            inertia: Cell::new(0.0),
            kp: Cell::new(0.0),
            kv: Cell::new(0.0),
            state: None,
        })
    }

    fn law(&self, command: f64) -> Law {
        let command = match self.drive.ctrl_range {
            Some([low, high]) => command.clamp(low, high),
            None => command,
        };
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

    /// `A` and `X` of a law.
    fn coefficients(&self, law: Law, [angle, speed]: [f64; 2]) -> (f64, f64) {
        let inertia = self.inertia.get() / self.timestep;
        (
            inertia + law.b * self.timestep + law.d,
            inertia * speed + law.a - law.b * angle,
        )
    }

    /// The step that a law begins at a joint's position and speed.
    fn begin(&self, law: Law, rotor: [f64; 2], q: f64, v: f64) -> Begun {
        let dt = self.timestep;
        let (resistance, push) = self.coefficients(law, rotor);
        if resistance <= 0.0 {
            // Nothing holds the rotor back: its drive's force passes.
            return Begun {
                law,
                force: law.a,
                damping: 0.0,
                from: q,
            };
        }
        let ahead = rotor[0] + dt * push / resistance - q;
        let stiffness = 1.0 / (self.compliance + dt / resistance);
        let stretch = ahead - v * dt;
        if stretch.abs() < self.half_gap {
            return Begun {
                law,
                force: 0.0,
                damping: 0.0,
                from: q,
            };
        }
        Begun {
            law,
            force: stiffness * (ahead - self.half_gap.copysign(stretch)),
            damping: stiffness * dt,
            from: q,
        }
    }

    /// The rotor after a step that ended with the joint at `q`.
    fn complete(&self, begun: &Begun, rotor: [f64; 2], q: f64) -> [f64; 2] {
        let v = (q - begun.from) / self.timestep;
        let force = begun.force - begun.damping * v;
        let (resistance, push) = self.coefficients(begun.law, rotor);
        if resistance <= 0.0 {
            let stretch = self.compliance * force + self.half_gap * force.signum();
            return [q + stretch, v];
        }
        let speed = (push - force) / resistance;
        [rotor[0] + speed * self.timestep, speed]
    }

    /// Where a rotor at rest with its joint would be.
    fn settled(&self, law: Law, q: f64, v: f64) -> [f64; 2] {
        let end = if law.b > 0.0 {
            (law.a / law.b).clamp(q - self.half_gap, q + self.half_gap)
        } else if law.a == 0.0 {
            q
        } else {
            q + self.half_gap.copysign(law.a)
        };
        let angle = (end + self.compliance * law.a) / (1.0 + self.compliance * law.b);
        [angle, v]
    }

    /// A rotor whose joint was placed elsewhere, `from` and `to` a position and a speed. In balance the spring pulls as much more as the drive
    /// does, so that the rotor follows by `1 / (1 + C b)`: all of the way behind a stiff spring, and not at all within its gap.
    fn taken_along(&self, law: Law, rotor: [f64; 2], (from, to): ([f64; 2], [f64; 2])) -> [f64; 2] {
        let is_free = (rotor[0] - from[0]).abs() < self.half_gap;
        let follows = if is_free {
            0.0
        } else {
            1.0 / (1.0 + self.compliance * law.b)
        };
        let mut moved = [0, 1].map(|i| rotor[i] + follows * (to[i] - from[i]));
        if is_free {
            moved[0] = moved[0].clamp(to[0] - self.half_gap, to[0] + self.half_gap);
        }
        moved
    }

    /// Limits of the drive's force on the joint.
    fn limits(&self) -> Option<[f64; 2]> {
        self.drive.force_range.map(|range| {
            let [x, y] = range.map(|f| f * self.drive.gear);
            [x.min(y), x.max(y)]
        })
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
        let rotor = match &self.state {
            Some((rotor, Some(begun))) => self.complete(begun, *rotor, q),
            Some((rotor, None)) => *rotor,
            None => self.settled(law, q, v),
        };
        let mut begun = self.begin(law, rotor, q, v);
        if let Some([low, high]) = self.limits() {
            let [angle, speed] = self.complete(&begun, rotor, q + v * self.timestep);
            let asked = law.a - law.b * angle - law.d * speed;
            if asked < low || asked > high {
                let held = Law {
                    a: asked.clamp(low, high),
                    b: 0.0,
                    d: 0.0,
                };
                begun = self.begin(held, rotor, q, v);
            }
        }
        if self.drive.law == DriveLaw::Motor {
            view.ctrl[self.actuator] = 0.0;
        }
        view.force[self.dof] += begun.force;
        view.parameters[self.damping] += begun.damping;
        self.state = Some((rotor, Some(begun)));
    }

    /// The rotor is taken along as far as its spring and its drive are then in balance.
    fn displaced(&mut self, from: [&[f64]; 2], to: [&[f64]; 2]) {
        let place = |[qpos, qvel]: [&[f64]; 2]| [qpos[self.qpos], qvel[self.dof]];
        let (from, to) = (place(from), place(to));
        let Some((rotor, begun)) = self.state else {
            return;
        };
        let law = begun.map_or_else(|| self.law(0.0), |b| b.law);
        let rotor = begun.map_or(rotor, |b| self.complete(&b, rotor, from[0]));
        let moved = self.taken_along(law, rotor, (from, to));
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
            let Law { a, b, d } = begun.law;
            memory.extend([a, b, d, begun.force, begun.damping, begun.from]);
        }
    }

    fn load(&mut self, memory: &[f64]) {
        self.state = match *memory {
            [angle, speed, a, b, d, force, damping, from] => {
                let law = Law { a, b, d };
                let begun = Begun {
                    law,
                    force,
                    damping,
                    from,
                };
                Some(([angle, speed], Some(begun)))
            }
            [angle, speed] => Some(([angle, speed], None)),
            _ => None,
        };
    }
}
