//! Makes the 3-D view of a report: shapes of a scene, and the motions of its machines as poses over
//! time.
//!
//! Everything here is read from the scene's document and from positions (`qpos`) that an engine
//! recorded or a log holds. No engine takes part, so that a picture is the same whatever simulated
//! it.
//!
//! A [`Stage`] is the scene: its geoms in the frames of rigid parts, and its meshes with few enough
//! triangles ([`mesh`]). [`Stage::take`] adds an episode: a [`Motion`] for each visible machine,
//! thinned to [`motion::RATE`] frames a second, with the points where bodies touch ([`contact`])
//! and the forces that the model lacks ([`force`]). [`logged::positions`] reads `qpos` from a log.
//!
//! The types are those of [`asid_results::view`]; `asid-report` shows them.

pub mod contact;
pub mod force;
pub mod logged;
pub mod mesh;
pub mod motion;
mod pack;
mod simplify;
mod stage;
mod surface;

pub use motion::Motion;
pub use stage::Stage;
