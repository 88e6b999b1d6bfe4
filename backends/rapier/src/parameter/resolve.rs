//! Resolves a target's name into a slot, with one function for each kind of element.
//!
//! A target that would change nothing is refused: its identification would return the prior and
//! look like a measurement.

use asid_core::layout::{JointKind, Layout};
use asid_core::{Error, Result, Target};
use mjcf_rs::extras::ActuatorKind;

use super::{ParameterSlot, bad};
use crate::compiled::Compiled;
use crate::pairs::Overruled;

impl ParameterSlot {
    /// Resolves a target.
    ///
    /// # Errors
    /// [`Error::Parameter`] when the scene has no such element or setting it changes nothing,
    /// [`Error::Incapable`] when this engine cannot set it.
    pub fn resolve(target: &Target, compiled: &Compiled) -> Result<Self> {
        let slot = match target.element.as_str() {
            "option" if target.attribute == "gravity" => Self::Gravity(target.index),
            "geom" => of_geom(target, compiled)?,
            "body" => of_body(target, compiled)?,
            "joint" => of_joint(target, compiled)?,
            "actuator" => of_actuator(target, compiled)?,
            _ => return Err(bad(target, "this engine has no such parameter")),
        };
        let (i, entries) = (target.index, slot.entries());
        if i >= entries {
            return Err(bad(target, format!("index {i} is out of 0..{entries}")));
        }
        Ok(slot)
    }

    /// Resolves the targets of a batch.
    ///
    /// # Errors
    /// As [`ParameterSlot::resolve`], and where two targets set the same thing.
    pub fn resolve_all(targets: &[Target], compiled: &Compiled) -> Result<Vec<(Target, Self)>> {
        let mut columns: Vec<(Target, Self)> = Vec::with_capacity(targets.len());
        for target in targets {
            let slot = Self::resolve(target, compiled)?;
            let clash = columns.iter().find(|(_, o)| slot.clashes(*o, compiled));
            if let Some((other, _)) = clash {
                let message = if other == target {
                    "is named twice".to_owned()
                } else {
                    format!("sets the same mass properties as `{other}`; use one of them")
                };
                return Err(bad(target, message));
            }
            columns.push((target.clone(), slot));
        }
        Ok(columns)
    }

    /// Whether two slots set the same thing: the mass of a body is that of its geoms.
    fn clashes(self, other: Self, compiled: &Compiled) -> bool {
        match (self, other) {
            (Self::BodyMass(body), Self::GeomMass(geom) | Self::GeomPosition(geom, _))
            | (Self::GeomMass(geom) | Self::GeomPosition(geom, _), Self::BodyMass(body)) => {
                compiled.body_of_geom[geom] == body && compiled.masses.follows_geoms(body)
            }
            _ => self == other,
        }
    }

    /// Number of entries of the attribute.
    fn entries(self) -> usize {
        match self {
            Self::GeomFriction(..)
            | Self::GeomPosition(..)
            | Self::BodyPlace(..)
            | Self::Anchor(..)
            | Self::Axis(..)
            | Self::BodyCenter(..)
            | Self::BodyInertia(..)
            | Self::Gravity(_) => 3,
            _ => 1,
        }
    }
}

fn of_geom(target: &Target, compiled: &Compiled) -> Result<ParameterSlot> {
    let names = compiled.layout.geoms.iter().map(String::as_str);
    let geom = find(target, "geom", names)?;
    let body = compiled.body_of_geom[geom];
    let follows = body != 0 && compiled.masses.follows_geoms(body);
    let slot = match target.attribute.as_str() {
        "friction" if compiled.colliders[geom].is_none() => {
            return Err(bad(target, "the geom takes part in no contact"));
        }
        "friction" => {
            if let Some(by) = compiled.pairs.overruled(geom) {
                return Err(without_effect(target, by, &compiled.layout));
            }
            ParameterSlot::GeomFriction(geom, target.index)
        }
        "pos" if !follows && compiled.colliders[geom].is_none() => {
            return Err(bad(target, "the geom has neither mass nor contact"));
        }
        "pos" => ParameterSlot::GeomPosition(geom, target.index),
        "mass" if !compiled.masses.is_primitive(geom) => {
            return Err(bad(target, "the geom is no primitive with a mass"));
        }
        "mass" if !follows => {
            return Err(bad(
                target,
                "the body's mass comes from its <inertial> and not from its geoms",
            ));
        }
        "mass" => ParameterSlot::GeomMass(geom),
        "solref" | "solimp" => {
            return Err(Error::Incapable {
                backend: "rapier".into(),
                what: format!("set `{target}`: its contacts are equally stiff everywhere"),
            });
        }
        _ => return Err(unknown(target, "friction, pos, mass")),
    };
    Ok(slot)
}

