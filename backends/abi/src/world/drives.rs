//! Actuators, sensors and keyframes of a document in the header's form.

use asid_core::layout::Layout;
use asid_mjcf::plant::{DriveLaw, law};
use mjcf_rs::Model;
use mjcf_rs::extras::ActuatorKind;
use roxmltree::{Document, Node};

use super::{Rows, Texts, object, sites};
use crate::table::{self, actuator_kind};

/// The elements of all sections with a name, in the document's order.
fn elements<'a>(
    xml: &'a Document<'_>,
    section: &'static str,
) -> impl Iterator<Item = Node<'a, 'a>> {
    let sections = xml.root_element().children();
    sections
        .filter(move |n| n.has_tag_name(section))
        .flat_map(|n| n.children().filter(Node::is_element))
}

/// Actuators.
///
/// # Errors
/// When one names a joint that does not exist.
pub fn actuators(
    model: &Model,
    layout: &Layout,
    xml: &Document<'_>,
    texts: &mut Texts,
) -> Result<Vec<table::Actuator>, String> {
    let mut tags = elements(xml, "actuator").map(|n| n.tag_name().name());
    let mut drives = Vec::with_capacity(model.actuators.len());
    for (actuator, place) in model.actuators.iter().zip(&layout.actuators) {
        let kind = match actuator.kind {
            ActuatorKind::Motor => actuator_kind::MOTOR,
            ActuatorKind::Position => actuator_kind::POSITION,
            ActuatorKind::Velocity => actuator_kind::VELOCITY,
            _ => actuator_kind::OTHER,
        };
        let joint = match actuator.joint.as_deref() {
            None => table::NONE,
            Some(name) => stated(model, layout, "joint", name).ok_or_else(|| {
                format!(
                    "actuator `{}` drives joint `{name}`, which is not there",
                    place.name
                )
            })?,
        };
        let force_range = asid_mjcf::document::range(actuator.force_range);
        let force_limited = actuator
            .force_limited
            .resolve(model.compiler.autolimits, force_range.is_some());
        // A default class for `<general>` may give a servo its gains.
        let [kp, kv] = match law(actuator) {
            Some((DriveLaw::Position { kp, kv }, _)) => [kp, kv],
            Some((DriveLaw::Velocity { kv }, _)) => [0.0, kv],
            Some((DriveLaw::Motor, _)) => [0.0; 2],
            // A servo without a gain drives nothing.
            None => [actuator.kp.unwrap_or(0.0), actuator.kv.unwrap_or(0.0)],
        };
        let has = |kinds: &[i32]| f64::from(u8::from(kinds.contains(&kind)));
        drives.push(table::Actuator {
            name: texts.add(&place.name),
            // Actuators attached from another document come after all elements of this one.
            kind_name: texts.add(tags.next().unwrap_or("general")),
            kind,
            ctrl_limited: i32::from(place.ctrl_range.is_some()),
            force_limited: i32::from(force_limited),
            padding: 0,
            joint,
            gear: actuator.gear[0],
            kp: kp * has(&[actuator_kind::POSITION]),
            kv: kv * has(&[actuator_kind::POSITION, actuator_kind::VELOCITY]),
            ctrl_range: place.ctrl_range.unwrap_or_default(),
            force_range: force_range.unwrap_or_default(),
        });
    }
    Ok(drives)
}

/// Index of an element that the document itself names.
///
/// An element without a name in the document cannot be meant, whatever name it gets later.
fn stated(model: &Model, layout: &Layout, kind: &str, name: &str) -> Option<u64> {
    let named = match kind {
        "body" => name == "world" || model.body_id_by_name(name).is_some(),
        "geom" => model.geom_by_name(name).is_some(),
        "joint" => model.joint_by_name(name).is_some(),
        "actuator" => model
            .actuators
            .iter()
            .any(|a| a.name.as_deref() == Some(name)),
        _ => false,
    };
    object(layout, kind, name).filter(|_| named)
}

/// Attributes with which a sensor names its object, one for each kind.
const OBJECTS: [&str; 6] = ["joint", "body", "geom", "site", "actuator", "tendon"];

/// Sensors.
///
/// # Errors
/// When one names something that does not exist.
pub fn sensors(
    model: &Model,
    layout: &Layout,
    xml: &Document<'_>,
    texts: &mut Texts,
) -> Result<Vec<table::Sensor>, String> {
    let mut nodes = elements(xml, "sensor");
    let mut list = Vec::with_capacity(model.sensors.len());
    for (sensor, place) in model.sensors.iter().zip(&layout.sensors) {
        let named = nodes.next().and_then(|node| {
            let own = OBJECTS
                .iter()
                .find_map(|kind| Some((*kind, node.attribute(*kind)?)));
            own.or_else(|| Some((node.attribute("objtype")?, node.attribute("objname")?)))
        });
        let named =
            named.or_else(|| Some((sensor.objtype.as_deref()?, sensor.objname.as_deref()?)));
        let (kind, name) = named.unwrap_or_default();
        let place_of = |name: &str| match kind {
            "site" => sites(model)
                .position(|(_, site)| site.name.as_deref() == Some(name))
                .map(|i| i as u64),
            "xbody" => stated(model, layout, "body", name),
            _ => stated(model, layout, kind, name),
        };
        let known = matches!(
            kind,
            "joint" | "body" | "xbody" | "geom" | "site" | "actuator"
        );
        let index = match place_of(name) {
            None if known => {
                return Err(format!(
                    "sensor `{}` names {kind} `{name}`, which is not there",
                    place.name
                ));
            }
            index => index.unwrap_or(table::NONE),
        };
        list.push(table::Sensor {
            name: texts.add(&place.name),
            kind: texts.add(&place.kind),
            object_kind: texts.add(kind),
            object: index,
            address: place.address as u64,
            length: place.len as u64,
        });
    }
    Ok(list)
}

/// Starting states, with every row complete.
pub fn keyframes(layout: &Layout, texts: &mut Texts, rows: &mut Rows) -> Vec<table::Keyframe> {
    let keyframes = layout.keyframes.iter();
    keyframes
        .map(|key| table::Keyframe {
            name: texts.add(&key.name),
            qpos: rows.add(&key.qpos),
            qvel: rows.add(&key.qvel),
            ctrl: rows.add(&key.ctrl),
        })
        .collect()
}
