//! Generalised coordinates: reads MuJoCo's `qpos` and `qvel` from a state and sets them.
//!
//! rapier stores a free body's velocity at its centre of mass and in the world frame, a ball
//! joint's rate in the parent's frame, and a hinge's angle from its own zero. The layout requires
//! the velocity of the body's origin with the rate in the body's frame, a ball's rate in the
//! child's frame, and MJCF `ref`.

use asid_core::layout::JointKind;
use nalgebra::{UnitQuaternion, Vector3};
use rapier3d::dynamics::{Multibody, RigidBody};
use rapier3d::math::Rotation;

use crate::compiled::{Compiled, set_inertia};
use crate::convert;
use crate::slot::JointSlot;
use crate::state::State;
use crate::structure::Structure;
use crate::tables::Tables;

/// Index of the free axis of a hinge or slide in rapier's six coordinates.
pub fn axis(kind: JointKind) -> usize {
    match kind {
        JointKind::Slide => 0,
        _ => 3,
    }
}

impl State {
    /// The rigid body of a body of the layout.
    pub fn body(&self, compiled: &Compiled, body: usize) -> Option<&RigidBody> {
        compiled.bodies[body].and_then(|h| self.bodies.get(h))
    }

    fn link(&self, joint: &JointSlot) -> Option<(&Multibody, usize)> {
        joint.handle.and_then(|h| self.multibodies.get(h))
    }

    /// Coordinate and velocity of a hinge or slide, including `ref`.
    pub fn scalar(&self, joint: &JointSlot) -> (f64, f64) {
        let Some((multibody, id)) = self.link(joint) else {
            return (0.0, 0.0);
        };
        let Some(link) = multibody.link(id) else {
            return (0.0, 0.0);
        };
        let q = f64::from(link.joint().coords()[axis(joint.kind)]);
        let v = multibody.generalized_velocity()[link.assembly_id()];
        (q + joint.reference, f64::from(v))
    }

    /// World position, orientation, velocity of the centre of mass, and angular
    /// velocity of a body.
    pub fn motion(&self, compiled: &Compiled, body: usize) -> Motion {
        let Some(handle) = compiled.bodies[body] else {
            return Motion::default();
        };
        let Some(rigid) = self.bodies.get(handle) else {
            return Motion::default();
        };
        let pose = rigid.position();
        let rotation = convert::rotation(pose.rotation);
        let position = convert::vector(pose.translation);
        let local = rigid.mass_properties().local_mprops.local_com;
        let center = position + rotation * convert::vector(local);
        let (mut linear, mut angular) = (
            convert::vector(rigid.linvel()),
            convert::vector(rigid.angvel()),
        );
        // rapier's stored values of a link are those of an earlier substep.
        if let Some(link) = self.multibodies.rigid_body_link(handle)
            && let Some(multibody) = self.multibodies.get_multibody(link.multibody)
        {
            let jacobian = multibody.body_jacobian(link.id);
            if jacobian.ncols() == multibody.generalized_velocity().len() {
                let v = jacobian * multibody.generalized_velocity();
                linear = Vector3::new(v[0].into(), v[1].into(), v[2].into());
                angular = Vector3::new(v[3].into(), v[4].into(), v[5].into());
            }
        }
        Motion {
            position,
            rotation,
            center,
            linear,
            angular,
        }
    }

    /// Updates the velocity of links that can touch something: rapier leaves the one of the
    /// previous substep, and contacts use it.
    pub fn refresh_link_velocities(&mut self, compiled: &Compiled) {
        for &body in &compiled.touching_links {
            let motion = self.motion(compiled, body);
            if let Some(rigid) = compiled.bodies[body].and_then(|h| self.bodies.get_mut(h)) {
                rigid.set_linvel(convert::to_vector(&motion.linear), false);
                rigid.set_angvel(convert::to_vector(&motion.angular), false);
            }
        }
    }

    /// Orientation of the root of a floating tree.
    pub fn root_rotation(&self, compiled: &Compiled, body: usize) -> Rotation {
        self.body(compiled, body)
            .map_or(Rotation::IDENTITY, |b| b.position().rotation)
    }

    /// Corrects the position of a floating tree's root after a step in which it turned from
    /// `before`.
    ///
    /// rapier moves a root's origin with the velocity of its centre of mass, as if the centre were
    /// at the origin.
    pub fn correct_root(&mut self, compiled: &Compiled, body: usize, before: Rotation) {
        let Some(handle) = compiled.bodies[body] else {
            return;
        };
        let Some(rigid) = self.bodies.get_mut(handle) else {
            return;
        };
        let center = rigid.mass_properties().local_mprops.local_com;
        let mut pose = *rigid.position();
        pose.translation += before * center - pose.rotation * center;
        rigid.set_position(pose, false);
        if let Some(link) = self.multibodies.rigid_body_link(handle).copied()
            && let Some(multibody) = self.multibodies.get_multibody_mut(link.multibody)
        {
            multibody.forward_kinematics(&self.bodies, true);
            multibody.update_rigid_bodies(&mut self.bodies, true);
        }
    }

