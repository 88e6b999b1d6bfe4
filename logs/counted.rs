//! Kinds of quantity of a machine's sensors and commands, and whether their columns' units match.

use asid_core::layout::JointKind;
use asid_core::{Error, Result};
use asid_mjcf::Plant;
use asid_mjcf::plant::{DriveLaw, Reads};

use crate::episode::counts::{
    ACCELERATION, ANGLE, ANGULAR_SPEED, FORCE, LENGTH, SPEED, TIME, TORQUE,
};
use crate::episode::{ColumnMapping, unit_counts};

/// The kind of a quantity, in the words of [`crate::episode::counts`].
///
/// `name` is a sensor, an entry of one (`tip.0`), a command (`ctrl.elbow`) or `time`. `None` for
/// unknown kinds, for quaternions, and for commands and tendons behind a gear, whose numbers have
/// any unit.
#[must_use]
pub fn counted(plant: &Plant, name: &str) -> Option<&'static str> {
    if name == "time" {
        return Some(TIME);
    }
    if let Some(actuator) = name.strip_prefix("ctrl.") {
        return command(plant, actuator);
    }
    let sensors = &plant.layout.sensors;
    let place = sensors.iter().position(|s| s.name == name).or_else(|| {
        let (vector, entry) = name.rsplit_once('.')?;
        entry.parse::<usize>().ok()?;
        sensors.iter().position(|s| s.name == vector)
    })?;
    let joint = match plant.sensors.get(place) {
        Some(Reads::Joint(joint)) => Some(plant.joint_kind(*joint)),
        _ => None,
    };
    match (&*sensors[place].kind, joint) {
        ("jointpos", Some(JointKind::Hinge)) => Some(ANGLE),
        ("jointpos", Some(JointKind::Slide)) => Some(LENGTH),
        ("jointvel", Some(JointKind::Hinge)) => Some(ANGULAR_SPEED),
        ("jointvel", Some(JointKind::Slide)) => Some(SPEED),
        ("framepos" | "subtreecom" | "rangefinder", _) => Some(LENGTH),
        ("framelinvel" | "velocimeter" | "subtreelinvel", _) => Some(SPEED),
        ("frameangvel" | "gyro", _) => Some(ANGULAR_SPEED),
        ("framelinacc" | "accelerometer", _) => Some(ACCELERATION),
        ("force" | "touch", _) => Some(FORCE),
        ("torque", _) => Some(TORQUE),
        _ => None,
    }
}

/// The kind of an actuator's command.
fn command(plant: &Plant, actuator: &str) -> Option<&'static str> {
    let place = plant.layout.actuator(actuator).ok()?;
    let drive = plant.drives.get(place)?.filter(|d| d.gear == 1.0)?;
    match (drive.law, plant.joint_kind(drive.joint)) {
        (DriveLaw::Position { .. }, JointKind::Hinge) => Some(ANGLE),
        (DriveLaw::Position { .. }, JointKind::Slide) => Some(LENGTH),
        (DriveLaw::Velocity { .. }, JointKind::Hinge) => Some(ANGULAR_SPEED),
        (DriveLaw::Velocity { .. }, JointKind::Slide) => Some(SPEED),
        (DriveLaw::Motor, JointKind::Hinge) => Some(TORQUE),
        (DriveLaw::Motor, JointKind::Slide) => Some(FORCE),
        _ => None,
    }
}

/// Whether a unit fits a quantity of this kind.
#[must_use]
pub fn allows(counted: Option<&str>, unit: &str) -> bool {
    match (counted, unit_counts(unit)) {
        (Some(own), Some(units)) => own == units,
        _ => true,
    }
}

/// Refuses a mapping whose unit is of another kind than its quantity.
///
/// # Errors
/// When a unit is of the wrong kind; the message is one line.
pub fn check_units(plant: &Plant, mappings: &[ColumnMapping]) -> Result<()> {
    for mapping in mappings {
        let Some(unit) = &mapping.unit else {
            continue;
        };
        let own = counted(plant, &mapping.name);
        if allows(own, unit) {
            continue;
        }
        return Err(Error::Config {
            key: "column".into(),
            message: format!(
                "[[column]] `{}` is {}; {unit} is {}: give a unit of the same kind, or the factor as `scale`",
                mapping.name,
                own.unwrap_or_default(),
                unit_counts(unit).unwrap_or_default()
            ),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use asid_core::Scene;

    use super::*;

    const MACHINE: &str = r#"<mujoco><worldbody>
      <body name="cart"><joint name="x" type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/>
        <body name="arm"><joint name="elbow" axis="0 1 0"/><geom size="0.1" mass="1"/></body></body></worldbody>
      <actuator><position name="x" joint="x" kp="9"/><motor name="elbow" joint="elbow"/><motor name="geared" joint="elbow" gear="50"/>
      </actuator>
      <sensor><jointpos name="place" joint="x"/><jointpos name="angle" joint="elbow"/><jointvel name="speed" joint="elbow"/>
        <framepos name="tip" objtype="body" objname="arm"/></sensor></mujoco>"#;

    #[test]
    fn a_unit_of_another_kind_than_its_quantity_is_refused_in_one_line() {
        let plant = Plant::of(&Scene::from_xml("machine", MACHINE, &[]).unwrap()).unwrap();
        let check = |name: &str, unit: &str| {
            let mapping = ColumnMapping {
                unit: Some(unit.into()),
                ..ColumnMapping::of(name)
            };
            check_units(&plant, &[mapping]).map_err(|e| e.to_string())
        };
        for (name, unit) in [
            ("place", "mm"),
            ("angle", "deg"),
            ("angle", "%"),
            ("speed", "rpm"),
            ("tip.2", "cm"),
            ("ctrl.x", "mm"),
            ("ctrl.elbow", "mN m"),
            ("ctrl.geared", "mm"),
            ("time", "ms"),
        ] {
            assert!(check(name, unit).is_ok(), "{name} {unit}");
        }
        for (name, unit, said) in [
            ("angle", "mm", "`angle` is an angle; mm is a length"),
            ("place", "deg", "`place` is a length; deg is an angle"),
            (
                "speed",
                "deg",
                "`speed` is an angular speed; deg is an angle",
            ),
            ("tip", "rad", "`tip` is a length; rad is an angle"),
            ("ctrl.x", "rad", "`ctrl.x` is a length; rad is an angle"),
            ("ctrl.elbow", "N", "`ctrl.elbow` is a torque; N is a force"),
            ("time", "mm", "`time` is a time; mm is a length"),
        ] {
            let error = check(name, unit).unwrap_err();
            assert!(
                error.contains(said) && error.lines().count() == 1,
                "{error}"
            );
        }
    }
}
