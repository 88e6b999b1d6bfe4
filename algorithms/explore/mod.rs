//! Exploration: policies that make an episode tell the most about the unknowns.

pub mod environment;
pub mod fisher_cem;
pub mod observation;
pub mod random;

pub use environment::FisherEnvironment;
pub use observation::Observer;
