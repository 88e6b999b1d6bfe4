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

/// Norm of a quaternion below which it is no orientation.
///
/// A lost tracker or an unset IMU reports zeros. Rounding to one digit leaves a norm of 0.9 at
/// least; half of that is a margin.
const SHORTEST: f64 = 0.5;
/// Norm of a quaternion above which it is no orientation: the inverse of [`SHORTEST`].
const LONGEST: f64 = 2.0;

/// Orientation from `w x y z`.
///
/// `None` where an entry is not finite, or where the norm shows that it is no orientation: below 0.5
/// or above 2.
#[must_use]
pub fn orientation(wxyz: &[f64]) -> Option<UnitQuaternion<f64>> {
    // The comparison is false for NaN.
    (SHORTEST..=LONGEST)
        .contains(&norm(wxyz))
        .then(|| unit_quaternion(wxyz))
}

/// Norm of a quaternion.
fn norm(wxyz: &[f64]) -> f64 {
    wxyz.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Quaternion from `w x y z`.
#[must_use]
pub fn unit_quaternion(wxyz: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]))
}

/// Rotation vector (rad, world frame) that turns `b` into `a`, both `w x y z`.
///
/// The sign of a quaternion is irrelevant. NaN where either is not finite, or zero: zeros are no
/// orientation, and no difference from one.
#[must_use]
pub fn rotation_difference(a: &[f64], b: &[f64]) -> [f64; 3] {
    let turns = |q: &[f64]| (f64::MIN_POSITIVE..f64::INFINITY).contains(&norm(q));
    if !(turns(a) && turns(b)) {
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

    /// Symptom: a row in which a tracker was lost counted as a perfect reading. Cause: zeros have no
    /// axis, and the rotation vector without an axis is 0.
    #[test]
    fn zeros_are_no_orientation_and_no_difference_from_one() {
        let (zero, one) = ([0.0; 4], [1.0, 0.0, 0.0, 0.0]);
        for (a, b) in [(zero, one), (one, zero), (zero, zero)] {
            assert!(rotation_difference(&a, &b).iter().all(|x| x.is_nan()));
        }
        let scaled = |x: f64| [0.6 * x, 0.0, 0.8 * x, 0.0];
        for lost in [zero, scaled(0.49), scaled(2.01), [f64::NAN, 1.0, 0.0, 0.0]] {
            assert_eq!(orientation(&lost), None, "{lost:?}");
        }
        // The digits of a log leave the norm near 1.
        for x in [0.6, 1.0, 1.9] {
            let turn = orientation(&scaled(x)).unwrap();
            assert!((turn.w - 0.6).abs() < 1e-12 && (turn.j - 0.8).abs() < 1e-12);
        }
    }
}
