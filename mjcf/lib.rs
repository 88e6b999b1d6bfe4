//! What an MJCF document says of a machine, for code that is no engine.
//!
//! [`asid_core::Scene`] is the document. Here it is read: the [layout](document) as MuJoCo orders it,
//! [masses](mass), the [`kinematics`] of a chain and its [Cartesian control](cartesian), and
//! the [`Plant`]: drives, joints, geoms and pairs that may touch, as effects and the diagnosis see them.
//!
//! The other way, [`native`] writes values and effects back into a document, by [`markup`] that leaves all else
//! as its author wrote it.

pub mod cartesian;
pub mod document;
pub mod kinematics;
pub mod markup;
pub mod mass;
pub mod native;
pub mod plant;

pub use plant::Plant;
