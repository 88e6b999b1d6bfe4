//! Joints, drives and frames of a scene, and their handles and indices in rapier.

use asid_core::layout::JointKind;
use mjcf_rs::extras::ActuatorKind;
use nalgebra::{UnitQuaternion, Vector3};
use rapier3d::dynamics::MultibodyJointHandle;

/// A joint and its handle in rapier.
#[derive(Clone, Debug)]
pub struct JointSlot {
    /// Kind.
    pub kind: JointKind,
    /// First entry in `qpos`.
    pub qpos: usize,
    /// First entry in `qvel`.
    pub qvel: usize,
    /// Index in the layout of the body that it moves.
    pub body: usize,
    /// That body's parent.
    pub parent: usize,
    /// Handle in the multibodies; `None` for a free joint.
    pub handle: Option<MultibodyJointHandle>,
    /// MJCF `ref`: the value of the coordinate at rapier's zero.
    pub reference: f64,
    /// Rest position of its spring, in `qpos`.
    pub spring_rest: f64,
}

/// A drive on a hinge or slide.
#[derive(Clone, Debug)]
pub struct ActuatorSlot {
    /// Kind: motor, position or velocity; a `<general>` one has that of the short form it equals.
    pub kind: ActuatorKind,
    /// Factor of the command of a motor.
    pub gain: f64,
    /// Index of its joint.
    pub joint: usize,
    /// Limits of the command.
    pub ctrl_range: Option<[f64; 2]>,
    /// Limits of its force, before the gear.
    pub force_range: Option<[f64; 2]>,
}

/// A frame fixed in a body.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Body, index in the layout.
    pub body: usize,
    /// Position in the body, m.
    pub position: Vector3<f64>,
    /// `body_from_frame`.
    pub rotation: UnitQuaternion<f64>,
}
