//! Quantities of a model's machine that a log may hold: readings and commands.

use asid_core::Scene;
use asid_core::layout::{JointKind, Sensor};
use asid_mjcf::Plant;
use asid_mjcf::plant::{DriveLaw, Reads};

use super::words::{Measure, Words};
use crate::counted::counted;

/// Dimension of a quantity, without time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// rad, or rad/s and rad/s².
    Angle,
    /// m, or m/s and m/s².
    Length,
    /// Anything else: forces, entries of quaternions.
    Other,
}

/// A command, or an entry of a sensor.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Name in a study: `ctrl.elbow`, `angle`, `tip.0`.
    pub name: String,
    /// Name of the whole sensor, for an entry of a vector.
    pub vector: Option<String>,
    /// Whether it is a command.
    pub command: bool,
    /// Its index among the commands, or that of its joint among the joints.
    pub place: Option<usize>,
    /// Index of its joint in the layout.
    pub joint: Option<usize>,
    /// What it measures; for a command, what it asks for.
    pub measure: Option<Measure>,
    /// Its dimension, without time.
    pub dimension: Dimension,
    /// Kind of quantity, in words, that its unit must measure; `None` where unknown.
    pub counts: Option<&'static str>,
    /// Possible values in SI units, if the model states them.
    pub range: Option<[f64; 2]>,
    /// Words of its name, and of its joint's or body's.
    pub words: Vec<Words>,
    /// Axis, for an entry of a vector.
    pub axis: Option<char>,
}

/// All quantities that a log of a machine may hold.
///
/// # Errors
/// When the document is not valid MJCF.
pub fn quantities(scene: &Scene, plant: &Plant) -> asid_core::Result<Vec<Quantity>> {
    let document = scene.description()?;
    let bodies = document.bodies.iter();
    let ranges: Vec<Option<[f64; 2]>> = bodies
        .flat_map(|b| b.body.joints.iter().map(|j| j.range))
        .collect();
    let mut all = commands(plant, &ranges);
    for (sensor, reads) in plant.layout.sensors.iter().zip(&plant.sensors) {
        all.extend(readings(plant, sensor, *reads, &ranges));
    }
    for quantity in &mut all {
        quantity.counts = counted(plant, &quantity.name);
    }
    Ok(all)
}

fn commands(plant: &Plant, ranges: &[Option<[f64; 2]>]) -> Vec<Quantity> {
    let actuators = plant.layout.actuators.iter().zip(&plant.drives).enumerate();
    let one = |(i, (actuator, drive)): (
        usize,
        (
            &asid_core::layout::Actuator,
            &Option<asid_mjcf::plant::Drive>,
        ),
    )| {
        let joint = drive.as_ref().map(|d| d.joint);
        let measure = drive.as_ref().map(|d| match d.law {
            DriveLaw::Motor => Measure::Effort,
            DriveLaw::Position { .. } => Measure::Position,
            DriveLaw::Velocity { .. } => Measure::Velocity,
        });
        let of_joint = joint.filter(|_| measure == Some(Measure::Position));
        Quantity {
            name: format!("ctrl.{}", actuator.name),
            vector: None,
            command: true,
            place: Some(i),
            joint,
            measure,
            dimension: dimension(plant, joint, measure),
            counts: None,
            range: actuator
                .ctrl_range
                .or_else(|| of_joint.and_then(|j| ranges.get(j).copied().flatten())),
            words: words(&actuator.name, joint.map(|j| &*plant.layout.joints[j].name)),
            axis: None,
        }
    };
    actuators.map(one).collect()
}

fn words(name: &str, other: Option<&str>) -> Vec<Words> {
    let other = other.into_iter().map(Words::of);
    std::iter::once(Words::of(name)).chain(other).collect()
}

fn dimension(plant: &Plant, joint: Option<usize>, measure: Option<Measure>) -> Dimension {
    match (joint.map(|j| plant.layout.joints[j].kind), measure) {
        (_, Some(Measure::Effort) | None) => Dimension::Other,
        (Some(JointKind::Hinge), _) => Dimension::Angle,
        (Some(JointKind::Slide), _) => Dimension::Length,
        _ => Dimension::Other,
    }
}

/// The entries of a sensor.
fn readings(
    plant: &Plant,
    sensor: &Sensor,
    reads: Reads,
    ranges: &[Option<[f64; 2]>],
) -> Vec<Quantity> {
    let joint = match reads {
        Reads::Joint(j) => Some(j),
        _ => None,
    };
    let site = match reads {
        Reads::Joint(j) => Some(&*plant.layout.joints[j].name),
        Reads::Body(b) => Some(&*plant.layout.bodies[b]),
        Reads::Other => None,
    };
    let (measure, free) = match &*sensor.kind {
        "jointpos" | "actuatorpos" | "tendonpos" => (Some(Measure::Position), Dimension::Other),
        "jointvel" | "actuatorvel" | "tendonvel" => (Some(Measure::Velocity), Dimension::Other),
        "framepos" | "subtreecom" => (Some(Measure::Position), Dimension::Length),
        "framequat" | "ballquat" => (Some(Measure::Orientation), Dimension::Other),
        "framelinvel" | "velocimeter" | "subtreelinvel" => {
            (Some(Measure::Velocity), Dimension::Length)
        }
        "frameangvel" | "gyro" | "ballangvel" => (Some(Measure::Velocity), Dimension::Angle),
        "framelinacc" | "accelerometer" => (Some(Measure::Acceleration), Dimension::Length),
        "frameangacc" => (Some(Measure::Acceleration), Dimension::Angle),
        "force" | "torque" | "actuatorfrc" | "jointactuatorfrc" | "touch" => {
            (Some(Measure::Effort), Dimension::Other)
        }
        _ => (None, Dimension::Other),
    };
    let axes: &[char] = match sensor.len {
        3 => &['x', 'y', 'z'],
        4 => &['w', 'x', 'y', 'z'],
        _ => &[],
    };
    let range = match sensor.kind.as_str() {
        "jointpos" => joint.and_then(|j| ranges.get(j).copied().flatten()),
        _ => None,
    };
    let entry = |i: usize| Quantity {
        name: if sensor.len == 1 {
            sensor.name.clone()
        } else {
            format!("{}.{i}", sensor.name)
        },
        vector: (sensor.len > 1).then(|| sensor.name.clone()),
        command: false,
        place: joint,
        joint,
        measure,
        dimension: match free {
            Dimension::Other => dimension(plant, joint, measure),
            known => known,
        },
        counts: None,
        range,
        words: words(&sensor.name, site),
        axis: axes.get(i).copied(),
    };
    (0..sensor.len).map(entry).collect()
}
