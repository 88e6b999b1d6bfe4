//! The causes, one file each, in the order of the catalogue; those of no catalogue come last.

use crate::cause::Cause;

mod actuator_delay;
mod coulomb_friction;
mod gravity_tilt;
mod unknown_magnet;
mod viscous_friction;

/// All causes.
pub const ALL: &[&dyn Cause] = &[
    &actuator_delay::ActuatorDelay,
    &viscous_friction::ViscousFriction,
    &coulomb_friction::CoulombFriction,
    &gravity_tilt::GravityTilt,
    &unknown_magnet::Magnet,
];

/// The cause of a name.
#[must_use]
pub fn named(name: &str) -> Option<&'static dyn Cause> {
    ALL.iter().copied().find(|c| c.name() == name)
}
