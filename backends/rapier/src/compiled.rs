//! A scene turned into rapier's collections, with the places of everything.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use asid_core::layout::{JointKind, Layout};
use asid_core::{Error, Result, Scene, Status};
use mjcf_rs::extras::ActuatorKind;
use nalgebra::{UnitQuaternion, Vector3};
use rapier3d::dynamics::{
    CCDSolver, ImpulseJointSet, IntegrationParameters, IslandManager, MassProperties,
    MultibodyJointHandle, MultibodyJointSet, RigidBody, RigidBodyHandle, RigidBodySet, SoftBodySet,
};
use rapier3d::geometry::{
    BroadPhaseBvh, ColliderHandle, ColliderSet, InteractionGroups, NarrowPhase,
};
use rapier3d_mjcf::{MjcfLoaderOptions, MjcfMultibodyOptions, MjcfRobot};

use crate::contact::Resistance;
use crate::pairs::PairTable;
use crate::parameter::Tables;
use crate::sensor::SensorSlot;
use crate::state::State;
use crate::structure::{Inertia, MassModel};
use crate::{convert, document, refusal, settings};

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

/// A compiled scene, shared by all its batches.
pub struct Compiled {
    /// Name of the scene, for messages.
    pub scene: String,
    /// Names and places.
    pub layout: Layout,
    /// Contact rules.
    pub pairs: PairTable,
    /// How masses come about.
    pub masses: MassModel,
    /// The world as built, no step taken.
    pub pristine: State,
    /// Rigid body of each body; `None` for a world that nothing refers to.
    pub bodies: Vec<Option<RigidBodyHandle>>,
    /// Whether each body is a moving link of an articulated tree.
    pub links: Vec<bool>,
    /// Whether each body is in an articulated tree at all, be it as its fixed root.
    pub trees: Vec<bool>,
    /// The moving links with shapes that can touch something.
    pub touching_links: Vec<usize>,
    /// Free bodies that carry joints: roots of trees that float.
    pub floating: Vec<usize>,
    /// Body of each geom.
    pub body_of_geom: Vec<usize>,
    /// Frame of each geom.
    pub geom_frames: Vec<Frame>,
    /// Shape of each geom that takes part in contact.
    pub colliders: Vec<Option<ColliderHandle>>,
    /// Joints, in the order of the layout.
    pub joints: Vec<JointSlot>,
    /// Actuators, in the order of the layout.
    pub actuators: Vec<ActuatorSlot>,
    /// Sensors, in the order of the layout.
    pub sensors: Vec<SensorSlot>,
    /// Parameters as the document has them.
    pub nominal: Tables,
    /// Solver settings.
    pub integration: IntegrationParameters,
    /// State after a reset: `qpos` and `qvel`.
    pub start: (Vec<f64>, Vec<f64>),
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
        let sensors = SensorSlot::of_scene(&model, &layout);
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
        let base = scene.directory().unwrap_or(Path::new(""));
        let options = MjcfLoaderOptions {
            skip_plane_geoms: false,
            enable_joint_collisions: true,
            disable_joint_motors: true,
            ..MjcfLoaderOptions::default()
        };
        let mut robot = catch_unwind(AssertUnwindSafe(|| {
            MjcfRobot::from_model(&model, options, base)
        }))
        .map_err(|_| fail("rapier's loader failed on it".into()))?;
        document::give_roots(&mut robot);
        let geom_index = robot.geom_name_to_collider.clone();
        let couplings = robot.joint_couplings.clone();
        let joint_index = robot.joint_name_to_idx.clone();
        let body_of_rapier: Vec<(usize, bool)> = robot
            .bodies
            .iter()
            .map(|b| (b.mjcf_body_id, b.is_intermediate))
            .collect();

        let mut state = State {
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
            time: 0.0,
            status: Status::Running,
        };
        let handles = robot.insert_using_multibody_joints(
            &mut state.bodies,
            &mut state.colliders,
            &mut state.multibodies,
            &mut state.impulse_joints,
            MjcfMultibodyOptions::SKIP_JOINT_MOTORS | MjcfMultibodyOptions::SKIP_JOINT_SPRINGS,
        );
        for coupling in &couplings {
            let tree = |joint: usize| {
                let child = handles.joints.get(joint).map(|j| j.link2)?;
                state
                    .multibodies
                    .rigid_body_link(child)
                    .map(|l| l.multibody)
            };
            if tree(coupling.joint1) != tree(coupling.joint2) {
                return Err(fail(
                    "backend `rapier` couples only joints of one tree (<equality><joint>)".into(),
                ));
            }
        }
        let mut bodies = vec![None; layout.bodies.len()];
        for (place, handle) in body_of_rapier.iter().zip(&handles.bodies) {
            if let (&(body, false), Some(handle)) = (place, handle) {
                bodies[body] = Some(handle.body);
            }
        }
        let mut colliders = vec![None; layout.geoms.len()];
        for (geom, collider) in colliders.iter_mut().enumerate() {
            let Some(&(body, at)) = geom_index.get(&places.geom(geom)) else {
                continue;
            };
            *collider = handles.bodies[body]
                .as_ref()
                .and_then(|b| b.colliders.get(at))
                .map(|c| c.handle);
        }
        let mut joints = Vec::with_capacity(layout.joints.len());
        let document = model
            .bodies
            .iter()
            .enumerate()
            .flat_map(|(i, b)| b.body.joints.iter().map(move |j| (i, b.parent, j)));
        for (i, (place, (body, parent, joint))) in layout.joints.iter().zip(document).enumerate() {
            let handle = joint_index
                .get(&places.joint(i))
                .and_then(|&at| handles.joints.get(at))
                .and_then(|h| h.joint);
            if handle.is_none() && place.kind != JointKind::Free {
                return Err(fail(format!(
                    "rapier could not build joint `{}` into a tree",
                    place.name
                )));
            }
            joints.push(JointSlot {
                kind: place.kind,
                qpos: place.qpos,
                qvel: place.qvel,
                body,
                parent: parent.unwrap_or(0),
                handle,
                reference: joint.ref_,
                spring_rest: joint.springref,
            });
        }
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

    /// Sets what the loader leaves at a game's defaults; `groups` are the contact
    /// bits of each geom.
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

/// Gives a body its mass properties.
pub fn set_inertia(body: &mut RigidBody, colliders: &ColliderSet, inertia: &Inertia) {
    let properties = MassProperties::with_principal_inertia_frame(
        convert::to_vector(&inertia.center),
        inertia.mass as f32,
        convert::to_vector(&inertia.moments),
        convert::to_rotation(&inertia.axes),
    );
    // A body with equal moments has no gyroscopic torque, only rapier's rounding of it.
    let [a, b, c] = inertia.moments.into();
    let spread = (a - b).abs().max((b - c).abs());
    body.enable_gyroscopic_forces(spread > 1e-6 * inertia.moments.amax());
    body.set_additional_mass_properties(properties, false);
    body.recompute_mass_properties_from_colliders(colliders);
}
