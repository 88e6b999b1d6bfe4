//! Moves one free body by rapier; its mass is that of the compiled model.
//!
//! The motion is rapier's alone. MuJoCo computes only what follows from a state without a law of
//! motion: the sensors' readings, and the velocity of the body's centre.

use mujoco_rs::wrappers::mj_model::{MjModel, MjtGeomBase};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rapier3d::dynamics::{
    CoefficientCombineRule, FrictionModel, IntegrationParameters, MassProperties, RigidBodyBuilder,
    RigidBodyHandle,
};
use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::pipeline::PhysicsWorld;

/// Substeps of a step, in which forces are added.
///
/// There is only one, because the rounding of many small increments adds up in single precision. At
/// an eighth of the flight's time step it makes three times the gap that it makes at half
/// (`cargo run --example machines free-flight`).
const SUBSTEPS: usize = 1;

/// A free body in rapier.
pub(super) struct Mover {
    world: PhysicsWorld,
    body: RigidBodyHandle,
    /// Centre of mass in the body's frame, m.
    center: Vector3<f64>,
}

fn vector(v: &[f64]) -> Vector {
    Vector::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

fn rotation(wxyz: &[f64]) -> Rotation {
    Rotation::from_xyzw(
        wxyz[1] as f32,
        wxyz[2] as f32,
        wxyz[3] as f32,
        wxyz[0] as f32,
    )
    .normalize()
}

fn wide(v: Vector) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn wide_rotation(q: Rotation) -> UnitQuaternion<f64> {
    let [x, y, z, w] = [q.x, q.y, q.z, q.w].map(f64::from);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

impl Mover {
    /// The first body of a model, which has a free joint, at a state.
    ///
    /// `qpos` is position and quaternion of its frame. `qvel` is the velocity of that frame's
    /// origin in the world and the angular velocity in the frame, as in MuJoCo.
    pub(super) fn new(model: &MjModel, qpos: &[f64], qvel: &[f64]) -> Self {
        let mut world = PhysicsWorld::new();
        let dt = model.opt().timestep as f32;
        world.gravity = vector(&model.opt().gravity);
        world.integration_parameters = IntegrationParameters {
            dt,
            min_ccd_dt: dt,
            num_solver_iterations: SUBSTEPS,
            max_ccd_substeps: 0,
            friction_model: FrictionModel::Coulomb,
            ..IntegrationParameters::default()
        };
        let center = Vector3::from(model.body_ipos()[1]);
        let turn =
            UnitQuaternion::from_quaternion(Quaternion::new(qpos[3], qpos[4], qpos[5], qpos[6]));
        let spin = turn * Vector3::new(qvel[3], qvel[4], qvel[5]);
        let velocity = Vector3::new(qvel[0], qvel[1], qvel[2]) + spin.cross(&(turn * center));
        let mass = MassProperties::with_principal_inertia_frame(
            vector(center.as_slice()),
            model.body_mass()[1] as f32,
            vector(&model.body_inertia()[1]),
            rotation(&model.body_iquat()[1]),
        );
        let body = RigidBodyBuilder::dynamic()
            .pose(Pose::from_parts(vector(qpos), rotation(&qpos[3..])))
            .additional_mass_properties(mass)
            .linvel(vector(velocity.as_slice()))
            .angvel(vector(spin.as_slice()))
            .can_sleep(false);
        let body = world.insert_body(body);
        for geom in 0..model.geom_type().len() {
            if let Some(collider) = collider(model, geom) {
                let on = (model.geom_bodyid()[geom] == 1).then_some(body);
                world.insert_collider(collider, on);
            }
        }
        Self {
            world,
            body,
            center,
        }
    }

    /// Takes a step under a force at the centre of mass and a torque; returns the state after it.
    ///
    /// Force and torque are in the world's frame, N and N m.
    pub(super) fn step(&mut self, wrench: &[f64; 6]) -> ([f64; 7], [f64; 6]) {
        let body = &mut self.world.bodies[self.body];
        body.reset_forces(false);
        body.reset_torques(false);
        body.add_force(vector(&wrench[..3]), false);
        body.add_torque(vector(&wrench[3..]), false);
        self.world.step();
        let body = &self.world.bodies[self.body];
        let (place, turn) = (wide(body.translation()), wide_rotation(*body.rotation()));
        let spin = wide(body.angvel());
        let velocity = wide(body.linvel()) - spin.cross(&(turn * self.center));
        let own = turn.inverse() * spin;
        let q = turn.quaternion();
        (
            [place.x, place.y, place.z, q.w, q.i, q.j, q.k],
            [velocity.x, velocity.y, velocity.z, own.x, own.y, own.z],
        )
    }
}

/// A colliding geom as a shape with its sliding friction. Its restitution follows from MuJoCo's
/// spring and damper.
fn collider(model: &MjModel, geom: usize) -> Option<ColliderBuilder> {
    if model.geom_contype()[geom] == 0 {
        return None;
    }
    let [a, b, c] = model.geom_size()[geom].map(|x| x as f32);
    // The axis of a cylinder is y in rapier and z in MuJoCo.
    let upright = Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let (shape, turn) = match model.geom_type()[geom] {
        MjtGeomBase::mjGEOM_PLANE => (SharedShape::halfspace(Vector::Z), Rotation::IDENTITY),
        MjtGeomBase::mjGEOM_SPHERE => (SharedShape::ball(a), Rotation::IDENTITY),
        MjtGeomBase::mjGEOM_CYLINDER => (SharedShape::cylinder(b, a), upright),
        MjtGeomBase::mjGEOM_BOX => (SharedShape::cuboid(a, b, c), Rotation::IDENTITY),
        _ => return None,
    };
    let own = rotation(&model.geom_quat()[geom]);
    let pose = Pose::from_parts(vector(&model.geom_pos()[geom]), own * turn);
    Some(
        ColliderBuilder::new(shape)
            .position(pose)
            .density(0.0)
            .friction(model.geom_friction()[geom][0] as f32)
            .friction_combine_rule(CoefficientCombineRule::Max)
            .restitution(restitution(model.geom_solref()[geom]) as f32)
            .restitution_combine_rule(CoefficientCombineRule::Max),
    )
}

/// Coefficient of restitution of a linear spring and damper, `exp(-pi z / sqrt(1 - z²))` with the
/// damping ratio `z`.
///
/// It is 0 if the contact is not given by stiffness and damping, or is damped critically or more.
fn restitution([stiffness, damping]: [f64; 2]) -> f64 {
    let ratio = -damping / (2.0 * (-stiffness).max(f64::MIN_POSITIVE).sqrt());
    if stiffness >= 0.0 || ratio >= 1.0 {
        return 0.0;
    }
    (-std::f64::consts::PI * ratio / (1.0 - ratio * ratio).sqrt()).exp()
}
