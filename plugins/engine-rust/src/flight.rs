//! The motion of one rigid body.
//!
//! It integrates the Newton-Euler equations at the centre of mass by semi-implicit Euler steps:
//! first the velocities, then the pose with the new velocities. The state is that of a free joint:
//! origin and orientation of the body's frame, velocity of the origin in the world, angular
//! velocity in the body.

use asid_core::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Constant properties of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, m.
    pub center: Vector3<f64>,
    /// Inertia about the centre of mass along the body's axes, kg m².
    pub inertia: Matrix3<f64>,
    /// Inverse of the inertia.
    pub inverse: Matrix3<f64>,
}

/// Pose and velocity of a body.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Origin in the world, m.
    pub position: Vector3<f64>,
    /// `world_from_body`.
    pub rotation: UnitQuaternion<f64>,
    /// Velocity of the origin in the world, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity in the body's frame, rad/s.
    pub spin: Vector3<f64>,
}

impl Motion {
    /// Reads the seven positions and six velocities of a free joint.
    #[must_use]
    pub fn read(qpos: &[f64], qvel: &[f64]) -> Self {
        Self {
            position: Vector3::from_column_slice(&qpos[..3]),
            rotation: UnitQuaternion::new_unchecked(Quaternion::new(
                qpos[3], qpos[4], qpos[5], qpos[6],
            )),
            velocity: Vector3::from_column_slice(&qvel[..3]),
            spin: Vector3::from_column_slice(&qvel[3..6]),
        }
    }

    /// Writes the seven positions and six velocities of a free joint.
    pub fn write(&self, qpos: &mut [f64], qvel: &mut [f64]) {
        qpos[..3].copy_from_slice(self.position.as_slice());
        let q = self.rotation;
        qpos[3..7].copy_from_slice(&[q.w, q.i, q.j, q.k]);
        qvel[..3].copy_from_slice(self.velocity.as_slice());
        qvel[3..6].copy_from_slice(self.spin.as_slice());
    }

    /// Velocity in the world of a body-fixed point, m/s.
    #[must_use]
    pub fn velocity_of(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.rotation * self.spin.cross(point)
    }
}

/// Forces on a body during a step.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    /// Force at the centre of mass, in the world, N.
    pub force: Vector3<f64>,
    /// Torque in the world, N m.
    pub torque: Vector3<f64>,
    /// Generalised force of the free joint.
    ///
    /// Three components act at the origin in the world, then three about the origin in the body.
    pub joint: [f64; 6],
}

/// Takes one step of `dt` seconds under `gravity` (m/s²).
pub fn step(body: &Body, motion: &mut Motion, load: &Load, gravity: &Vector3<f64>, dt: f64) {
    let [fx, fy, fz, tx, ty, tz] = load.joint;
    let at_origin = Vector3::new(fx, fy, fz);
    let to_body = motion.rotation.inverse();
    let force = load.force + at_origin;
    let torque = to_body * load.torque + Vector3::new(tx, ty, tz)
        - body.center.cross(&(to_body * at_origin));

    let spin = motion.spin;
    let center = motion.position + motion.rotation * body.center;
    let velocity = motion.velocity_of(&body.center) + (force / body.mass + gravity) * dt;
    let gyroscopic = spin.cross(&(body.inertia * spin));
    motion.spin += body.inverse * (torque - gyroscopic) * dt;
    motion.rotation *= UnitQuaternion::from_scaled_axis(motion.spin * dt);
    motion.rotation.renormalize();
    motion.position = center + velocity * dt - motion.rotation * body.center;
    motion.velocity = velocity - motion.rotation * motion.spin.cross(&body.center);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angular_momentum_is_conserved_to_first_order() {
        let inertia = Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.3));
        let body = Body {
            mass: 2.0,
            center: Vector3::new(0.1, -0.2, 0.05),
            inertia,
            inverse: Matrix3::from_diagonal(&Vector3::new(10.0, 5.0, 1.0 / 0.3)),
        };
        let free = Load {
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
            joint: [0.0; 6],
        };
        let drift = |dt: f64| {
            let mut motion = Motion {
                position: Vector3::zeros(),
                rotation: UnitQuaternion::identity(),
                velocity: Vector3::new(1.0, 0.0, 0.0),
                spin: Vector3::new(1.0, 2.0, 3.0),
            };
            let momentum = |m: &Motion| m.rotation * (inertia * m.spin);
            let before = momentum(&motion);
            let carried = motion.velocity_of(&body.center);
            for _ in 0..(1.0 / dt) as usize {
                step(&body, &mut motion, &free, &Vector3::zeros(), dt);
            }
            assert!((motion.velocity_of(&body.center) - carried).norm() < 1e-12);
            (momentum(&motion) - before).norm()
        };
        let (coarse, fine) = (drift(1e-3), drift(5e-4));
        assert!(coarse < 2e-3, "{coarse}");
        assert!((1.8..2.2).contains(&(coarse / fine)), "{}", coarse / fine);
    }
}
