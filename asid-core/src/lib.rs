//! Traits and data types of ASID.
//!
//! This crate knows no engine and no network.

pub mod backend;
pub mod environment;
pub mod error;
pub mod kinematics;
pub mod layout;
pub mod mass;
pub mod parameter;
pub mod registry;
pub mod rng;
pub mod scene;
pub mod signal;
pub mod simulator;

pub use backend::{Backend, Capabilities, Model};
pub use environment::{BatchEnvironment, Transition};
pub use error::{Error, Result};
pub use layout::{Layout, Recording, Target};
pub use scene::Scene;
pub use simulator::{BatchConfig, Control, Rollout, Simulator, Snapshot, Status};
