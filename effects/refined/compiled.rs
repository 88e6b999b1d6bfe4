//! The machine of a document as an engine has compiled it.
//!
//! Effects know a machine by its document, and an engine has its last word on it: masses that come
//! from meshes, that a compiler option scales, or elements that one makes or removes.

use asid_core::error::{Error, Result};
use asid_core::target::Target;
use asid_core::{Layout, Model};
use asid_mjcf::Plant;

/// Relative difference of a mass, and difference of a centre in m, up to which the document's value
/// stays: both programs round.
const ROUNDING: f64 = 1e-9;

/// A machine with the masses of its bodies, and their centres, as `model` has them.
///
/// # Errors
/// [`Error::Scene`] where the model has other bodies, joints, geoms or actuators than the document.
pub fn as_compiled(plant: &Plant, model: &dyn Model, scene: &str) -> Result<Plant> {
    check_same(&plant.layout, model.layout(), scene)?;
    let mut plant = plant.clone();
    for (name, body) in plant.layout.bodies.iter().zip(&mut plant.bodies).skip(1) {
        let nominal = |attribute: &str, i: usize| {
            let value = model.nominal(&Target::new("body", name, attribute, i));
            value.ok().filter(|x| x.is_finite())
        };
        if let Some(mass) = nominal("mass", 0)
            && (mass - body.mass).abs() > ROUNDING * mass.abs()
        {
            body.mass = mass;
        }
        for (i, own) in body.center.iter_mut().enumerate() {
            if let Some(center) = nominal("ipos", i).filter(|x| (x - *own).abs() > ROUNDING) {
                *own = center;
            }
        }
    }
    Ok(plant)
}

/// Refuses a document whose elements are not those that the engine has compiled: indices of one would
/// be taken for those of the other.
fn check_same(document: &Layout, compiled: &Layout, scene: &str) -> Result<()> {
    let joints = |of: &Layout| -> Vec<(String, usize, usize)> {
        let joints = of.joints.iter();
        joints.map(|j| (j.name.clone(), j.qpos, j.qvel)).collect()
    };
    let what = if document.bodies.len() != compiled.bodies.len() {
        "bodies"
    } else if joints(document) != joints(compiled) {
        "joints"
    } else if document.geoms.len() != compiled.geoms.len() {
        "geoms"
    } else if document.actuators.len() != compiled.actuators.len() {
        "actuators"
    } else {
        return Ok(());
    };
    Err(Error::Scene {
        scene: scene.to_owned(),
        message: format!(
            "its {what} are not those that the engine makes of it: elements such as <replicate> or <flexcomp>, or the compiler's \
             fusestatic or discardvisual, add or remove some. Save it by MuJoCo (mj_saveLastXML) and use that document"
        ),
    })
}

#[cfg(test)]
mod tests {
    use asid_core::layout::{Joint, JointKind};

    use super::*;

    /// Symptom: an effect on one joint acted on another one, and `asid explore` panicked.
    ///
    /// Cause: bodies that `<replicate>` makes were in the engine's model and not in the document's.
    #[test]
    fn a_document_whose_elements_an_engine_adds_to_is_refused() {
        let joint = |name: &str, at: usize| Joint {
            name: name.into(),
            kind: JointKind::Hinge,
            body: name.into(),
            qpos: at,
            qvel: at,
        };
        let layout = |names: &[&str]| Layout {
            bodies: vec![String::new(); names.len() + 1],
            joints: (names.iter().enumerate())
                .map(|(i, name)| joint(name, i))
                .collect(),
            ..Layout::default()
        };
        let own = layout(&["j", "k"]);
        assert!(check_same(&own, &own, "robot").is_ok());
        for other in [layout(&["bead", "j", "k"]), layout(&["k", "j"])] {
            let said = check_same(&own, &other, "robot").unwrap_err().to_string();
            assert!(said.contains("mj_saveLastXML") && said.lines().count() == 1);
        }
    }
}
