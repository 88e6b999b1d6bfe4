//! Errors of a drive's response to its command: gain, bias, saturation, dead band.

use crate::{Acting, Acts, Effect, EffectParameter, Native, Reference, Site, Start};
use asid_core::simulator::StepView;
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;
use asid_mjcf::plant::{Drive, DriveLaw, ForceLimit};

use super::drive::{LimitedAt, gains};
use super::{actuators, at_least, drives, target, values};

crate::register!(EffectEntry {
    name: "actuator-gain",
    about: "the command is scaled",
    make: || Box::new(Affine {
        parameters: const { &[EffectParameter::new("gain", "1", [0.2, 2.0], 1.0)] },
        scaled: true,
    }),
});

crate::register!(EffectEntry {
    name: "actuator-bias",
    about: "the command is shifted",
    make: || Box::new(Affine {
        parameters: const {
            &[EffectParameter::new(
                "bias",
                "unit of the command",
                [-10.0, 10.0],
                0.0,
            )]
        },
        scaled: false,
    }),
});

crate::register!(EffectEntry {
    name: "actuator-saturation",
    about: "the force of a drive is limited",
    make: || Box::new(Saturation),
});

crate::register!(EffectEntry {
    name: "actuator-deadband",
    about: "small commands do nothing",
    make: || Box::new(Deadband),
});

/// `gain * command + bias`, one of the two being its parameter.
struct Affine {
    parameters: &'static [EffectParameter],
    scaled: bool,
}

struct AffineAt {
    actuator: usize,
    gain: f64,
    bias: f64,
}

impl Acting for AffineAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        *command = self.gain * *command + self.bias;
    }
}

impl Effect for Affine {
    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        self.parameters
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        actuators(plant)
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [value] = values(site)?;
        let actuator = document.actuator(site.name)?;
        if self.scaled {
            // A later gain also scales biases that were added before.
            actuator.gain *= value;
            actuator.bias *= value;
        } else {
            actuator.bias += value;
        }
        Ok(Native::Whole)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [value] = values(site)?;
        Ok(Box::new(AffineAt {
            actuator: site.plant.layout.actuator(site.name)?,
            gain: if self.scaled { value } else { 1.0 },
            bias: if self.scaled { 0.0 } else { value },
        }))
    }
}

/// Parameters that a limit of a drive's force reads and changes.
///
/// They are the joint's damping and the drive's gains.
pub(super) fn limit_targets(plant: &Plant, site: &str) -> Vec<Target> {
    let Ok((actuator, drive)) = plant.drive(site) else {
        return Vec::new();
    };
    let joint = &plant.layout.joints[drive.joint].name;
    let mut targets = vec![target("joint", joint, "damping", 0)];
    targets.extend(gains(plant, actuator));
    targets
}

/// Largest force limit of the search (N or N m): at this value the limit is off.
pub(super) const UNLIMITED: f64 = 1000.0;

/// Holds the force on the joint, gear included, within `±limit`.
///
/// The force that the drive asks for at the start of a step decides: see [`LimitedAt`].
struct Saturation;

impl Effect for Saturation {
    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("limit", "N or N m", [0.0, UNLIMITED], UNLIMITED).starting(
                    Start::Multiples(Reference::Force, &[0.9, 0.7, 0.5, 0.25, 0.1]),
                ),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        drives(plant)
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        limit_targets(plant, site)
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE | Capabilities::LIVE_PARAMETERS
    }

    fn force_limit(&self, values: &[f64]) -> Option<ForceLimit> {
        let force = *values.first()?;
        Some(ForceLimit {
            force,
            speed: f64::INFINITY,
        })
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [limit] = values(site)?;
        let actuator = document.actuator(site.name)?;
        actuator.limit = Some(actuator.limit.map_or(limit, |other| other.min(limit)));
        Ok(Native::Whole)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [limit] = values(site)?;
        let own = ForceLimit {
            force: at_least(site, "limit", limit, 0.0)?,
            speed: f64::INFINITY,
        };
        Ok(Box::new(LimitedAt::of_site(site, own)?))
    }
}

/// Moves the drive's input nearer to zero by `width`; within `width` it is zero.
///
/// The input is the command of a motor (N or N m) or a velocity servo (rad/s or m/s). For a
/// position servo it is the difference of command and position (rad or m before the gear), since no
/// position is small by itself.
struct Deadband;

struct DeadbandAt {
    actuator: usize,
    qpos: usize,
    drive: Drive,
    width: f64,
}

/// Moves `x` nearer to zero by `width`, but not beyond.
fn shrink(x: f64, width: f64) -> f64 {
    (x.abs() - width).max(0.0).copysign(x)
}

impl Acting for DeadbandAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        let zero = match self.drive.law {
            DriveLaw::Position { .. } => self.drive.gear * view.qpos[self.qpos],
            DriveLaw::Motor | DriveLaw::Velocity { .. } => 0.0,
        };
        *command = zero + shrink(*command - zero, self.width);
    }
}

/// By how much a command may change without effect.
///
/// Its start values are shares of the largest command.
pub(super) const WIDTH: EffectParameter =
    EffectParameter::new("width", "unit of the command", [0.0, 10.0], 0.0)
        .starting(Start::Multiples(Reference::Command, &[0.03, 0.1, 0.3]));

impl Effect for Deadband {
    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[WIDTH] }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        drives(plant)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [width] = values(site)?;
        let (actuator, drive) = site.plant.drive(site.name)?;
        Ok(Box::new(DeadbandAt {
            actuator,
            qpos: site.plant.layout.joints[drive.joint].qpos,
            drive,
            width: at_least(site, "width", width, 0.0)?,
        }))
    }
}
