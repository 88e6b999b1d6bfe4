//! Compiles a scene: from the document to rapier's collections.

mod built;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use asid_core::layout::JointKind;
use asid_core::{Error, Result, Scene, Status};
use mjcf_rs::Model;
use rapier3d::dynamics::{
    CCDSolver, ImpulseJointSet, IslandManager, MultibodyJointSet, RigidBody, RigidBodySet,
    SoftBodySet,
};
use rapier3d::geometry::{BroadPhaseBvh, ColliderSet, InteractionGroups, NarrowPhase};
use rapier3d_mjcf::{MjcfLoaderOptions, MjcfRobot};

use crate::compiled::{Compiled, set_inertia};
use crate::contact::Resistance;
use crate::pairs::PairTable;
use crate::sensor::SensorSlot;
use crate::slot::JointSlot;
use crate::state::State;
use crate::structure::{MassModel, Structure};
use crate::tables::Tables;
use crate::{document, refusal, settings};

use built::Built;

/// The robot that rapier's loader builds from a document.
fn loaded(model: &Model, scene: &Scene) -> Result<MjcfRobot> {
    let base = scene.directory().unwrap_or(Path::new(""));
    let options = MjcfLoaderOptions {
        skip_plane_geoms: false,
        enable_joint_collisions: true,
        disable_joint_motors: true,
        ..MjcfLoaderOptions::default()
    };
    let load = || MjcfRobot::from_model(model, options, base);
    let mut robot = catch_unwind(AssertUnwindSafe(load)).map_err(|_| Error::Scene {
        scene: scene.name().to_owned(),
        message: "rapier's loader failed on it".into(),
    })?;
    document::give_roots(&mut robot);
    Ok(robot)
}

/// An empty world.
fn empty(structure: Structure) -> State {
    State {
        bodies: RigidBodySet::new(),
        colliders: ColliderSet::new(),
        islands: IslandManager::new(),
        broad_phase: BroadPhaseBvh::new(),
        narrow_phase: NarrowPhase::new(),
        impulse_joints: ImpulseJointSet::new(),
        multibodies: MultibodyJointSet::new(),
        soft_bodies: SoftBodySet::new(),
        ccd: CCDSolver::new(),
        resistance: Resistance::default(),
        structure,
        fresh: true,
        time: 0.0,
        status: Status::Running,
    }
}

impl Compiled {
    /// Compiles a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] where the document is not valid or has parts that this
    /// backend cannot simulate.
    pub fn new(scene: &Scene) -> Result<Self> {
        let mut model = Arc::unwrap_or_clone(scene.description()?);
        refusal::check(scene, &model)?;
        let layout = asid_mjcf::document::layout(scene, &model)?;
        let fail = |message: String| Error::Scene {
            scene: scene.name().to_owned(),
            message,
        };
        document::correct(scene, &mut model)
            .map_err(|what| fail(format!("backend `rapier` {what}")))?;
        let body_of_geom: Vec<usize> = model
            .bodies
            .iter()
            .enumerate()
            .flat_map(|(i, b)| std::iter::repeat_n(i, b.body.geoms.len()))
            .collect();
        let pairs = PairTable::new(&model, &body_of_geom).map_err(|what| {
            fail(format!(
                "a contact element names {what}, which is not there"
            ))
        })?;
        let (masses, structure) = MassModel::new(&model);
        let geom_frames = document::geom_frames(&model);
        let sensors = SensorSlot::of_scene(scene, &model, &layout);
        let actuators = document::actuators(&model, &layout)?;
        let nominal = Tables::new(&model, structure.clone());
        let start = match layout.keyframes.first() {
            Some(key) => (key.qpos.clone(), key.qvel.clone()),
            None => (
                asid_mjcf::document::default_qpos(&model, &layout),
                vec![0.0; layout.nv],
            ),
        };

        document::check_equalities(&model).map_err(fail)?;
        let groups = document::groups(&model);
        let places = document::rename(&mut model);
        let robot = loaded(&model, scene)?;
        let mut state = empty(structure);
        let built = Built::of(robot, &mut state);
        built.check_couplings(&state).map_err(fail)?;
        let bodies = built.bodies(layout.bodies.len());
        let colliders = built.colliders(&places, layout.geoms.len());
        let joints = built.joints(&places, (&layout, &model)).map_err(fail)?;
        let compiled = Self {
            scene: scene.name().to_owned(),
            integration: settings::integration_parameters(layout.timestep),
            layout,
            pairs,
            masses,
            pristine: state,
            links: vec![false; bodies.len()],
            trees: vec![false; bodies.len()],
            touching_links: Vec::new(),
            floating: Vec::new(),
            bodies,
            body_of_geom,
            geom_frames,
            colliders,
            joints,
            actuators,
            sensors,
            nominal,
            start,
        };
        compiled.prepare(&groups)
    }

    /// Sets what the loader leaves at a game's defaults; `groups` are the contact bits of each
    /// geom.
    fn prepare(mut self, groups: &[InteractionGroups]) -> Result<Self> {
        let State {
            bodies,
            colliders,
            multibodies,
            structure,
            ..
        } = &mut self.pristine;
        for (i, handle) in self.colliders.iter().enumerate() {
            if let Some(collider) = handle.and_then(|h| colliders.get_mut(h)) {
                collider.user_data = i as u128;
                collider.set_collision_groups(groups[i]);
            }
        }
        for (_, body) in bodies.iter_mut() {
            let activation = body.activation_mut();
            activation.normalized_linear_threshold = -1.0;
            activation.angular_threshold = -1.0;
            body.set_soft_ccd_prediction(0.0);
        }
        for (body, handle) in self.bodies.iter().enumerate().skip(1) {
            let inertia = self.masses.inertia(body, structure);
            let free = self
                .joints
                .iter()
                .any(|j| j.body == body && j.kind == JointKind::Free);
            if free && inertia.mass <= 0.0 {
                return Err(Error::Scene {
                    scene: self.scene,
                    message: format!("body `{}` moves but has no mass", self.layout.bodies[body]),
                });
            }
            if let Some(body) = handle.and_then(|h| bodies.get_mut(h)) {
                set_inertia(body, colliders, &inertia);
            }
        }
        for (body, handle) in self.bodies.iter().enumerate() {
            let Some(handle) = *handle else { continue };
            let moves = bodies.get(handle).is_some_and(RigidBody::is_dynamic);
            self.trees[body] = multibodies.rigid_body_link(handle).is_some();
            self.links[body] = moves && self.trees[body];
            let free = |j: &JointSlot| j.body == body && j.kind == JointKind::Free;
            if self.trees[body] && self.joints.iter().any(free) {
                self.floating.push(body);
            }
            let geoms = self.masses.geoms_of(body);
            if self.links[body] && self.colliders[geoms].iter().any(Option::is_some) {
                self.touching_links.push(body);
            }
        }
        // Fixed roots lose their six degrees of freedom here, once.
        for joint in &self.joints {
            if let Some((multibody, _)) = joint.handle.and_then(|h| multibodies.get_mut(h)) {
                multibody.forward_kinematics(bodies, true);
            }
        }
        Ok(self)
    }
}
