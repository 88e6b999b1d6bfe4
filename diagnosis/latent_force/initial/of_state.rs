//! Which numbers of the state a sensor reads directly.

use asid_core::layout::JointKind;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

/// Numbers of the state that a sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OfState {
    /// Positions that are plain numbers: index of the first in `qpos`, and its degree of freedom.
    Places(usize, usize),
    /// An orientation: index of its quaternion in `qpos`, and its first degree of freedom.
    Turn(usize, usize),
    /// Speeds: the first degree of freedom.
    Speeds(usize),
    /// The angular velocity of a free body about the axes of the world: index of its quaternion in
    /// `qpos`, and its first degree of freedom.
    Spin(usize, usize),
}

impl OfState {
    /// Returns what a sensor, by index in the layout, reads of the state; `None` if it reads
    /// something else.
    pub(super) fn of(plant: &Plant, sensor: usize) -> Option<Self> {
        let layout = &plant.layout;
        let kind = &*layout.sensors[sensor].kind;
        match plant.sensors[sensor] {
            Reads::Joint(j) => {
                let joint = &layout.joints[j];
                match (joint.kind, kind) {
                    (JointKind::Hinge | JointKind::Slide, "jointpos") => {
                        Some(Self::Places(joint.qpos, joint.qvel))
                    }
                    (JointKind::Hinge | JointKind::Slide, "jointvel")
                    | (JointKind::Ball, "ballangvel") => Some(Self::Speeds(joint.qvel)),
                    (JointKind::Ball, "ballquat") => Some(Self::Turn(joint.qpos, joint.qvel)),
                    _ => None,
                }
            }
            Reads::Body(b) => {
                let joint = &layout.joints[plant.free_joint(b)?];
                match kind {
                    "framepos" => Some(Self::Places(joint.qpos, joint.qvel)),
                    "framequat" => Some(Self::Turn(joint.qpos + 3, joint.qvel + 3)),
                    "framelinvel" => Some(Self::Speeds(joint.qvel)),
                    "frameangvel" => Some(Self::Spin(joint.qpos + 3, joint.qvel + 3)),
                    _ => None,
                }
            }
            Reads::Other => None,
        }
    }
}
