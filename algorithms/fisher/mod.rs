//! Fisher information: how much an episode reveals about the unknowns.
//!
//! - [`FisherBatch`] plays episodes with their information, as [`FisherSettings`] say.
//! - [`Information`] sums it up and scores it.
//! - [`expected`] computes the standard deviation that an identification should reach, from fits of
//!   the readings over a region ([`local_fit`], [`precision`]).
//! - [`inert`] finds unknowns that change no reading.

mod batch;
mod eigen;
pub mod expected;
pub mod inert;
mod information;
pub mod local_fit;
pub mod precision;
mod sensitivity;
mod settings;

pub use batch::FisherBatch;
pub use eigen::symmetric_eigen;
pub use information::{Information, Objective, TRACE_CLIP, inverse_above_prior};
pub use settings::{FisherSettings, Form};