fn of_body(target: &Target, compiled: &Compiled) -> Result<ParameterSlot> {
    let names = compiled.layout.bodies.iter().map(String::as_str);
    let body = find(target, "body", names)?;
    if body == 0 {
        return Err(bad(
            target,
            "the world has neither place nor mass properties",
        ));
    }
    let joints = compiled.joints.iter().filter(|j| j.body == body);
    let joints: Vec<_> = joints.collect();
    match target.attribute.as_str() {
        "mass" => Ok(ParameterSlot::BodyMass(body)),
        "ipos" => Ok(ParameterSlot::BodyCenter(body, target.index)),
        "inertia" => Ok(ParameterSlot::BodyInertia(body, target.index)),
        "pos" if joints.is_empty() => Err(incapable_of(target, "a body without joints")),
        "pos" if joints.len() > 1 => Err(incapable_of(target, "a body with several joints")),
        "pos" if joints[0].handle.is_none() => Err(bad(
            target,
            "the place of a free body is its state, and no parameter",
        )),
        "pos" => Ok(ParameterSlot::BodyPlace(body, target.index)),
        _ => Err(unknown(target, "pos, mass, ipos, inertia")),
    }
}

fn of_joint(target: &Target, compiled: &Compiled) -> Result<ParameterSlot> {
    let joints = &compiled.layout.joints;
    let joint = find(target, "joint", joints.iter().map(|j| j.name.as_str()))?;
    let slot = &compiled.joints[joint];
    if slot.handle.is_none() {
        return Err(incapable_of(target, "a free joint"));
    }
    let others = compiled.joints.iter().enumerate();
    let alone = joints.len()
        == 1 + others
            .filter(|&(i, j)| i != joint && j.body != slot.body)
            .count();
    match target.attribute.as_str() {
        "pos" if slot.kind != JointKind::Hinge => {
            Err(bad(target, "only the anchor of a hinge can be changed"))
        }
        "pos" if !alone => Err(incapable_of(target, "a body with several joints")),
        "pos" => Ok(ParameterSlot::Anchor(joint, target.index)),
        "axis" if !matches!(slot.kind, JointKind::Hinge | JointKind::Slide) => Err(bad(
            target,
            "only the `axis` of a hinge or slide can be changed",
        )),
        "axis" if !alone => Err(incapable_of(target, "a body with several joints")),
        "axis" => Ok(ParameterSlot::Axis(joint, target.index)),
        "damping" => Ok(ParameterSlot::Damping(joint)),
        "frictionloss" => Ok(ParameterSlot::Frictionloss(joint)),
        "stiffness" if slot.kind.qvel_len() > 1 => Err(incapable_of(target, "a ball joint")),
        "stiffness" => Ok(ParameterSlot::Stiffness(joint)),
        "armature" => Ok(ParameterSlot::Armature(joint)),
        _ => Err(unknown(
            target,
            "pos, axis, damping, frictionloss, stiffness, armature",
        )),
    }
}

fn of_actuator(target: &Target, compiled: &Compiled) -> Result<ParameterSlot> {
    let names = compiled.layout.actuators.iter().map(|a| a.name.as_str());
    let actuator = find(target, "actuator", names)?;
    let kind = compiled.actuators[actuator].kind;
    match (target.attribute.as_str(), kind) {
        ("kp", ActuatorKind::Position) => Ok(ParameterSlot::PositionGain(actuator)),
        ("kv", ActuatorKind::Position | ActuatorKind::Velocity) => {
            Ok(ParameterSlot::VelocityGain(actuator))
        }
        ("gear", _) => Ok(ParameterSlot::Gear(actuator)),
        ("kp" | "kv", _) => Err(bad(target, "this actuator has no such gain")),
        _ => Err(unknown(target, "kp, kv, gear")),
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

/// Error for a friction that is overruled in all contacts of its geom.
fn without_effect(target: &Target, by: Overruled, layout: &Layout) -> Error {
    let why = match by {
        Overruled::ByPair(other) => format!(
            "a <pair> gives the friction between `{}` and `{}`",
            target.name, layout.geoms[other]
        ),
        Overruled::ByPriority(other) => format!(
            "geom `{}` has the higher priority, so that its friction alone counts",
            layout.geoms[other]
        ),
    };
    bad(target, format!("it would have no effect: {why}"))
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
