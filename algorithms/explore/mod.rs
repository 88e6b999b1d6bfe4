//! Exploration: policies that make an episode as informative as possible about the unknowns.

pub mod discriminating;
pub mod environment;
pub mod fisher_cem;
pub mod observation;
pub mod open_loop;
pub mod random;
pub mod reused;

pub use discriminating::{Discriminating, Rival};
pub use environment::FisherEnvironment;
pub use observation::Observer;
