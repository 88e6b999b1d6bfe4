//! Traits and data types of ASID. This crate knows no engine and no network.
//!
//! - What is simulated: a [`Scene`] (one MJCF document), compiled by a [`Backend`] into a
//!   [`Model`], from which batches are made: [`Simulator`]. Everything is a whole-batch call on
//!   row-major arrays, which is fast, independent of the number of threads, and expressible as a C
//!   table.
//! - What is done: a [`Task`] with [`Parameter`]s; an [`Explorer`] makes a [`Policy`], a
//!   [`RealWorld`] plays it, an [`Identifier`] fits a [`Posterior`] to the [`Episode`], a
//!   [`TaskSolver`] makes a [`TaskPolicy`].
//! - What a tracker measures: [`signal`].
//! - How parts are found: [`registry`].

pub mod backend;
pub mod difficulty;
pub mod environment;
pub mod episode;
pub mod error;
pub mod explore;
pub mod identify;
pub mod layout;
pub mod parameter;
pub mod posterior;
pub mod problem;
pub mod progress;
pub mod real_world;
pub mod registry;
pub mod rng;
pub mod scene;
pub mod settings;
pub mod signal;
pub mod simulator;
pub mod solve;
pub mod target;
pub mod task;
pub mod tracker;

// Crates whose types occur in public items, so that an author need not match versions.
pub use mjcf_rs;
pub use nalgebra;

pub use backend::{Backend, Capabilities, Model};
pub use difficulty::{Difficulty, Levels};
pub use environment::{BatchEnvironment, Transition};
pub use episode::Episode;
pub use error::{Error, Result};
pub use explore::{Explorer, Policy};
pub use identify::Identifier;
pub use layout::{Layout, Recording};
pub use parameter::Parameter;
pub use posterior::Posterior;
pub use problem::Problem;
pub use progress::Progress;
pub use real_world::RealWorld;
pub use rng::Streams;
pub use scene::Scene;
pub use simulator::{BatchConfig, Control, Rollout, Simulator, Snapshot, Status};
pub use solve::{TaskPolicy, TaskSolver};
pub use target::Target;
pub use task::{Task, TaskSpec};

#[doc(hidden)]
pub use inventory as __inventory;
