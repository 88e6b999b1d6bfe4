//! Parameters: what a target is in this engine, its value, and setting it.

use asid_core::layout::{JointKind, Layout};
use asid_core::{Error, Result, Target};
use mjcf_rs::extras::ActuatorKind;

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
    /// `joint/NAME/pos/I`.
    Anchor(usize, usize),
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

fn find<'a>(
    target: &Target,
    kind: &'static str,
    names: impl Iterator<Item = &'a str> + Clone,
) -> Result<usize> {
    names.clone().position(|n| n == target.name).ok_or_else(|| {
        bad(
            target,
            Error::unknown(kind, &target.name, names).to_string(),
        )
    })
}

impl ParameterSlot {
    /// Resolves a target.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the scene has no such thing or setting it
    /// changes nothing, [`Error::Incapable`] where this engine cannot.
    pub fn resolve(target: &Target, compiled: &Compiled) -> Result<Self> {
        let layout: &Layout = &compiled.layout;
        let (attribute, i) = (target.attribute.as_str(), target.index);
        let slot = match target.element.as_str() {
            "option" if attribute == "gravity" => Self::Gravity(i),
            "geom" => {
                let geom = find(target, "geom", layout.geoms.iter().map(String::as_str))?;
                let body = compiled.body_of_geom[geom];
                let follows = body != 0 && compiled.masses.follows_geoms(body);
                match attribute {
                    "friction" if compiled.colliders[geom].is_none() => {
                        return Err(bad(target, "the geom takes part in no contact"));
                    }
                    "friction" => Self::GeomFriction(geom, i),
                    "pos" if !follows && compiled.colliders[geom].is_none() => {
                        return Err(bad(target, "the geom has neither mass nor contact"));
                    }
                    "pos" => Self::GeomPosition(geom, i),
                    "mass" if !compiled.masses.is_primitive(geom) => {
                        return Err(bad(target, "the geom is no primitive with a mass"));
                    }
                    "mass" if !follows => {
                        return Err(bad(
                            target,
                            "the body's mass comes from its <inertial> and not from its geoms",
                        ));
                    }
                    "mass" => Self::GeomMass(geom),
                    "solref" | "solimp" => {
                        return Err(Error::Incapable {
                            backend: "rapier".into(),
                            what: format!(
                                "set `{target}`: its contacts are equally stiff everywhere"
                            ),
                        });
                    }
                    _ => return Err(unknown(target, "friction, pos, mass")),
                }
            }
            "body" => {
                let body = find(target, "body", layout.bodies.iter().map(String::as_str))?;
                if body == 0 {
                    return Err(bad(target, "the world has no mass"));
                }
                match attribute {
                    "mass" => Self::BodyMass(body),
                    "ipos" => Self::BodyCenter(body, i),
                    "inertia" => Self::BodyInertia(body, i),
                    _ => return Err(unknown(target, "mass, ipos, inertia")),
                }
            }
            "joint" => {
                let names = layout.joints.iter().map(|j| j.name.as_str());
                let joint = find(target, "joint", names)?;
                let slot = &compiled.joints[joint];
                if slot.handle.is_none() {
                    return Err(incapable_of(target, "a free joint"));
                }
                let alone = layout.joints.len()
                    == 1 + (compiled.joints.iter().enumerate())
                        .filter(|&(i, j)| i != joint && j.body != slot.body)
                        .count();
                match attribute {
                    "pos" if slot.kind != JointKind::Hinge => {
                        return Err(bad(target, "only the anchor of a hinge can be changed"));
                    }
                    "pos" if !alone => {
                        return Err(incapable_of(target, "a body with several joints"));
                    }
                    "pos" => Self::Anchor(joint, i),
                    "damping" => Self::Damping(joint),
                    "frictionloss" => Self::Frictionloss(joint),
                    "stiffness" if slot.kind.qvel_len() > 1 => {
                        return Err(incapable_of(target, "a ball joint"));
                    }
                    "stiffness" => Self::Stiffness(joint),
                    "armature" => Self::Armature(joint),
                    _ => {
                        return Err(unknown(
                            target,
                            "pos, damping, frictionloss, stiffness, armature",
                        ));
                    }
                }
            }
            "actuator" => {
                let names = layout.actuators.iter().map(|a| a.name.as_str());
                let actuator = find(target, "actuator", names)?;
                match (attribute, compiled.actuators[actuator].kind) {
                    ("kp", ActuatorKind::Position) => Self::PositionGain(actuator),
                    ("kv", ActuatorKind::Position | ActuatorKind::Velocity) => {
                        Self::VelocityGain(actuator)
                    }
                    ("gear", _) => Self::Gear(actuator),
                    ("kp" | "kv", _) => return Err(bad(target, "this actuator has no such gain")),
                    _ => return Err(unknown(target, "kp, kv, gear")),
                }
            }
            _ => return Err(bad(target, "this engine has no such parameter")),
        };
        let entries = match slot {
            Self::GeomFriction(..)
            | Self::GeomPosition(..)
            | Self::Anchor(..)
            | Self::BodyCenter(..)
            | Self::BodyInertia(..)
            | Self::Gravity(_) => 3,
            _ => 1,
        };
        if i >= entries {
            return Err(bad(target, format!("index {i} is out of 0..{entries}")));
        }
        Ok(slot)
    }

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
            Self::Anchor(j, i) => tables.structure.anchors[j][i],
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
            Self::Anchor(j, i) => tables.structure.anchors[j][i] = value,
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

    /// True where the value may change from step to step.
    pub fn is_live(self) -> bool {
        matches!(
            self,
            Self::GeomFriction(..) | Self::Damping(_) | Self::Frictionloss(_) | Self::Stiffness(_)
        )
    }

    /// True where the value lives in rapier's bodies and shapes.
    pub fn is_structural(self) -> bool {
        matches!(
            self,
            Self::GeomPosition(..)
                | Self::GeomMass(_)
                | Self::BodyMass(_)
                | Self::BodyCenter(..)
                | Self::BodyInertia(..)
                | Self::Anchor(..)
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
            | Self::Anchor(..)
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

fn unknown(target: &Target, known: &str) -> Error {
    bad(
        target,
        format!(
            "`{}` of a {} is not a parameter; known: {known}",
            target.attribute, target.element
        ),
    )
}

fn incapable_of(target: &Target, what: &str) -> Error {
    Error::Incapable {
        backend: "rapier".into(),
        what: format!("set `{target}`: it is that of {what}"),
    }
}
