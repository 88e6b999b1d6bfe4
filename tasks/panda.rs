//! The arm that every task shares: a Franka Panda with its hand.

/// The arm's document, included by each scene as `../panda.xml`.
pub const PANDA_XML: &str = include_str!("panda.xml");

/// Joints of the arm.
pub const ARM_JOINTS: usize = 7;

/// Site between the finger pads.
pub const END_EFFECTOR: &str = "ee";

/// Command of each finger when the hand is open, m from the middle.
pub const FINGER_OPEN: f64 = 0.04;

/// Names of the arm's own sensors: the end effector's position, then the joints.
#[must_use]
pub fn proprioception() -> Vec<String> {
    std::iter::once("ee_pos".to_owned())
        .chain((1..=ARM_JOINTS).map(|i| format!("joint{i}_pos")))
        .collect()
}
