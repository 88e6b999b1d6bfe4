//! A log's readings in a simulator, and how two readings differ.
//!
//! - [`replay`] plays a log's commands and says what the sensors would have read at each of its rows.
//! - [`SignalSet`] whitens the difference of two readings.
//! - [`constant`] whitens by what is constantly wrong with a tracker as well.

pub mod constant;
mod difference;
pub mod replay;

pub use constant::ConstantErrors;
pub use difference::SignalSet;
