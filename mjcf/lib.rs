//! What an MJCF document says of a machine, independent of any engine.
//!
//! [`asid_core::Scene`] is the document. This crate reads it: the [layout](document) as MuJoCo
//! orders it, [masses](mass), the [`kinematics`] of a chain and its [Cartesian control](cartesian),
//! and the [`Plant`]. The plant has the drives, joints, geoms and pairs that may touch, as effects
//! and the diagnosis need them.
//!
//! In the other direction, [`native`] writes values and effects back into a document, by [`markup`]
//! that preserves all other text.

pub mod cartesian;
mod classes;
pub mod document;
pub mod kinematics;
pub mod markup;
pub mod mass;
pub mod memory;
pub mod native;
pub mod plant;

pub use plant::Plant;
