//! A log's readings in a simulator, and how two readings differ.
//!
//! - [`replay`] plays a log's commands and says what the sensors would have read at each of its rows.
//! - [`SignalSet`] whitens the difference of two readings.

mod difference;
pub mod replay;

pub use difference::SignalSet;
