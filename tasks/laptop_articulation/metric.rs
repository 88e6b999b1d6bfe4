//! Success of closing the lid: the lid's angle, from the poses of base and lid.

use asid_core::signal::{unit_quaternion, yaw};
use asid_core::task::{Outcome, Outline};
use nalgebra::Vector3;

use super::PLATE_HALF;

/// Entries of a row: position and orientation of the base, then of the lid.
pub const WIDTH: usize = 14;

/// Target angle of the lid, rad.
pub const SET_ANGLE: f64 = 0.8;

/// Smallest motion of the lid that counts as moved, rad.
pub const MIN_MOTION: f64 = 0.01;

/// Angle of the lid, rad: 0 closed, pi/2 upright, up to 2 pi.
pub fn lid_angle(row: &[f64]) -> f64 {
    let lid = unit_quaternion(&row[3..7]).inverse() * unit_quaternion(&row[10..14]);
    // The hinge's axis is -x; rotations about other axes are noise and do not count.
    (-2.0 * lid.i.atan2(lid.w)).rem_euclid(std::f64::consts::TAU)
}

/// Position and heading of the base, and the lid's angle.
pub fn locate(row: &[f64]) -> Vec<f64> {
    vec![row[0], row[1], yaw(&row[3..7]), lid_angle(row)]
}

/// Absolute difference of the lid's angle from the target, rad, per row.
pub fn errors(readings: &[f64]) -> Vec<f64> {
    readings
        .chunks_exact(WIDTH)
        .map(|row| (lid_angle(row) - SET_ANGLE).abs())
        .collect()
}

/// Outcome of an attempt: the error in the last row, at most `tolerance` (rad) for a success, and
/// whether the lid moved at all.
pub fn outcome(readings: &[f64], tolerance: f64) -> Outcome {
    let (first, last) = (&readings[..WIDTH], &readings[readings.len() - WIDTH..]);
    if last.iter().any(|x| !x.is_finite()) {
        let worst = std::f64::consts::PI;
        return Outcome {
            value: worst,
            success: false,
            cost: 2.0 * worst,
        };
    }
    let value = (lid_angle(last) - SET_ANGLE).abs();
    let moved = (lid_angle(last) - lid_angle(first)).abs() > MIN_MOTION;
    Outcome {
        value,
        success: moved && value < tolerance,
        cost: value,
    }
}

/// Side view of base and lid along the hinge: depth from the hinge to the front, and height.
pub fn side_view(row: &[f64]) -> Vec<Outline> {
    let heading = yaw(&row[3..7]);
    let front = Vector3::new(heading.sin(), -heading.cos(), 0.0);
    let plate = |label: &str, pose: &[f64]| {
        let turn = unit_quaternion(&pose[3..7]);
        let center = Vector3::new(pose[0], pose[1], pose[2]);
        let corner = |y: f64, z: f64| {
            let p = center + turn * Vector3::new(0.0, y, z);
            [p.dot(&front), p.z]
        };
        let [_, y, z] = PLATE_HALF;
        Outline {
            label: label.into(),
            corners: vec![corner(-y, -z), corner(y, -z), corner(y, z), corner(-y, z)],
        }
    };
    vec![plate("base", &row[..7]), plate("lid", &row[7..])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    /// Row with the base at a heading and the lid at an angle.
    fn row(heading: f64, angle: f64) -> Vec<f64> {
        let base = UnitQuaternion::from_scaled_axis(Vector3::z() * heading);
        let lid = base * UnitQuaternion::from_scaled_axis(-Vector3::x() * angle);
        let pose = |q: UnitQuaternion<f64>| vec![0.5, 0.1, 0.0, q.w, q.i, q.j, q.k];
        [pose(base), pose(lid)].concat()
    }

    #[test]
    fn the_angle_is_that_between_base_and_lid() {
        for heading in [0.0, 1.0, 3.0] {
            for angle in [0.1, 1.2, 2.5, 3.5] {
                let found = locate(&row(heading, angle));
                assert!((found[2] - heading).abs() < 1e-9 && (found[3] - angle).abs() < 1e-9);
                let negated: Vec<f64> = row(heading, angle).iter().map(|x| -x).collect();
                assert!((lid_angle(&negated) - angle).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_lid_at_the_set_angle_counts_only_if_it_was_moved_there() {
        let at = |from: f64, to: f64| outcome(&[row(0.3, from), row(0.3, to)].concat(), 0.05);
        assert!(at(1.8, SET_ANGLE + 0.04).success);
        assert!(!at(1.8, SET_ANGLE + 0.06).success);
        assert!(!at(SET_ANGLE, SET_ANGLE + 0.005).success);
        assert!(!outcome(&[row(0.3, 1.8), vec![f64::NAN; WIDTH]].concat(), 0.05).success);
    }
}
