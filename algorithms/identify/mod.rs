//! Identification: fits the simulator to real episodes and quantifies the uncertainty.
//!
//! A search (CEM, REPS or CMA-ES) locates the likelihood's maximum, with the start pose of each
//! episode co-estimated. Draws around its end, and a smooth model of their predictions, then give a
//! posterior. The interval comes from the likelihood and not from the spread of an elite, which
//! only measures how far a search has converged.

pub mod articulation;
pub mod beyond;
pub mod cem;
pub mod cma_es;
pub mod emulator;
pub mod evidence;
pub mod expected;
pub mod gauss_newton;
pub mod likelihood;
pub mod models;
pub mod reps;
pub mod sampling;
pub mod search;
pub mod walk;

pub use likelihood::Likelihood;
pub use sampling::{Samples, SamplingSettings};
