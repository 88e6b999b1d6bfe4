//! The motor side of a transmission: a rotor with its drive, coupled to the joint by a spring, a gap,
//! or both.
//!
//! With the drive's law `a - b θ - d ω` on the rotor (angle `θ`, speed `ω`, inertia `J`, all seen
//! from the joint), a spring of compliance `C` between rotor and joint, a damper beside it and a gap of `w`, one step of
//! `dt` is
//!
//! `J (ω1 - ω) / dt = a - b (θ + s dt ω1 - g dt ω) - d ω1 - T`,
//! `C T = θ - q ∓ w/2 + s' dt (ω1 - v1) - g' dt (ω - v) + τ (ω1 - v1)`,
//! `θ1 = θ + ω1 dt`, `q1 = q + v1 dt`,
//!
//! so the transmitted force is linear in the joint's speed at the end of the step: with `σ = s' dt + τ`,
//!
//! `T = K (θ - q ∓ w/2 - g' dt (ω - v) + σ X / A) - K σ v1`, with `A = J/dt + s b dt + d`,
//! `X = (J/dt + g b dt) ω + a - b θ`, `K = 1 / (C + σ / A)`.
//!
//! The first part is applied as a force and `K σ` as damping of the joint, which engines
//! integrate implicitly: it is stable however stiff the spring is, a gap's ends are rigid and do
//! not bounce, and as `C` and `w` vanish it becomes the drive at the joint with the rotor's inertia
//! added. What the damping took over the step, however an engine divides it, follows from the way that
//! the joint went: `v1` is then `(q1 - q) / dt`, so that rotor and joint exchange equal impulses. A
//! rotor without inertia needs a law with `b` or `d`.
//!
//! The damper is the transmission's own loss: `τ = 2 ζ sqrt(J C)` has the rotor swing against a joint that is held with a damping ratio `ζ`.
//! A spring of the step's own loss would hide it: with `s = 1` and `g = 0` (backward Euler) that is a damper of `dt`, at 1 ms more than
//! the steel of a hand-sized servo's gears. With `s = g = 1/4` a spring loses nothing, and its swing has the period of the trapezoidal rule, stable at any
//! stiffness. But what can hardly swing should not: a spring that hardly gives, and the ends of
//! a gap, are rigid, with `s = 1`, and a rotor without inertia in its gap goes to where its drive has it, by `s = 1 / (1 - exp(-x)) - 1 / x` with
//! `x = b dt / d` exactly as fast as without steps (exponential Euler). So each spring is shared between the two, by how much its rotor's inertia or its
//! compliance counts over a step: [`Share`].

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

/// How a step takes a spring: at what it gives way by until then, and `late` and `early` steps' worth of the speeds at its end and at its beginning.
#[derive(Clone, Copy, Debug)]
struct Share {
    late: f64,
    early: f64,
}

impl Share {
    /// The trapezoidal rule for a share that swings (0 to 1), `creeping` for the rest.
    fn of(swings: f64, creeping: f64) -> Self {
        Self {
            late: 0.25 * swings + creeping * (1.0 - swings),
            early: 0.25 * swings,
        }
    }
}

/// How late a step takes a spring that gives way against a damper `1 / x` of a step's time constant of it: half a step where that is long, the end
/// of the step where it is short.
fn exponential(x: f64) -> f64 {
    if x < 1e-4 {
        return 0.5 + x / 12.0;
    }
    -1.0 / (-x).exp_m1() - 1.0 / x
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
    /// `A` and `X`.
    resistance: f64,
    push: f64,
    /// Transmitted force `force - damping v1`.
    force: f64,
    damping: f64,
    /// Where the joint was.
    from: f64,
}

impl Begun {
    /// All of it, to be remembered.
    fn numbers(&self) -> [f64; 8] {
        let Law { a, b, d } = self.law;
        let (resistance, push) = (self.resistance, self.push);
        [
            a,
            b,
            d,
            resistance,
            push,
            self.force,
            self.damping,
            self.from,
        ]
    }

