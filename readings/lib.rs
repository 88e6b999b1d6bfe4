//! A log's readings in a simulator, and how two readings differ.
//!
//! - [`replay`] plays a log's commands and says what the sensors would have read at each of its rows.
//! - [`first_row`] tells which readings of a log's first row a command before the log decides.
//! - [`SignalSet`] whitens the difference of two readings.
//! - [`noise`] tells the noise of a sensor from its readings.
//! - [`systematic`] whitens by the systematic errors of a tracker as well.

mod difference;
pub mod first_row;
pub mod noise;
pub mod replay;
pub mod systematic;

pub use difference::SignalSet;
pub use systematic::SystematicErrors;
