//! Success of balancing: the tilt of the rod, from its pose.

use asid_core::signal::unit_quaternion;
use asid_core::task::{Outcome, Outline};
use nalgebra::Vector3;

use super::{LEDGE, ROD_HALF};
use crate::rectangle;

/// Largest tilt of a success, degrees.
pub const MAX_TILT: f64 = 5.0;

/// Cost added where the rod has left the ledge, degrees (the published code's reward is -10 in this
/// case).
const DROP_COST: f64 = 10.0;

/// Largest distance of the rod's middle from its rest height on the ledge, m.
const HEIGHT_TOLERANCE: f64 = 0.005;

/// Tilt of the rod's long axis against the horizontal, degrees, from a row of position and
/// orientation.
pub fn tilt_deg(row: &[f64]) -> f64 {
    let axis = unit_quaternion(&row[3..7]) * Vector3::y();
    axis.z.clamp(-1.0, 1.0).asin().abs().to_degrees()
}

/// Outcome of an attempt: the tilt in the last row.
pub fn outcome(readings: &[f64]) -> Outcome {
    let last = &readings[readings.len() - 7..];
    if last.iter().any(|x| !x.is_finite()) {
        return Outcome {
            value: 90.0,
            success: false,
            cost: 90.0 + DROP_COST,
        };
    }
    let value = tilt_deg(last);
    let on_ledge = (last[2] - LEDGE[2] - ROD_HALF[2]).abs() < HEIGHT_TOLERANCE;
    Outcome {
        value,
        success: on_ledge && value < MAX_TILT,
        cost: value + if on_ledge { 0.0 } else { DROP_COST },
    }
}

/// Side view in the x-z plane: the ledge, of a width in m, and the rod.
pub fn side_view(row: &[f64], ledge_width: f64) -> Vec<Outline> {
    let axis = unit_quaternion(&row[3..7]) * Vector3::y();
    let (along, up) = (axis.x.hypot(axis.y).copysign(axis.x), axis.z);
    let (x, z) = (row[0], row[2]);
    let corner = |a: f64, b: f64| [x + a * along - b * up, z + a * up + b * along];
    let [_, long, high] = ROD_HALF;
    vec![
        Outline {
            label: "ledge".into(),
            corners: rectangle(
                [LEDGE[0], LEDGE[2] / 2.0],
                [ledge_width / 2.0, LEDGE[2] / 2.0],
            ),
        },
        Outline {
            label: "rod".into(),
            corners: vec![
                corner(-long, -high),
                corner(long, -high),
                corner(long, high),
                corner(-long, high),
            ],
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(z: f64, tilt_deg: f64) -> Vec<f64> {
        let half = tilt_deg.to_radians() / 2.0;
        vec![0.2, -0.5, z, half.cos(), half.sin(), 0.0, 0.0]
    }

    #[test]
    fn the_tilt_is_the_elevation_of_the_long_axis() {
        for tilt in [0.0, 3.0, 45.0, 90.0] {
            assert!((tilt_deg(&row(0.17, tilt)) - tilt).abs() < 1e-6);
        }
        // A rotation about the vertical does not tilt the rod.
        let half = 0.4_f64;
        assert!(tilt_deg(&[0.0, 0.0, 0.0, half.cos(), 0.0, 0.0, half.sin()]) < 1e-9);
    }

    #[test]
    fn a_level_rod_counts_on_the_ledge_only() {
        assert!(outcome(&row(0.17, 1.0)).success);
        assert!(!outcome(&row(0.02, 0.0)).success);
        assert!(!outcome(&row(0.17, 6.0)).success);
        assert!(!outcome(&[f64::NAN; 7]).success);
    }
}
