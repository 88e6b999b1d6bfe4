//! A drive in a simulation: its law with the simulation's gains, and how its force is limited.

use std::cell::Cell;

use crate::{Acting, Site};
use asid_core::simulator::StepView;
use asid_core::{Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::plant::{Drive, DriveLaw, ForceLimit};

use super::target;

/// The gains of a drive as targets: `kp` and `kv` of a position servo, `kv` of a velocity servo.
pub fn gains(plant: &Plant, actuator: usize) -> Vec<Target> {
    let name = &plant.layout.actuators[actuator].name;
    let gains: &[&str] = match plant.drives[actuator].map(|d| d.law) {
        Some(DriveLaw::Position { .. }) => &["kp", "kv"],
        Some(DriveLaw::Velocity { .. }) => &["kv"],
        Some(DriveLaw::Motor) | None => &[],
    };
    let targets = gains.iter();
    targets
        .map(|gain| target("actuator", name, gain, 0))
        .collect()
}

/// The law with other gains, in the order of [`gains`].
pub fn with_gains(law: DriveLaw, gains: impl IntoIterator<Item = f64>) -> DriveLaw {
    let mut gains = gains.into_iter();
    let mut next = |old: f64| gains.next().unwrap_or(old);
    match law {
        DriveLaw::Motor => DriveLaw::Motor,
        DriveLaw::Position { kp, kv } => {
            let kp = next(kp);
            DriveLaw::Position { kp, kv: next(kv) }
        }
        DriveLaw::Velocity { kv } => DriveLaw::Velocity { kv: next(kv) },
    }
}

/// A drive in one simulation.
pub struct DriveAt {
    /// Index of its actuator.
    pub actuator: usize,
    /// Index of its joint in `qpos`.
    pub qpos: usize,
    /// Index of its joint in `qvel`.
    pub dof: usize,
    /// Columns of its gains.
    columns: Vec<usize>,
    drive: Cell<Drive>,
}

impl DriveAt {
    /// The drive of an actuator; the columns of its [`gains`] are the next of `columns`.
    pub fn new(
        plant: &Plant,
        actuator: usize,
        drive: Drive,
        columns: &mut impl Iterator<Item = usize>,
    ) -> Self {
        let joint = &plant.layout.joints[drive.joint];
        let count = gains(plant, actuator).len();
        Self {
            actuator,
            qpos: joint.qpos,
            dof: joint.qvel,
            columns: columns.take(count).collect(),
            drive: Cell::new(drive),
        }
    }

    /// The drive of a site that is an actuator.
    ///
    /// Its gains follow the first `skip` targets of the effect.
    pub fn of_site(site: &Site<'_>, skip: usize) -> Result<Self> {
        let (actuator, drive) = site.plant.drive(site.name)?;
        let mut columns = site.columns[skip..].iter().copied();
        Ok(Self::new(site.plant, actuator, drive, &mut columns))
    }

    /// Takes over the gains of the simulation.
    pub fn set(&self, columns: &[f64]) {
        let gains = self.columns.iter().map(|&c| columns[c]);
        let mut drive = self.drive.get();
        drive.law = with_gains(drive.law, gains);
        self.drive.set(drive);
    }

    /// Force on the joint that the command asks for (N or N m), within the drive's own limits.
    pub fn force(&self, view: &StepView<'_>) -> f64 {
        let (q, v) = (view.qpos[self.qpos], view.qvel[self.dof]);
        self.drive.get().force(view.ctrl[self.actuator], q, v)
    }

    /// Holds the force on the joint (N or N m) at less than the drive asks for, for the coming
    /// step.
    ///
    /// The command becomes the one that makes this force now. A servo's damping would change the
    /// force over the step, since engines integrate it implicitly. The joint's damping, column
    /// `damping`, compensates that. (An engine that integrates `kp` implicitly too, as rapier does,
    /// falls short of the force by `kp v dt`.)
    pub fn hold(&self, view: &mut StepView<'_>, force: f64, damping: usize) {
        let drive = self.drive.get();
        let (q, v) = (view.qpos[self.qpos], view.qvel[self.dof]);
        let Some(command) = drive.command_for(force, q, v) else {
            return;
        };
        view.ctrl[self.actuator] = command;
        let kv = match drive.law {
            DriveLaw::Motor => return,
            DriveLaw::Position { kv, .. } | DriveLaw::Velocity { kv } => kv,
        };
        let taken = drive.gear * drive.gear * kv;
        view.force[self.dof] -= taken * v;
        view.parameters[damping] -= taken;
    }
}

/// A drive whose force on the joint, gear included, stays within limits.
///
/// Where several effects limit one drive, one of them applies all limits, so that the damping is
/// compensated once ([`DriveAt::hold`]).
pub struct LimitedAt {
    drive: DriveAt,
    damping: usize,
    limits: Vec<ForceLimit>,
}

impl LimitedAt {
    /// The drive of a site that is an actuator, within its `own` limit and those that other effects
    /// have handed over.
    ///
    /// The damping of its joint is the first target of the effect, and its gains follow.
    pub fn of_site(site: &Site<'_>, own: ForceLimit) -> Result<Self> {
        let drive = DriveAt::of_site(site, 1)?;
        let others = site.plant.force_limits.iter();
        let others = others.filter(|(of, _)| *of == drive.actuator);
        Ok(Self {
            limits: others.map(|(_, limit)| *limit).chain([own]).collect(),
            damping: site.columns[0],
            drive,
        })
    }
}

impl Acting for LimitedAt {
    fn set(&self, columns: &mut [f64]) {
        self.drive.set(columns);
    }

    fn before_step(&mut self, view: &mut StepView<'_>) {
        let v = view.qvel[self.drive.dof];
        let least = self
            .limits
            .iter()
            .min_by(|a, b| a.at(v).total_cmp(&b.at(v)));
        let Some(limit) = least else { return };
        let (most, asked) = (limit.at(v), self.drive.force(view));
        if asked.abs() <= most {
            return;
        }
        self.drive.hold(view, most.copysign(asked), self.damping);
        if asked * v > 0.0 && most > 0.0 {
            // Zero for a limit that does not fall with speed.
            let fall = limit.force / limit.speed;
            view.force[self.drive.dof] += fall * v;
            view.parameters[self.damping] += fall;
        }
    }
}

/// Lets a drive have a command beyond its range.
///
/// The range limits the command that a drive is given. What effects make of it is behind that
/// limit: a motor that is stronger than its model is so at the end of its range too. Engines hold
/// the command that effects leave within the range, so the rest of the force is added at the joint.
pub struct BeyondRange {
    drive: DriveAt,
    range: [f64; 2],
}

impl BeyondRange {
    /// The drive of an actuator with the columns of its [`gains`]; `None` for one without a range.
    pub fn new(plant: &Plant, actuator: usize, columns: &[usize]) -> Option<Self> {
        let range = plant.layout.actuators[actuator].ctrl_range?;
        let drive = plant.drives[actuator]?;
        let mut columns = columns.iter().copied();
        Some(Self {
            drive: DriveAt::new(plant, actuator, drive, &mut columns),
            range,
        })
    }
}

impl Acting for BeyondRange {
    fn set(&self, columns: &mut [f64]) {
        self.drive.set(columns);
    }

    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = view.ctrl[self.drive.actuator];
        let held = command.clamp(self.range[0], self.range[1]);
        if held != command {
            let asked = self.drive.force(view);
            view.ctrl[self.drive.actuator] = held;
            view.force[self.drive.dof] += asked - self.drive.force(view);
        }
    }
}
