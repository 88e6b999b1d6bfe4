//! The arm of all tasks: a Franka Panda with its hand.

use asid_core::{Error, Result, Scene};
use asid_mjcf::kinematics::Chain;

/// The arm's document, included by each scene as `../panda.xml`.
pub const PANDA_XML: &str = include_str!("panda.xml");

/// Number of joints of the arm.
pub const ARM_JOINTS: usize = 7;

/// Site between the finger pads.
pub const END_EFFECTOR: &str = "ee";

/// Finger command of the open hand, m from the middle.
pub const FINGER_OPEN: f64 = 0.04;

/// Names of the arm's own sensors: the end effector's position, then the joints.
#[must_use]
pub fn proprioception() -> Vec<String> {
    std::iter::once("ee_pos".to_owned())
        .chain((1..=ARM_JOINTS).map(|i| format!("joint{i}_pos")))
        .collect()
}

/// Loads a scene with the arm; also returns the arm's posture in the first keyframe, rad.
///
/// # Errors
/// When the document cannot be read, or has no arm or no keyframe.
pub fn scene(name: &str, xml: &str) -> Result<(Scene, Vec<f64>)> {
    let scene = Scene::from_xml(name, xml, &[("../panda.xml", PANDA_XML)])?;
    let description = scene.description()?;
    let key = description.keyframes.first();
    let home = key
        .and_then(|k| k.qpos.get(..ARM_JOINTS))
        .ok_or_else(|| Error::Scene {
            scene: scene.name().to_owned(),
            message: "has no keyframe of the arm".into(),
        })?
        .to_vec();
    Chain::to_site(&scene, END_EFFECTOR)?;
    Ok((scene, home))
}
