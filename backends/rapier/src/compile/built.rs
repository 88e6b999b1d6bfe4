//! What rapier's loader has built from a document, with the handles of its parts.

use std::collections::HashMap;

use asid_core::Layout;
use asid_core::layout::JointKind;
use mjcf_rs::Model;
use rapier3d::dynamics::{MultibodyJointHandle, RigidBodyHandle};
use rapier3d::geometry::ColliderHandle;
use rapier3d_mjcf::{MjcfMultibodyOptions, MjcfRobot, MjcfRobotHandles};

use crate::document::Places;
use crate::slot::JointSlot;
use crate::state::State;

/// A robot in rapier's collections, with the handles of its parts.
pub(super) struct Built {
    handles: MjcfRobotHandles<Option<MultibodyJointHandle>>,
    /// For each of the loader's bodies: the document's body, and whether it only connects two
    /// joints.
    body_of_rapier: Vec<(usize, bool)>,
    geom_index: HashMap<String, (usize, usize)>,
    joint_index: HashMap<String, usize>,
    /// Pairs of coupled joints.
    couplings: Vec<(usize, usize)>,
}

impl Built {
    pub(super) fn of(robot: MjcfRobot, state: &mut State) -> Self {
        let places = robot.bodies.iter();
        let body_of_rapier = places.map(|b| (b.mjcf_body_id, b.is_intermediate));
        Self {
            body_of_rapier: body_of_rapier.collect(),
            geom_index: robot.geom_name_to_collider.clone(),
            joint_index: robot.joint_name_to_idx.clone(),
            couplings: robot
                .joint_couplings
                .iter()
                .map(|c| (c.joint1, c.joint2))
                .collect(),
            handles: robot.insert_using_multibody_joints(
                &mut state.bodies,
                &mut state.colliders,
                &mut state.multibodies,
                &mut state.impulse_joints,
                MjcfMultibodyOptions::SKIP_JOINT_MOTORS | MjcfMultibodyOptions::SKIP_JOINT_SPRINGS,
            ),
        }
    }

    /// Refuses couplings between joints of two trees.
    pub(super) fn check_couplings(&self, state: &State) -> std::result::Result<(), String> {
        let tree = |joint: usize| {
            let child = self.handles.joints.get(joint).map(|j| j.link2)?;
            let link = state.multibodies.rigid_body_link(child);
            link.map(|l| l.multibody)
        };
        if self.couplings.iter().all(|&(a, b)| tree(a) == tree(b)) {
            return Ok(());
        }
        Err("backend `rapier` couples only joints of one tree (<equality><joint>)".into())
    }

    /// The rigid body of each of the document's `n` bodies.
    pub(super) fn bodies(&self, n: usize) -> Vec<Option<RigidBodyHandle>> {
        let mut bodies = vec![None; n];
        for (place, handle) in self.body_of_rapier.iter().zip(&self.handles.bodies) {
            if let (&(body, false), Some(handle)) = (place, handle) {
                bodies[body] = Some(handle.body);
            }
        }
        bodies
    }

    /// The collider of each of the document's `n` geoms.
    pub(super) fn colliders(&self, places: &Places, n: usize) -> Vec<Option<ColliderHandle>> {
        let of = |geom: usize| {
            let &(body, at) = self.geom_index.get(&places.geom(geom))?;
            let body = self.handles.bodies[body].as_ref()?;
            body.colliders.get(at).map(|c| c.handle)
        };
        (0..n).map(of).collect()
    }

    /// The document's joints with their handles in rapier.
    pub(super) fn joints(
        &self,
        places: &Places,
        (layout, model): (&Layout, &Model),
    ) -> std::result::Result<Vec<JointSlot>, String> {
        let bodies = model.bodies.iter().enumerate();
        let document =
            bodies.flat_map(|(i, b)| b.body.joints.iter().map(move |j| (i, b.parent, j)));
        let each = layout.joints.iter().zip(document).enumerate();
        each.map(|(i, (place, (body, parent, joint)))| {
            let at = self.joint_index.get(&places.joint(i));
            let handle = at
                .and_then(|&at| self.handles.joints.get(at))
                .and_then(|h| h.joint);
            if handle.is_none() && place.kind != JointKind::Free {
                return Err(format!(
                    "rapier could not build joint `{}` into a tree",
                    place.name
                ));
            }
            Ok(JointSlot {
                kind: place.kind,
                qpos: place.qpos,
                qvel: place.qvel,
                body,
                parent: parent.unwrap_or(0),
                handle,
                reference: joint.ref_,
                spring_rest: joint.springref,
            })
        })
        .collect()
    }
}
