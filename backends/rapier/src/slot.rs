//! Places of joints, drives and frames of a scene in rapier.

use asid_core::layout::JointKind;
use mjcf_rs::extras::ActuatorKind;
use nalgebra::{UnitQuaternion, Vector3};
use rapier3d::dynamics::MultibodyJointHandle;

/// A joint's place in rapier.
#[derive(Clone, Debug)]
pub struct JointSlot {
    /// Kind.
    pub kind: JointKind,
    /// First entry in `qpos`.
    pub qpos: usize,
    /// First entry in `qvel`.
    pub qvel: usize,
    /// Body that it moves, index in the layout.
    pub body: usize,
    /// That body's parent.
    pub parent: usize,
    /// Handle in the multibodies; `None` for a free joint.
    pub handle: Option<MultibodyJointHandle>,
    /// MJCF `ref`: what the coordinate reads where rapier's is zero.
    pub reference: f64,
    /// Where its spring rests, in `qpos`.
    pub spring_rest: f64,
}

/// A drive on a hinge or slide.
#[derive(Clone, Debug)]
pub struct ActuatorSlot {
    /// Kind: motor, position or velocity.
    pub kind: ActuatorKind,
    /// Index of its joint.
    pub joint: usize,
    /// Limits of the command.
    pub ctrl_range: Option<[f64; 2]>,
    /// Limits of its force, before the gear.
    pub force_range: Option<[f64; 2]>,
}

/// A place fixed in a body.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Body, index in the layout.
    pub body: usize,
    /// Position in the body, m.
    pub position: Vector3<f64>,
    /// `body_from_frame`.
    pub rotation: UnitQuaternion<f64>,
}
