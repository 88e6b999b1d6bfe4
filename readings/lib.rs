//! Readings of a log in a simulator, and the difference of two readings.
//!
//! - [`replay`] plays a log's commands and predicts the sensors' readings at each of its rows.
//! - [`first_row`] finds the readings of a log's first row that depend on a command before the log.
//! - [`SignalSet`] whitens the difference of two readings.
//! - [`noise`] estimates the noise of a sensor from its readings.
//! - [`systematic`] also whitens by the systematic errors of a tracker.

mod difference;
pub mod first_row;
pub mod noise;
pub mod replay;
pub mod systematic;

pub use difference::SignalSet;
pub use systematic::SystematicErrors;
