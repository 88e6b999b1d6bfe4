//! Parameters: a target resolved in this engine ([`resolve`]), and how its value is read and set.

mod resolve;

use asid_core::{Error, Result, Target};

use crate::compiled::Compiled;
use crate::tables::Tables;

/// A target resolved in a scene. Indices are those of the layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterSlot {
    /// `geom/NAME/friction/I`.
    GeomFriction(usize, usize),
    /// `geom/NAME/pos/I`.
    GeomPosition(usize, usize),
    /// `geom/NAME/mass`.
    GeomMass(usize),
    /// `body/NAME/mass`.
    BodyMass(usize),
    /// `body/NAME/ipos/I`.
    BodyCenter(usize, usize),
    /// `body/NAME/inertia/I`.
    BodyInertia(usize, usize),
    /// `body/NAME/pos/I`.
    BodyPlace(usize, usize),
    /// `joint/NAME/pos/I`.
    Anchor(usize, usize),
    /// `joint/NAME/axis/I`.
    Axis(usize, usize),
    /// `joint/NAME/damping`.
    Damping(usize),
    /// `joint/NAME/frictionloss`.
    Frictionloss(usize),
    /// `joint/NAME/stiffness`.
    Stiffness(usize),
    /// `joint/NAME/armature`.
    Armature(usize),
    /// `actuator/NAME/kp`.
    PositionGain(usize),
    /// `actuator/NAME/kv`.
    VelocityGain(usize),
    /// `actuator/NAME/gear`.
    Gear(usize),
    /// `option/gravity/I`.
    Gravity(usize),
}

fn bad(target: &Target, message: impl Into<String>) -> Error {
    Error::Parameter {
        parameter: target.to_string(),
        message: message.into(),
    }
}

impl ParameterSlot {
    /// Its value.
    pub fn get(self, tables: &Tables, compiled: &Compiled) -> f64 {
        let inertia = |body| compiled.masses.inertia(body, &tables.structure);
        match self {
            Self::GeomFriction(g, i) => f64::from(tables.friction[g][i]),
            Self::GeomPosition(g, i) => tables.structure.geoms[g].position[i],
            Self::GeomMass(g) => tables.structure.geoms[g].mass,
            Self::BodyMass(b) => inertia(b).mass,
            Self::BodyCenter(b, i) => inertia(b).center[i],
            Self::BodyInertia(b, i) => inertia(b).moments[i],
            Self::BodyPlace(b, i) => tables.structure.places[b][i],
            Self::Anchor(j, i) => tables.structure.anchors[j][i],
            Self::Axis(j, i) => tables.structure.axes[j][i],
            Self::Damping(j) => tables.joints[j].damping,
            Self::Frictionloss(j) => tables.joints[j].frictionloss,
            Self::Stiffness(j) => tables.joints[j].stiffness,
            Self::Armature(j) => tables.joints[j].armature,
            Self::PositionGain(a) => tables.actuators[a].kp,
            Self::VelocityGain(a) => tables.actuators[a].kv,
            Self::Gear(a) => tables.actuators[a].gear,
            Self::Gravity(i) => tables.gravity[i],
        }
    }

    /// Sets it.
    pub fn set(self, tables: &mut Tables, value: f64) {
        match self {
            Self::GeomFriction(g, i) => tables.friction[g][i] = value as f32,
            Self::GeomPosition(g, i) => tables.structure.geoms[g].position[i] = value,
            Self::GeomMass(g) => tables.structure.geoms[g].mass = value,
            Self::BodyMass(b) => tables.structure.bodies[b].mass = Some(value),
            Self::BodyCenter(b, i) => tables.structure.bodies[b].center[i] = Some(value),
            Self::BodyInertia(b, i) => tables.structure.bodies[b].inertia[i] = Some(value),
            Self::BodyPlace(b, i) => tables.structure.places[b][i] = value,
            Self::Anchor(j, i) => tables.structure.anchors[j][i] = value,
            Self::Axis(j, i) => tables.structure.axes[j][i] = value,
            Self::Damping(j) => tables.joints[j].damping = value,
            Self::Frictionloss(j) => tables.joints[j].frictionloss = value,
            Self::Stiffness(j) => tables.joints[j].stiffness = value,
            Self::Armature(j) => tables.joints[j].armature = value,
            Self::PositionGain(a) => tables.actuators[a].kp = value,
            Self::VelocityGain(a) => tables.actuators[a].kv = value,
            Self::Gear(a) => tables.actuators[a].gear = value,
            Self::Gravity(i) => tables.gravity[i] = value,
        }
    }

    /// Whether the value may change from step to step.
    pub fn is_live(self) -> bool {
        matches!(
            self,
            Self::GeomFriction(..) | Self::Damping(_) | Self::Frictionloss(_) | Self::Stiffness(_)
        )
    }

    /// Whether the value is stored in rapier's bodies and shapes.
    pub fn is_structural(self) -> bool {
        matches!(
            self,
            Self::GeomPosition(..)
                | Self::GeomMass(_)
                | Self::BodyMass(_)
                | Self::BodyCenter(..)
                | Self::BodyInertia(..)
                | Self::BodyPlace(..)
                | Self::Anchor(..)
                | Self::Axis(..)
        )
    }

    /// Checks that a value is finite and physical.
    ///
    /// # Errors
    /// [`Error::Parameter`], naming the target.
    pub fn check(self, target: &Target, value: f64) -> Result<()> {
        if !value.is_finite() {
            return Err(bad(target, format!("{value} is not finite")));
        }
        match self {
            Self::GeomPosition(..)
            | Self::BodyPlace(..)
            | Self::Anchor(..)
            | Self::Axis(..)
            | Self::BodyCenter(..)
            | Self::Gravity(_)
            | Self::Gear(_) => {}
            Self::BodyMass(_) | Self::BodyInertia(..) if value <= 0.0 => {
                return Err(bad(target, format!("must be positive, not {value}")));
            }
            _ if value < 0.0 => {
                return Err(bad(target, format!("must not be negative, as {value} is")));
            }
            _ => {}
        }
        Ok(())
    }
}
