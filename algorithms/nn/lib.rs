//! Neural networks of ASID, on libtorch.
//!
//! [`train`] is proximal policy optimisation over any
//! [`asid_core::BatchEnvironment`]. What it returns, a [`Policy`], is plain
//! numbers: it acts without libtorch, can be shared between threads, and is
//! saved. libtorch is used for learning only; what is learned is played and
//! evaluated by [`asid_learned`], which holds the explorers and the identifier
//! whose trainers are here.
//!
//! Everything here is deterministic: the weights, the action noise and the
//! order of minibatches come from the seed that is given, never from libtorch's
//! global generator, and learning on the CPU uses one thread.

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
// The problems that the crate of what plays is tested on.
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
