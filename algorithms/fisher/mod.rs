//! Fisher information: how much an episode reveals about the unknowns.
//!
//! - [`FisherBatch`] plays episodes with their information, as [`FisherSettings`] say.
//! - [`Information`] sums it up and scores it.
//! - [`local_fit`] fits the readings over a region, [`roughness`] is what it leaves, and
//!   [`precision`] weighs the readings by noise and roughness.
//! - [`inert`] finds unknowns that change no reading.

mod batch;
mod eigen;
pub mod inert;
mod information;
pub mod local_fit;
pub mod precision;
pub mod roughness;
mod sensitivity;
mod settings;

pub use batch::FisherBatch;
pub use eigen::symmetric_eigen;
pub use information::{Information, Objective, TRACE_CLIP, inverse_above_prior};
pub use settings::{FisherSettings, Form};
