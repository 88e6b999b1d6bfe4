//! A point of a body: its position, its motion, and forces on it.

use asid_core::nalgebra::{Isometry3, Translation3, Vector3};
use asid_core::signal::unit_quaternion;
use asid_core::simulator::StepView;
use asid_mjcf::Plant;

/// How a body is connected to the world.
enum Reach {
    /// By a free joint of its own: indices in `qpos` and `qvel`.
    Free { qpos: usize, dof: usize },
    /// By a chain of joints; `jacobian` is a buffer of `6 x nv` numbers.
    Chain {
        plant: Box<Plant>,
        body: usize,
        jacobian: Vec<f64>,
    },
}

/// A point fixed in a body.
pub struct BodyPoint {
    reach: Reach,
    /// In the body's frame, m.
    at: Vector3<f64>,
}

/// Motion of a point and its body in the world's frame.
pub struct Motion {
    /// Position, m.
    pub place: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity of the body, rad/s.
    pub turning: Vector3<f64>,
}

impl BodyPoint {
    /// The centre of mass of a body.
    pub fn center(plant: &Plant, body: usize) -> Self {
        Self::new(plant, body, plant.bodies[body].center)
    }

    /// The origin of a body's frame.
    pub fn origin(plant: &Plant, body: usize) -> Self {
        Self::new(plant, body, [0.0; 3])
    }

    fn new(plant: &Plant, body: usize, at: [f64; 3]) -> Self {
        let reach = match plant.free_joint(body) {
            Some(joint) => Reach::Free {
                qpos: plant.layout.joints[joint].qpos,
                dof: plant.layout.joints[joint].qvel,
            },
            None => Reach::Chain {
                plant: Box::new(plant.clone()),
                body,
                jacobian: vec![0.0; 6 * plant.layout.nv],
            },
        };
        Self {
            reach,
            at: at.into(),
        }
    }

    /// Motion of the point in a state; keeps the Jacobian for [`BodyPoint::push`].
    pub fn motion(&mut self, qpos: &[f64], qvel: &[f64]) -> Motion {
        match &mut self.reach {
            Reach::Free { qpos: at, dof } => {
                let body = free_pose(qpos, *at);
                let arm = body.rotation * self.at;
                let v = Vector3::from_column_slice(&qvel[*dof..*dof + 3]);
                let turning = body.rotation * Vector3::from_column_slice(&qvel[*dof + 3..*dof + 6]);
                Motion {
                    place: body.translation.vector + arm,
                    velocity: v + turning.cross(&arm),
                    turning,
                }
            }
            Reach::Chain {
                plant,
                body,
                jacobian,
            } => {
                let pose = plant.point_jacobian(qpos, *body, self.at.into(), jacobian);
                let row = |i: usize| {
                    let entries = jacobian[i * qvel.len()..].iter().zip(qvel);
                    entries.map(|(j, v)| j * v).sum::<f64>()
                };
                Motion {
                    place: pose.translation.vector + pose.rotation * self.at,
                    velocity: Vector3::new(row(0), row(1), row(2)),
                    turning: Vector3::new(row(3), row(4), row(5)),
                }
            }
        }
    }

    /// Adds a force (N, world frame) at the point to the generalised forces of the step.
    ///
    /// [`BodyPoint::motion`] must be called first in the same step.
    pub fn push(&self, view: &mut StepView<'_>, force: &Vector3<f64>) {
        match &self.reach {
            Reach::Free { qpos, dof } => {
                let body = free_pose(view.qpos, *qpos);
                let torque = self.at.cross(&(body.rotation.inverse() * force));
                for k in 0..3 {
                    view.force[dof + k] += force[k];
                    view.force[dof + 3 + k] += torque[k];
                }
            }
            Reach::Chain { jacobian, .. } => {
                let nv = view.force.len();
                for (i, out) in view.force.iter_mut().enumerate() {
                    for k in 0..3 {
                        *out += jacobian[k * nv + i] * force[k];
                    }
                }
            }
        }
    }
}

/// Pose of a body on a free joint.
fn free_pose(qpos: &[f64], at: usize) -> Isometry3<f64> {
    let place = Translation3::new(qpos[at], qpos[at + 1], qpos[at + 2]);
    Isometry3::from_parts(place, unit_quaternion(&qpos[at + 3..at + 7]))
}
