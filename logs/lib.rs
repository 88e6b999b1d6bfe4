//! Logs of other stacks as episodes of this one.
//!
//! Robots are logged by ROS 2 (MCAP, or bags of SQLite), LeRobot, and scripts that write CSV. Their names, units and rates are
//! their own. A log is read here as [series] of numbers, each with the stamps of its own stream and named by the way to the
//! number. What each series is on a model's machine is said by the `[[column]]` of a study, and
//! [proposed](propose) by names, units, ranges and fit. The tables that come of it, with streams [aligned](align), are read by [`asid_core::log::of_table`].
//!
//! Readers believe nothing: a damaged or cut file is one line of error, whatever its bytes. The formats that need more
//! than the default build has (SQLite, compression) are behind the features `ros` and `parquet`.

pub mod align;
#[cfg(feature = "ros")]
pub mod bag;
mod csv_file;
pub mod format;
#[cfg(feature = "parquet")]
pub mod lerobot;
#[cfg(feature = "ros")]
pub mod mcap_file;
#[cfg(feature = "ros")]
pub mod mcap_out;
pub mod open;
#[cfg(feature = "parquet")]
mod parquet_file;
pub mod propose;
pub mod raw;
#[cfg(feature = "ros")]
pub mod ros;
pub mod series;
mod table_file;

pub use format::{LogFormat, LogSettings};
pub use open::Opener;
pub use raw::RawLog;
pub use series::Series;
