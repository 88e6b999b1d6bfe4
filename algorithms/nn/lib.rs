//! Neural networks of ASID, on libtorch.
//!
//! [`train`] is proximal policy optimisation over any [`asid_core::BatchEnvironment`]. It returns a
//! [`Policy`] of plain numbers, which acts without libtorch, can be shared between threads, and can
//! be saved. libtorch is used for training only. [`asid_learned`] plays and evaluates the trained
//! networks; it holds the explorers and the identifier whose trainers are here.
//!
//! Everything here is deterministic. Weights, action noise and the order of minibatches come from
//! the given seed and never from libtorch's global generator. Training on the CPU uses one thread.

mod actor_critic;
pub mod device;
mod ensemble;
mod estimator;
pub mod evaluation;
mod fisher_ppo;
pub mod gae;
#[cfg(test)]
mod learning_tests;
mod max;
mod maxmi;
pub mod motion_model;
mod orthogonal;
mod posterior_net;
pub mod ppo;
pub mod ppo_solver;
#[cfg(test)]
mod ppo_solver_tests;
mod predictor;
mod rollout;
pub mod surrogate;
mod task_ppo;
// Test problems, shared with the crate that plays.
#[cfg(test)]
#[path = "../learned/testing.rs"]
mod testing;
mod tracked;
mod training;

pub use asid_learned::{Normaliser, Policy, PpoConfig};
pub use evaluation::{Evaluation, evaluate};
pub use motion_model::{Motion, MotionModel};
pub use ppo::{PpoProgress, Trained, train};
pub use ppo_solver::PpoSolver;
