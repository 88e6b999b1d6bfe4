//! Rotations as MJCF states them.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};

/// Ways to state a rotation. An element states at most one.
pub(super) const ROTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// The rotation that an attribute states by some numbers; `None` where they state none.
///
/// `unit` is that of angles, rad. `order` has an axis for each angle of `euler`: moving axes in
/// small letters, fixed ones in capitals.
pub(super) fn rotation(
    attribute: &str,
    numbers: &[f64],
    unit: f64,
    order: &str,
) -> Option<UnitQuaternion<f64>> {
    match (attribute, numbers) {
        ("quat", &[w, x, y, z]) => UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.0),
        ("axisangle", &[x, y, z, angle]) => {
            let axis = Unit::try_new(Vector3::new(x, y, z), 0.0)?;
            Some(UnitQuaternion::from_axis_angle(&axis, unit * angle))
        }
        ("euler", &[a, b, c]) => Some(turned_about([a, b, c].map(|x| unit * x), order)),
        ("xyaxes", &[a, b, c, d, e, f]) => {
            let x = Vector3::new(a, b, c).try_normalize(0.0)?;
            let z = x.cross(&Vector3::new(d, e, f)).try_normalize(0.0)?;
            let axes = [x, z.cross(&x), z];
            Some(UnitQuaternion::from_basis_unchecked(&axes))
        }
        ("zaxis", &[x, y, z]) => {
            let along = Vector3::new(x, y, z);
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along);
            // As in MuJoCo, half a turn is about x.
            let half = std::f64::consts::PI;
            Some(turn.unwrap_or(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), half)))
        }
        _ => None,
    }
}

/// Turns by three angles (rad), one after the other.
fn turned_about(angles: [f64; 3], order: &str) -> UnitQuaternion<f64> {
    let turns = order.chars().zip(angles);
    turns.fold(UnitQuaternion::identity(), |all, (letter, angle)| {
        let axis = match letter.to_ascii_lowercase() {
            'x' => Vector3::x_axis(),
            'y' => Vector3::y_axis(),
            _ => Vector3::z_axis(),
        };
        let turn = UnitQuaternion::from_axis_angle(&axis, angle);
        if letter.is_ascii_lowercase() {
            all * turn
        } else {
            turn * all
        }
    })
}