    /// Reads `qpos` (`nq`) and `qvel` (`nv`).
    pub fn coordinates(&self, compiled: &Compiled, qpos: &mut [f64], qvel: &mut [f64]) {
        for joint in &compiled.joints {
            let q = &mut qpos[joint.qpos..joint.qpos + joint.kind.qpos_len()];
            let v = &mut qvel[joint.qvel..joint.qvel + joint.kind.qvel_len()];
            match joint.kind {
                JointKind::Hinge | JointKind::Slide => (q[0], v[0]) = self.scalar(joint),
                JointKind::Ball => {
                    let (rotation, rate) = self.ball(joint);
                    q.copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
                    v.copy_from_slice(rate.as_slice());
                }
                JointKind::Free => {
                    let motion = self.motion(compiled, joint.body);
                    let (p, r) = (motion.position, motion.rotation);
                    q.copy_from_slice(&[p.x, p.y, p.z, r.w, r.i, r.j, r.k]);
                    v[..3].copy_from_slice(motion.velocity_at(&p).as_slice());
                    v[3..].copy_from_slice((r.inverse() * motion.angular).as_slice());
                }
            }
        }
    }

    /// Rotation of a ball joint and its rate in the child's frame.
    pub fn ball(&self, joint: &JointSlot) -> (UnitQuaternion<f64>, Vector3<f64>) {
        let identity = (UnitQuaternion::identity(), Vector3::zeros());
        let Some((multibody, id)) = self.link(joint) else {
            return identity;
        };
        let Some(link) = multibody.link(id) else {
            return identity;
        };
        let rotation = convert::rotation(link.joint().joint_rot());
        let (v, at) = (multibody.generalized_velocity(), link.assembly_id());
        let rate = Vector3::new(v[at].into(), v[at + 1].into(), v[at + 2].into());
        (rotation, rotation.inverse() * rate)
    }

    /// Sets `qpos` and `qvel` of a state without a history: the pristine one.
    pub fn set_coordinates(&mut self, compiled: &Compiled, qpos: &[f64], qvel: &[f64]) {
        for joint in &compiled.joints {
            let q = &qpos[joint.qpos..joint.qpos + joint.kind.qpos_len()];
            let v = &qvel[joint.qvel..joint.qvel + joint.kind.qvel_len()];
            if joint.kind == JointKind::Free {
                self.set_free(compiled, joint, q, v);
                continue;
            }
            let Some((multibody, id)) = joint.handle.and_then(|h| self.multibodies.get_mut(h))
            else {
                continue;
            };
            let Some(link) = multibody.link_mut(id) else {
                continue;
            };
            let first = link.assembly_id();
            let current = link.joint.coords()[axis(joint.kind)];
            match joint.kind {
                JointKind::Ball => {
                    let target = convert::quaternion(q);
                    let delta = convert::to_rotation(&target) * link.joint.joint_rot().inverse();
                    let turn = Rotation::to_scaled_axis(delta);
                    link.joint.apply_displacement(&[turn.x, turn.y, turn.z]);
                    let rate = target * Vector3::new(v[0], v[1], v[2]);
                    for i in 0..3 {
                        multibody.generalized_velocity_mut()[first + i] = rate[i] as f32;
                    }
                }
                _ => {
                    let target = (q[0] - joint.reference) as f32;
                    link.joint.apply_displacement(&[target - current]);
                    multibody.generalized_velocity_mut()[first] = v[0] as f32;
                }
            }
        }
        for joint in &compiled.joints {
            if let Some((multibody, _)) = joint.handle.and_then(|h| self.multibodies.get_mut(h)) {
                multibody.forward_kinematics(&self.bodies, true);
                multibody.update_rigid_bodies(&mut self.bodies, true);
            }
        }
    }

    fn set_free(&mut self, compiled: &Compiled, joint: &JointSlot, q: &[f64], v: &[f64]) {
        let Some(handle) = compiled.bodies[joint.body] else {
            return;
        };
        let Some(body) = self.bodies.get_mut(handle) else {
            return;
        };
        let position = Vector3::new(q[0], q[1], q[2]);
        let rotation = convert::quaternion(&q[3..7]);
        body.set_position(convert::to_pose(&position, &rotation), true);
        let angular = rotation * Vector3::new(v[3], v[4], v[5]);
        let arm = rotation * convert::vector(body.mass_properties().local_mprops.local_com);
        let linear = Vector3::new(v[0], v[1], v[2]) + angular.cross(&arm);
        body.set_linvel(convert::to_vector(&linear), true);
        body.set_angvel(convert::to_vector(&angular), true);
        if let Some(link) = self.multibodies.rigid_body_link(handle).copied()
            && let Some(multibody) = self.multibodies.get_multibody_mut(link.multibody)
        {
            let mut velocity = multibody.generalized_velocity_mut();
            for i in 0..3 {
                velocity[i] = linear[i] as f32;
                velocity[3 + i] = angular[i] as f32;
            }
        }
    }

