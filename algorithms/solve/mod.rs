//! Solves a task for a belief over its unknowns.

pub mod attempts;
pub mod cem;

pub use attempts::{Attempts, Situations};
