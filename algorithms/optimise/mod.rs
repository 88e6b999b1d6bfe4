//! Optimisers of a sampled cost: they draw candidates and are told what each cost.
//!
//! They know nothing of simulators, so a whole population is one batch call of
//! the caller's.

pub mod cem;
pub mod gaussian;
pub mod reps;

pub use cem::{Cem, CemSettings};
pub use gaussian::Gaussian;
pub use reps::{Reps, RepsSettings};
