//! Identification: fit the simulator to real episodes and say how sure that is.
//!
//! A search (CEM, REPS or CMA-ES) finds where the likelihood is, with the start pose of
//! each episode co-estimated; then draws around its end, and a smooth model of what
//! they predict, give a posterior. The interval comes from the likelihood, never from
//! the spread of an elite, which measures only how far a search has converged.

pub mod articulation;
pub mod beyond;
pub mod cem;
pub mod cma_es;
pub mod emulator;

pub mod gauss_newton;
pub mod likelihood;
pub mod models;
pub mod reps;
pub mod sampling;
pub mod search;
pub mod walk;

pub use likelihood::Likelihood;
pub use sampling::{Samples, SamplingSettings};
