//! Tracked signals: what a tracker measures in the real world.

use nalgebra::{Quaternion, UnitQuaternion};

/// A sensor that a tracker measures in the real world, with its noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Name of the sensor in the scene.
    pub sensor: String,
    /// Standard deviation of the noise of each entry; for an orientation, of each rotation angle.
    pub noise: f64,
}

/// Quaternion from `w x y z`.
#[must_use]
pub fn unit_quaternion(wxyz: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]))
}

/// Rotation vector (rad, world frame) that turns `b` into `a`, both `w x y z`.
///
/// The sign of a quaternion is irrelevant. NaN where either is not finite.
#[must_use]
pub fn rotation_difference(a: &[f64], b: &[f64]) -> [f64; 3] {
    if a.iter().chain(b).any(|x| !x.is_finite()) {
        return [f64::NAN; 3];
    }
    let turn = (unit_quaternion(a) * unit_quaternion(b).inverse()).scaled_axis();
    [turn.x, turn.y, turn.z]
}

/// Heading about the vertical axis, rad in `(-pi, pi]`, of an orientation `w x y z`.
#[must_use]
pub fn yaw(wxyz: &[f64]) -> f64 {
    let [w, x, y, z] = [wxyz[0], wxyz[1], wxyz[2], wxyz[3]];
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_compared_as_rotations() {
        let turn = UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(0.0, 0.0, 0.3));
        let a = [turn.w, turn.i, turn.j, turn.k];
        let negated = a.map(|x| -x);
        let b = [1.0, 0.0, 0.0, 0.0];
        for q in [a, negated] {
            let d = rotation_difference(&q, &b);
            assert!((d[2] - 0.3).abs() < 1e-12 && d[0].abs() < 1e-12, "{d:?}");
        }
        assert!((yaw(&a) - 0.3).abs() < 1e-12);
    }
}