    /// Rebuilds masses, positions of geoms, and positions and axes of joints where they differ from
    /// `tables`.
    pub fn rebuild(&mut self, compiled: &Compiled, tables: &Tables) {
        let wanted = &tables.structure;
        if self.structure == *wanted {
            return;
        }
        for body in 1..compiled.bodies.len() {
            let geoms = compiled.masses.geoms_of(body);
            let same = self.structure.geoms[geoms.clone()] == wanted.geoms[geoms.clone()]
                && self.structure.bodies[body] == wanted.bodies[body];
            if same {
                continue;
            }
            for geom in geoms {
                let place = wanted.geoms[geom].position;
                if self.structure.geoms[geom].position == place {
                    continue;
                }
                if let Some(collider) =
                    compiled.colliders[geom].and_then(|h| self.colliders.get_mut(h))
                    && let Some(mut pose) = collider.position_wrt_parent().copied()
                {
                    pose.translation = convert::to_vector(&place);
                    collider.set_position_wrt_parent(pose);
                }
            }
            let inertia = compiled.masses.inertia(body, wanted);
            let Some(handle) = compiled.bodies[body] else {
                continue;
            };
            let Some(rigid) = self.bodies.get_mut(handle) else {
                continue;
            };
            // The velocity of the body's origin stays the same, so that of its centre follows it.
            let before = rigid.center_of_mass();
            set_inertia(rigid, &self.colliders, &inertia);
            let shift = rigid.center_of_mass() - before;
            let linear = rigid.linvel() + rigid.angvel().cross(shift);
            rigid.set_linvel(linear, false);
        }
        for (geom, collider) in compiled.colliders.iter().enumerate() {
            let world = compiled.body_of_geom[geom] == 0;
            let place = wanted.geoms[geom].position;
            if world
                && self.structure.geoms[geom].position != place
                && let Some(collider) = collider.and_then(|h| self.colliders.get_mut(h))
                && let Some(mut pose) = collider.position_wrt_parent().copied()
            {
                pose.translation = convert::to_vector(&place);
                collider.set_position_wrt_parent(pose);
            }
        }
        self.place_joints(compiled, wanted);
        self.structure = wanted.clone();
    }

    /// Moves joints' anchors and axes within their bodies, and bodies in their parents; the joints'
    /// coordinates stay.
    fn place_joints(&mut self, compiled: &Compiled, wanted: &Structure) {
        for (i, joint) in compiled.joints.iter().enumerate() {
            let (is, body) = (&self.structure, joint.body);
            let (anchor, axis) = (wanted.anchors[i], wanted.axes[i]);
            let moved = wanted.places[body] - is.places[body];
            if is.anchors[i] == anchor && is.axes[i] == axis && moved == Vector3::zeros() {
                continue;
            }
            let turn = UnitQuaternion::rotation_between(&is.axes[i], &axis);
            let Some((multibody, id)) = joint.handle.and_then(|h| self.multibodies.get_mut(h))
            else {
                continue;
            };
            if let Some(link) = multibody.link_mut(id) {
                let (parent, child) = (
                    &mut link.joint.data.local_frame1,
                    link.joint.data.local_frame2,
                );
                // With the joint at zero, both frames coincide.
                let parent_from_child = parent.rotation * child.rotation.inverse();
                let mut own = child;
                own.translation = convert::to_vector(&anchor);
                if let Some(turn) = turn {
                    own.rotation = convert::to_rotation(&turn) * child.rotation;
                }
                parent.rotation = parent_from_child * own.rotation;
                parent.translation += convert::to_vector(&moved)
                    + parent_from_child * (own.translation - child.translation);
                link.joint.data.local_frame2 = own;
            }
            multibody.forward_kinematics(&self.bodies, true);
            multibody.update_rigid_bodies(&mut self.bodies, true);
        }
    }
}

/// Motion of a rigid body in the world frame.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Position of its origin, m.
    pub position: Vector3<f64>,
    /// `world_from_body`.
    pub rotation: UnitQuaternion<f64>,
    /// Centre of mass, m.
    pub center: Vector3<f64>,
    /// Velocity of the centre of mass, m/s.
    pub linear: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular: Vector3<f64>,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            position: Vector3::zeros(),
            rotation: UnitQuaternion::identity(),
            center: Vector3::zeros(),
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
        }
    }
}

impl Motion {
    /// Velocity of the body's point at `point`, m/s.
    pub fn velocity_at(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.linear + self.angular.cross(&(point - self.center))
    }
}
