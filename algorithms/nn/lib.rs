//! Neural networks of ASID, on libtorch.
//!
//! [`train`] is proximal policy optimisation over any
//! [`asid_core::BatchEnvironment`]. What it returns, a [`Policy`], is plain
//! numbers: it acts without libtorch, can be shared between threads, and is
//! saved as JSON. libtorch is used for learning only.
//!
//! Everything here is deterministic: the weights, the action noise and the
//! order of minibatches come from the seed that is given, never from libtorch's
//! global generator, and learning on the CPU uses one thread.

mod actor_critic;
pub mod config;
pub mod evaluation;
pub mod fisher_ppo;
pub mod gae;
#[cfg(test)]
mod learning_tests;
pub mod normaliser;
mod orthogonal;
pub mod policy;
pub mod ppo;
pub mod ppo_solver;
#[cfg(test)]
mod ppo_solver_tests;
mod rollout;
pub mod surrogate;

pub use config::PpoConfig;
pub use evaluation::{Evaluation, evaluate};
pub use fisher_ppo::FisherPpo;
pub use normaliser::Normaliser;
pub use policy::Policy;
pub use ppo::{PpoProgress, Trained, train};
pub use ppo_solver::PpoSolver;
