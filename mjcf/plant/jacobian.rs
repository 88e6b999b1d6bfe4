//! The Jacobian of a point of a body.

use super::Plant;
use asid_core::layout::JointKind;

impl Plant {
    /// Visits the bodies from the world, which is left out, to `body`.
    fn along(&self, body: usize, visit: &mut impl FnMut(usize)) {
        if body != 0 {
            self.along(self.bodies[body].parent, visit);
            visit(body);
        }
    }

    /// Pose `world_from_body` of a body in a state, and the Jacobian of its point `at`.
    ///
    /// `jacobian` (`6 x nv`, row-major) receives the point's linear, then angular velocity per unit
    /// of each entry of `qvel`. It is overwritten; it has `6 nv` entries.
    pub fn point_jacobian(
        &self,
        qpos: &[f64],
        body: usize,
        at: [f64; 3],
        jacobian: &mut [f64],
    ) -> nalgebra::Isometry3<f64> {
        use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
        let nv = self.layout.nv;
        jacobian.fill(0.0);
        // Two passes: the pose of the point first, then the columns that need it.
        let mut tip = Vector3::zeros();
        let mut world = Isometry3::identity();
        for pass in 0..2 {
            world = Isometry3::identity();
            self.along(body, &mut |b: usize| {
                world *= self.poses[b];
                for j in self.bodies[b].joints.clone() {
                    let (place, joint) = (&self.layout.joints[j], &self.joints[j]);
                    let q = &qpos[place.qpos..];
                    let mut set = |row: usize, column: usize, v: Vector3<f64>| {
                        for k in 0..3 {
                            jacobian[(row + k) * nv + column] = v[k];
                        }
                    };
                    match place.kind {
                        JointKind::Free => {
                            let turn = asid_core::signal::unit_quaternion(&q[3..7]);
                            world =
                                Isometry3::from_parts(Translation3::new(q[0], q[1], q[2]), turn);
                            if pass == 1 {
                                let arm = tip - world.translation.vector;
                                for k in 0..3 {
                                    let unit = Vector3::ith(k, 1.0);
                                    set(0, place.qvel + k, unit);
                                    let axis = turn * unit;
                                    set(0, place.qvel + 3 + k, axis.cross(&arm));
                                    set(3, place.qvel + 3 + k, axis);
                                }
                            }
                        }
                        JointKind::Ball => {
                            let anchor = Vector3::from(joint.anchor);
                            let turn = asid_core::signal::unit_quaternion(&q[..4]);
                            let pivot = world * Point3::from(anchor);
                            world *= Isometry3::from_parts(
                                Translation3::from(anchor - turn * anchor),
                                turn,
                            );
                            if pass == 1 {
                                let arm = tip - pivot.coords;
                                for k in 0..3 {
                                    let axis = world.rotation * Vector3::ith(k, 1.0);
                                    set(0, place.qvel + k, axis.cross(&arm));
                                    set(3, place.qvel + k, axis);
                                }
                            }
                        }
                        JointKind::Hinge | JointKind::Slide => {
                            let moved = q[0] - joint.reference;
                            let own = Unit::new_normalize(Vector3::from(joint.axis));
                            let axis = world.rotation * own.into_inner();
                            let anchor = Vector3::from(joint.anchor);
                            let pivot = world * Point3::from(anchor);
                            if place.kind == JointKind::Hinge {
                                let turn = UnitQuaternion::from_axis_angle(&own, moved);
                                world *= Isometry3::from_parts(
                                    Translation3::from(anchor - turn * anchor),
                                    turn,
                                );
                                if pass == 1 {
                                    set(0, place.qvel, axis.cross(&(tip - pivot.coords)));
                                    set(3, place.qvel, axis);
                                }
                            } else {
                                world *= Translation3::from(own.into_inner() * moved);
                                if pass == 1 {
                                    set(0, place.qvel, axis);
                                }
                            }
                        }
                    }
                }
            });
            tip = (world * Point3::from(Vector3::from(at))).coords;
        }
        world
    }
}
