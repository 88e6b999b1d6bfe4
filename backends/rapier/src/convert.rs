//! Conversions between rapier's single precision and the `f64` of the interface.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rapier3d::math::{Pose, Rotation, Vector};

/// A vector in double precision.
pub fn vector(v: Vector) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

/// A rotation in double precision, normalised there.
pub fn rotation(q: Rotation) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(
        f64::from(q.w),
        f64::from(q.x),
        f64::from(q.y),
        f64::from(q.z),
    ))
}

/// A vector in rapier's precision.
pub fn to_vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

/// A rotation in rapier's precision.
pub fn to_rotation(q: &UnitQuaternion<f64>) -> Rotation {
    Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32).normalize()
}

/// A pose in rapier's precision.
pub fn to_pose(position: &Vector3<f64>, orientation: &UnitQuaternion<f64>) -> Pose {
    Pose::from_parts(to_vector(position), to_rotation(orientation))
}

/// The rotation of four entries w x y z; as in MuJoCo, the identity if all are zero.
pub fn quaternion(wxyz: &[f64]) -> UnitQuaternion<f64> {
    let q = Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    if q.norm() < 1e-15 {
        return UnitQuaternion::identity();
    }
    UnitQuaternion::from_quaternion(q)
}

/// A pose of the MJCF parser as position and orientation.
pub fn parts(pose: &mjcf_rs::Pose) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let (p, q) = (pose.translation, pose.rotation);
    (
        Vector3::new(p.x, p.y, p.z),
        UnitQuaternion::from_quaternion(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}
