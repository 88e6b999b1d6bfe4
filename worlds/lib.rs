//! Kinds of real worlds: how a simulated real world differs from the method's simulator.
//!
//! If a method is tested in the simulator that it identifies with, its model is correct except for
//! the unknowns, so its errors there say nothing about a real world. There are therefore five
//! kinds, and a result states its kind:
//!
//! - [`WorldKind::Matched`]: the simulator itself, with a hidden truth.
//! - [`WorldKind::Crossed`]: the same scene in another engine.
//! - [`WorldKind::Perturbed`]: many small errors of the model at once, drawn by the world's seed.
//! - [`WorldKind::StandIn`]: the task's scene with another object.
//! - [`WorldKind::Custom`]: an engine, a model file or effects that a user named one by one.
//!
//! Three modules make a perturbed world: `ranges` defines how far off it may be, `drawn` holds the
//! values drawn by its seed, and `applied` applies them to a scene.
//!
//! [`ModelErrors`] uses the same perturbations for the method's simulator: an [`Ensemble`] of models
//! that differ in what their maker does not know.
//!
//! Each world has its own random streams, which no part of a method can reach.

mod applied;
mod crossed;
mod drawn;
mod ensemble;
mod kind;
mod model_errors;
mod ranges;
mod simulated;

pub use applied::{Perturbed, perturb};
pub use crossed::other_engine;
pub use drawn::{Perturbation, TrackerPerturbation};
pub use ensemble::Ensemble;
pub use kind::WorldKind;
pub use model_errors::{MODEL_ERRORS, ModelErrors};
pub use ranges::PerturbationRanges;
pub use simulated::{SimulatedWorld, TrackerErrors};
