//! The tasks of the ASID paper, one folder each, with the code next to its `scene.xml`.
//!
//! `outcome` in the folder's `metric.rs` decides whether an attempt succeeds. [`sphere`] is no
//! task; it holds the common code of the sphere tasks.

mod difficulty;
pub mod laptop_articulation;
pub mod panda;
pub mod rod_balancing;
pub mod shuffleboard;
pub mod sphere;
pub mod sphere_distractors;
pub mod sphere_free;
pub mod sphere_patches;
pub mod sphere_striking;
pub mod steering;

use asid_core::{Layout, Result, Target};

/// Targets of built-in parameters.
pub(crate) fn targets<const N: usize>(targets: [&str; N]) -> Vec<Target> {
    targets.iter().filter_map(|t| t.parse().ok()).collect()
}

/// Places a free body flat: `x` and `y` (m) and yaw (rad) from `start`, at a height (m).
pub(crate) fn lay(
    layout: &Layout,
    joint: &str,
    start: &[f64],
    height: f64,
    qpos: &mut [f64],
) -> Result<()> {
    let at = layout.joint(joint)?.qpos;
    let (sin, cos) = (start[2] / 2.0).sin_cos();
    qpos[at..at + 7].copy_from_slice(&[start[0], start[1], height, cos, 0.0, 0.0, sin]);
    Ok(())
}

/// Corners of a circle of this radius (m) as a polygon.
pub(crate) fn circle([x, y]: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    (0..24)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 24.0).sin_cos();
            [x + radius * cos, y + radius * sin]
        })
        .collect()
}

/// Corners of an axis-aligned rectangle from its centre and half sizes, m.
pub(crate) fn rectangle([x, y]: [f64; 2], [a, b]: [f64; 2]) -> Vec<[f64; 2]> {
    vec![
        [x - a, y - b],
        [x + a, y - b],
        [x + a, y + b],
        [x - a, y + b],
    ]
}
