//! Kinds of real worlds: how a simulated real world differs from the method's simulator.
//!
//! Where a method is tried in the simulator that it identifies with, its model is right but for the
//! unknowns. Its errors there say nothing of a real world. So there are five kinds, and a result says
//! which one it is from:
//!
//! - [`WorldKind::Matched`]: the simulator itself, with a hidden truth.
//! - [`WorldKind::Crossed`]: the same scene in another engine.
//! - [`WorldKind::Perturbed`]: many small errors of the model at once, drawn by the world's seed.
//! - [`WorldKind::StandIn`]: the task's scene with another object.
//! - [`WorldKind::Custom`]: an engine, a model file or effects that a user named one by one.
//!
//! A perturbed world comes about in three modules: `ranges` says how far off it may be, `drawn` has the
//! values that its seed drew, and `applied` gives them to a scene.
//!
//! Each world has random streams of its own, which no part of a method can reach.

mod applied;
mod crossed;
mod drawn;
mod kind;
mod ranges;
mod simulated;

pub use applied::{Perturbed, perturb};
pub use crossed::other_engine;
pub use drawn::{Perturbation, TrackerPerturbation};
pub use kind::WorldKind;
pub use ranges::PerturbationRanges;
pub use simulated::{SimulatedWorld, TrackerErrors};
