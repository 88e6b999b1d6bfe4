//! Traits and data types of ASID.
//!
//! This crate knows no engine and no network.

pub mod environment;
pub mod error;

pub use environment::{BatchEnvironment, Transition};
pub use error::{Error, Result};
