//! The parameters of one simulation.

use asid_mjcf::plant::{DriveLaw, law};
use mjcf_rs::Model;

use crate::structure::Structure;

/// Passive forces of a joint, SI units, of each degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointValues {
    /// Damping.
    pub damping: f64,
    /// Dry friction.
    pub frictionloss: f64,
    /// Spring.
    pub stiffness: f64,
    /// Rotor inertia.
    pub armature: f64,
}

/// Gains of an actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorValues {
    /// Position gain.
    pub kp: f64,
    /// Velocity gain.
    pub kv: f64,
    /// Ratio.
    pub gear: f64,
}

/// All parameters of one simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Tables {
    /// Friction of each geom: sliding, torsional (m), rolling (m).
    pub friction: Vec<[f32; 3]>,
    /// Each joint.
    pub joints: Vec<JointValues>,
    /// Each actuator.
    pub actuators: Vec<ActuatorValues>,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Masses and places.
    pub structure: Structure,
}

impl Tables {
    /// Values of a parsed document.
    pub fn new(model: &Model, structure: Structure) -> Self {
        let bodies = || model.bodies.iter().map(|b| &b.body);
        Self {
            friction: bodies()
                .flat_map(|b| &b.geoms)
                .map(|g| g.friction.map(|f| f as f32))
                .collect(),
            joints: bodies()
                .flat_map(|b| &b.joints)
                .map(|j| JointValues {
                    damping: j.damping,
                    frictionloss: j.frictionloss,
                    stiffness: j.stiffness,
                    armature: j.armature,
                })
                .collect(),
            actuators: model
                .actuators
                .iter()
                .map(|a| {
                    let (kp, kv) = match law(a) {
                        Some((DriveLaw::Position { kp, kv }, _)) => (kp, kv),
                        Some((DriveLaw::Velocity { kv }, _)) => (0.0, kv),
                        Some((DriveLaw::Motor, _)) | None => (0.0, 0.0),
                    };
                    let gear = a.gear[0];
                    ActuatorValues { kp, kv, gear }
                })
                .collect(),
            gravity: model.option.gravity,
            structure,
        }
    }
}
