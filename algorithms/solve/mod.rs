//! Solving a task for a belief over its unknowns.

pub mod cem;
