//! The catalogue of effects, one file for each family.
//!
//! Effects are what a real machine does and its model may lack.
//!
//! - On the command: [`command`], [`command_dynamics`], [`hysteresis`], [`supply`].
//! - Of servos: [`servo`].
//! - Between a drive and its joint: [`backlash`], [`compliance`].
//! - At a joint: [`joint_friction`], [`joint_force`], [`rotor`].
//! - On bodies: [`mass`], [`payload`], [`geometry`], [`body_force`], [`gravity`].
//! - In contacts: [`contact_friction`], [`friction_field`], [`contact_softness`].
//! - On readings: [`sensor`], [`sensor_dynamics`], [`episode_offset`].
//!
//! A new family is a file here and its `mod` line; docs/add-an-effect.md lists what else it needs.
//! Private modules hold code that several families share.
//!
//! Where the engine has the same physics (damping and rotor inertia of a joint, friction and
//! softness of contacts, masses, gravity) an effect changes the engine's own parameter, which the
//! engine integrates as stably as it can. The rest are forces and commands, computed before each
//! step. A change of a parameter scales or adds to the value that the simulation has. It therefore
//! composes with a study that fits the same parameter.

pub mod backlash;
pub mod body_force;
pub mod command;
pub mod command_dynamics;
pub mod compliance;
pub mod contact_friction;
pub mod contact_softness;
pub(crate) mod drive;
mod dry;
pub mod episode_offset;
pub mod friction_field;
pub mod geometry;
pub mod gravity;
pub mod hysteresis;
pub mod joint_force;
pub mod joint_friction;
pub mod mass;
mod motor_side;
pub mod payload;
mod point;
pub mod rotor;
pub mod sensor;
pub mod sensor_dynamics;
pub mod servo;
pub mod supply;

use crate::Site;
use asid_core::{Error, Result, Target};
use asid_mjcf::Plant;

/// The values of a site, one for each parameter.
fn values<const N: usize>(site: &Site<'_>) -> Result<[f64; N]> {
    site.values.try_into().map_err(|_| {
        let given = site.values.len();
        Error::Shape(format!("{given} values for an effect's {N} parameters"))
    })
}

/// Returns `value` if it is at least `low`.
///
/// # Errors
/// When it is below `low`, or not a number.
fn at_least(site: &Site<'_>, parameter: &str, value: f64, low: f64) -> Result<f64> {
    if value >= low {
        return Ok(value);
    }
    Err(Error::Config {
        key: format!("effect at `{}`, {parameter}", site.name),
        message: format!("{value} is below {low}"),
    })
}

/// A target from its parts.
fn target(element: &str, name: &str, attribute: &str, index: usize) -> Target {
    Target {
        element: element.into(),
        name: name.into(),
        attribute: attribute.into(),
        index,
    }
}

/// Names of the hinges and slides.
fn scalar_joints(plant: &Plant) -> Vec<String> {
    let joints = plant.scalar_joints();
    joints
        .map(|j| plant.layout.joints[j].name.clone())
        .collect()
}

/// Names of all actuators: any command can be late or off, whatever it drives.
fn actuators(plant: &Plant) -> Vec<String> {
    let actuators = plant.layout.actuators.iter();
    actuators.map(|a| a.name.clone()).collect()
}

/// Names of the actuators that drive a joint by the present command, position and speed alone.
fn drives(plant: &Plant) -> Vec<String> {
    let actuators = plant.layout.actuators.iter().zip(&plant.drives);
    actuators
        .filter(|(_, drive)| drive.is_some_and(|d| d.is_memoryless()))
        .map(|(actuator, _)| actuator.name.clone())
        .collect()
}
