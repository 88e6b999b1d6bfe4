//! Kinds of real worlds: how a simulated real world differs from the method's simulator.
//!
//! A method that is tried in the simulator it identifies with has an easy life: its model is right but
//! for the unknowns. Of such a world nothing can be said for a real one. So there are four kinds, and a
//! result says which one it is from:
//!
//! - [`Kind::Matched`]: the simulator itself, with a hidden truth.
//! - [`Kind::Crossed`]: the same scene in another engine.
//! - [`Kind::Perturbed`]: many small errors of the model at once, drawn by the world's seed.
//! - [`Kind::StandIn`]: the task's scene with another object.
//!
//! Each world draws its own chance, from streams that no part of a method can reach.

mod crossed;
mod kind;
mod perturbation;
mod perturbed;
mod ranges;
mod simulated;

pub use crossed::other_engine;
pub use kind::Kind;
pub use perturbation::{Perturbation, TrackerPerturbation};
pub use perturbed::{Perturbed, perturb};
pub use ranges::PerturbationRanges;
pub use simulated::{SimulatedWorld, TrackerErrors};
