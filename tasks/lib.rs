//! The tasks of the ASID paper, one folder each: the code and its `scene.xml` side by side.

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
