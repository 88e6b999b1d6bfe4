//! The tasks of the ASID paper, one folder each: the code and its `scene.xml` side by side. When an attempt succeeds is
//! decided by `outcome` in the folder's `metric.rs`. [`sphere`] is no task but what the sphere tasks share.

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

use asid_core::Target;

/// Targets of parameters that are built in.
pub(crate) fn targets<const N: usize>(targets: [&str; N]) -> Vec<Target> {
    targets.iter().filter_map(|t| t.parse().ok()).collect()
}

/// Corners of an axis-aligned rectangle: its middle and half sizes, m.
pub(crate) fn rectangle([x, y]: [f64; 2], [a, b]: [f64; 2]) -> Vec<[f64; 2]> {
    vec![
        [x - a, y - b],
        [x + a, y - b],
        [x + a, y + b],
        [x - a, y + b],
    ]
}
