//! Trained networks: their files, and the code that plays and evaluates them.
//!
//! Training needs libtorch; playing and evaluating do not. So the learned explorers and the learned
//! identifier are registered here, with their settings, and compute with plain numbers. The crate
//! `asid-nn`, where it is linked, adds a [`Trainer`] for each. A network comes from a file that the
//! user names, else from those that ship with the program, else from a training on the spot.

mod belief;
mod collect;
pub mod episodes;
pub mod estimator;
pub mod file;
pub mod fisher_ppo;
pub mod history;
pub mod inference;
pub mod learning;
pub mod max;
pub mod maxmi;
pub mod network;
pub mod normaliser;
pub mod play;
pub mod policy;
pub mod ppo_settings;
pub mod shipped;
pub mod task_ppo;
pub mod tensorboard;
#[cfg(test)]
mod testing;

use std::sync::OnceLock;

pub use belief::Belief;
pub use collect::Dataset;
pub use episodes::EpisodeBatch;
pub use estimator::{Estimator, EstimatorTrainer};
pub use file::{Description, Saved, Tensor, Tensors};
pub use fisher_ppo::FisherPpo;
pub use history::History;
pub use inference::Inference;
pub use learning::{LearnedExplorer, Trainer, Training};
pub use max::Max;
pub use maxmi::MaxMi;
pub use network::{Layer, Network};
pub use normaliser::Normaliser;
pub use policy::Policy;
pub use ppo_settings::PpoConfig;
pub use task_ppo::TaskPpo;

static COMMIT: OnceLock<&'static str> = OnceLock::new();

/// Sets the commit of this program, which files record; only the first call has an effect.
pub fn set_commit(commit: &'static str) {
    let _ = COMMIT.set(commit);
}

/// Commit of this program; empty if it was not set.
#[must_use]
pub fn commit() -> &'static str {
    COMMIT.get().copied().unwrap_or_default()
}
