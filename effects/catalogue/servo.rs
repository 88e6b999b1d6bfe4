//! Gains of servos: stiffness of the position loop and damping.
//!
//! A position servo asks for `kp (u - q) - kv v`, a velocity servo for `kv (u - v)`, each within
//! the limits of its force. The gains of a real servo are rarely those of its model: a hobby
//! servo's firmware has its own gains, in units of its own, and a model's gains were often chosen
//! to be stiff. M. Duclusaud et al., "Extended friction models for the physics simulation of servo
//! actuators", ICRA 2025, identify both.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site, Start};
use asid_core::{Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::plant::{Drive, DriveLaw};

use super::{at_least, target, values};

crate::register!(EffectEntry {
    name: "servo-stiffness",
    about: "a position servo is softer or stiffer",
    make: || Box::new(Gain::Stiffness),
});

crate::register!(EffectEntry {
    name: "servo-damping",
    about: "a servo resists speed more or less",
    make: || Box::new(Gain::Damping),
});

/// A gain of a servo.
///
/// - `Stiffness`: `kp` of a position servo times `factor`. A stiff servo of limited force sits at
///   its limit and feels no small change of its gain: the search begins at factors far from 1.
/// - `Damping`: `damping` is added to `kv`, which does not fall below 0. It is not a factor, since
///   many models have a `kv` of 0. At a velocity servo `kv` is also how firmly it follows its
///   command.
#[derive(Clone, Copy)]
enum Gain {
    Stiffness,
    Damping,
}

struct GainAt {
    gain: Gain,
    column: usize,
    value: f64,
}

impl Acting for GainAt {
    fn set(&self, columns: &mut [f64]) {
        let gain = &mut columns[self.column];
        *gain = match self.gain {
            Gain::Stiffness => *gain * self.value,
            Gain::Damping => (*gain + self.value).max(0.0),
        };
    }
}

impl Gain {
    /// The engine's name of the gain.
    fn attribute(self) -> &'static str {
        match self {
            Self::Stiffness => "kp",
            Self::Damping => "kv",
        }
    }
}

impl Effect for Gain {
    fn mistaken_for(&self) -> &'static [Confusion] {
        match self {
            Self::Stiffness => &[Confusion {
                with: &["actuator-saturation", "joint-compliance", "actuator-lag"],
                told_apart_by: "hold it still and hang a known weight on it: a soft servo's own encoder shows the sag, in proportion to the weight",
            }],
            Self::Damping => &[Confusion {
                with: &["viscous-friction", "actuator-lag"],
                told_apart_by: "move it by hand with the drive off, or drive it into its limit of force",
            }],
        }
    }

    fn unusual_at(&self, plant: &Plant, site: &str) -> bool {
        // Without a force limit a position servo's damping equals its joint's: friction is
        // likelier.
        let without_limit = |drive: Drive| drive.is_position_servo() && drive.force_range.is_none();
        matches!(self, Self::Damping) && plant.drive(site).is_ok_and(|(_, d)| without_limit(d))
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        match self {
            Self::Stiffness => {
                const {
                    &[EffectParameter::new("factor", "1", [0.003, 10.0], 1.0)
                        .starting(Start::Values(&[0.05, 0.3, 2.0]))]
                }
            }
            Self::Damping => {
                const {
                    &[EffectParameter::new(
                        "damping",
                        "N m s/rad or N s/m, before the gear",
                        [-500.0, 500.0],
                        0.0,
                    )]
                }
            }
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let has = |drive: &Drive| match (self, drive.law) {
            (_, DriveLaw::Position { .. }) | (Self::Damping, DriveLaw::Velocity { .. }) => true,
            (_, DriveLaw::Motor) | (Self::Stiffness, DriveLaw::Velocity { .. }) => false,
        };
        let actuators = plant.layout.actuators.iter().zip(&plant.drives);
        actuators
            .filter(|(_, drive)| drive.as_ref().is_some_and(has))
            .map(|(actuator, _)| actuator.name.clone())
            .collect()
    }

    fn targets(&self, _plant: &Plant, site: &str) -> Vec<Target> {
        vec![target("actuator", site, self.attribute(), 0)]
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [value] = values(site)?;
        if let Self::Stiffness = self {
            at_least(site, "factor", value, 0.0)?;
        }
        Ok(Box::new(GainAt {
            gain: *self,
            column: site.columns[0],
            value,
        }))
    }
}
