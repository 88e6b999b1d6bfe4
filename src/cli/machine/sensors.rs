//! The readings of a machine and their noise.

use std::collections::BTreeMap;

use anyhow::Result;
use asid_core::layout::JointKind;
use asid_core::signal::Signal;
use asid_core::{Error, Scene};
use asid_effects::refined::as_compiled;
use asid_mjcf::markup::escaped;
use asid_sysid::dataset::Dataset;

use super::Subject;
use crate::cli::model::refine;

/// Default noise of a sensor by its kind, where neither a study nor `--noise` gives it.
///
/// The values are those of a common robot. A 12-bit encoder is good to 4e-4 rad, and its difference
/// over 10 ms to 0.05 rad/s. A tracker is good to 1 mm and 5 mrad, a MEMS sensor to 0.01 rad/s and
/// 0.1 m/s². For other kinds it is a hundredth of the unit.
fn usual_noise(kind: &str) -> f64 {
    match kind {
        "jointpos" | "tendonpos" | "actuatorpos" => 5e-4,
        "jointvel" | "tendonvel" | "actuatorvel" => 0.05,
        "framepos" | "subtreecom" => 1e-3,
        "framequat" | "ballquat" => 5e-3,
        "accelerometer" => 0.1,
        _ => 0.01,
    }
}

/// The same machine with a sensor at each hinge and slide, if it has no sensors at all.
pub fn with_sensors(subject: Subject, notes: &mut Vec<String>) -> Result<Subject> {
    if !subject.plant.layout.sensors.is_empty() {
        return Ok(subject);
    }
    let scene = &subject.source.scene;
    let joints = subject.plant.layout.joints.iter();
    let sensors: String = joints
        .filter(|j| matches!(j.kind, JointKind::Hinge | JointKind::Slide))
        .filter(|j| {
            scene.xml().contains(&format!("\"{}\"", j.name))
                || scene.xml().contains(&format!("'{}'", j.name))
        })
        .map(|j| {
            let name = escaped(&j.name);
            format!("    <jointpos name=\"{name}\" joint=\"{name}\"/>\n")
        })
        .collect();
    if sensors.is_empty() {
        return Err(Error::Scene {
            scene: scene.name().to_owned(),
            message:
                "has no sensors and no named joints: what would be read? Add <sensor> elements"
                    .into(),
        }
        .into());
    }
    let end = scene.xml().rfind("</").unwrap_or(scene.xml().len());
    let mut xml = scene.xml().to_owned();
    xml.insert_str(end, &format!("  <sensor>\n{sensors}  </sensor>\n"));
    let scene =
        Scene::from_xml(scene.name(), &xml, &[])?.in_directory(scene.directory().map(Into::into));
    notes.push(
        "the model has no sensors: the position of each joint is read, by the joint's name".into(),
    );
    let compiled = subject.backend.load(&scene)?;
    let plant = asid_mjcf::Plant::of(&scene)?;
    let mut plant = as_compiled(&plant, &*compiled, scene.name())?;
    plant.layout = compiled.layout().clone();
    let mut source = subject.source;
    source.scene = scene;
    let model = refine(&*subject.backend, compiled, &source.scene, &source, &[])?;
    Ok(Subject {
        source,
        model,
        plant,
        ..subject
    })
}

/// The sensors that are read, with their noise.
pub fn signals(
    subject: &Subject,
    data: Option<&Dataset>,
    given: &BTreeMap<String, f64>,
    notes: &mut Vec<String>,
) -> Result<Vec<Signal>> {
    let layout = &subject.plant.layout;
    for name in given.keys() {
        layout.sensor(name)?;
    }
    let mut assumed = Vec::new();
    let mut signals: Vec<Signal> = match data {
        Some(data) => data.signals.clone(),
        None => layout
            .sensors
            .iter()
            .map(|s| {
                if !given.contains_key(&s.name) {
                    assumed.push(format!("{} {}", s.name, usual_noise(&s.kind)));
                }
                Signal {
                    sensor: s.name.clone(),
                    noise: usual_noise(&s.kind),
                }
            })
            .collect(),
    };
    for signal in &mut signals {
        if let Some(noise) = given.get(&signal.sensor) {
            signal.noise = *noise;
        }
    }
    if !assumed.is_empty() {
        notes.push(format!(
            "noise assumed (say --noise SENSOR:STD): {}",
            assumed.join(", ")
        ));
    }
    Ok(signals)
}
