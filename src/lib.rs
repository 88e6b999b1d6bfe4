//! Active exploration for system identification, and diagnosis of the sim-to-real gap.
//!
//! This crate gathers the others for authors of plugins and holds the `asid` command line. A
//! program that links a plugin and calls [`cli::main`] has the whole of it.

pub use asid_algorithms as algorithms;
pub use asid_core as core;
pub use asid_diagnosis as diagnosis;
pub use asid_effects as effects;
pub use asid_learned as learned;
pub use asid_logs as logs;
pub use asid_mjcf as mjcf;
pub use asid_plugin as plugin;
pub use asid_readings as readings;
pub use asid_report as report;
pub use asid_results as results;
pub use asid_scorer as scorer;
pub use asid_sysid as sysid;
pub use asid_tasks as tasks;
pub use asid_worlds as worlds;

#[cfg(feature = "mujoco")]
pub use asid_mujoco as mujoco;
#[cfg(feature = "torch")]
pub use asid_nn as nn;
#[cfg(feature = "rapier")]
pub use asid_rapier as rapier;

pub mod cli;
pub mod pipeline;