    /// From what was remembered.
    fn of(numbers: &[f64]) -> Option<Self> {
        let [a, b, d, resistance, push, force, damping, from] =
            <[f64; 8]>::try_from(numbers).ok()?;
        Some(Self {
            law: Law { a, b, d },
            resistance,
            push,
            force,
            damping,
            from,
        })
    }
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
    /// Damping ratio of the spring.
    loss: f64,
    half_gap: f64,
    /// Rotor inertia and gains, as the simulation's parameters were before they were taken.
    inertia: Cell<f64>,
    kp: Cell<f64>,
    kv: Cell<f64>,
    /// Angle and speed of the rotor, and the step that leads on from there; none where it has just been taken along.
    state: Option<([f64; 2], Option<Begun>)>,
}

impl MotorSide {
    /// Attaches it behind a spring, with its compliance (rad/(N m) or m/N) and its damping ratio.
    pub fn with_spring(site: &Site<'_>, compliance: f64, loss: f64) -> Result<Self> {
        Ok(Self {
            compliance,
            loss,
            ..Self::rigid(site)?
        })
    }

    /// Attaches it behind a gap (rad or m).
    pub fn with_gap(site: &Site<'_>, gap: f64) -> Result<Self> {
        Ok(Self {
            half_gap: gap / 2.0,
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
        Ok(Self {
            actuator,
            qpos: joint.qpos,
            dof: joint.qvel,
            damping: site.columns[0],
            armature: site.columns[1],
            gains: site.columns[2..].to_vec(),
            drive: *drive,
            timestep: site.plant.layout.timestep,
            compliance: 0.0,
            loss: 0.0,
            half_gap: 0.0,
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

    /// `A` and `X` of a law, for a rotor that pushes its joint or one that is free of it.
    fn coefficients(&self, law: Law, [angle, speed]: [f64; 2], pushes: bool) -> (f64, f64) {
        let inertia = self.inertia.get() / self.timestep;
        let spring = law.b * self.timestep;
        let whole = inertia + spring + law.d;
        if whole <= 0.0 {
            return (0.0, law.a - law.b * angle);
        }
        let share = if pushes {
            // With the joint's inertia, its damper does not let it creep.
            Share::of((inertia + law.d) / whole, 1.0)
        } else if law.d > 0.0 {
            Share::of(inertia / whole, exponential(spring / law.d))
        } else {
            Share::of(inertia / whole, 1.0)
        };
        (
            inertia + share.late * spring + law.d,
            (inertia + share.early * spring) * speed + law.a - law.b * angle,
        )
    }

    /// The step that a law begins at a joint's position and speed.
    fn begin(&self, law: Law, rotor: [f64; 2], q: f64, v: f64) -> Begun {
        let dt = self.timestep;
        let begun = |resistance, push| Begun {
            law,
            resistance,
            push,
            force: 0.0,
            damping: 0.0,
            from: q,
        };
        let (resistance, push) = self.coefficients(law, rotor, false);
        if resistance <= 0.0 {
            // Nothing holds the rotor back: its drive's force passes.
            return Begun {
                force: law.a,
                ..begun(resistance, push)
            };
        }
        let stretch = rotor[0] - q + dt * (push / resistance - v);
        if stretch.abs() < self.half_gap {
            return begun(resistance, push);
        }
        let (resistance, push) = self.coefficients(law, rotor, true);
        let share = Share::of(self.compliance / (self.compliance + dt / resistance), 1.0);
        let damper = 2.0 * self.loss * (self.inertia.get() * self.compliance).sqrt();
        let seconds = share.late * dt + damper;
        let stiffness = 1.0 / (self.compliance + seconds / resistance);
        let twist = rotor[0] - q - self.half_gap.copysign(stretch);
        let pulled = twist - share.early * dt * (rotor[1] - v);
        Begun {
            force: stiffness * (pulled + seconds * push / resistance),
            damping: stiffness * seconds,
            ..begun(resistance, push)
        }
    }

    /// The rotor after a step that ended with the joint at `q`.
    fn complete(&self, begun: &Begun, rotor: [f64; 2], q: f64) -> [f64; 2] {
        let v = (q - begun.from) / self.timestep;
        let force = begun.force - begun.damping * v;
        let Begun {
            resistance, push, ..
        } = *begun;
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
