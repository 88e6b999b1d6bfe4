//! Reads logs as episodes: this program's own tables, and recordings of other stacks.
//!
//! - [`episode`] reads a table whose columns are named after the model, and checks it.
//! - Recordings of ROS 2 (MCAP, or bags of SQLite), of LeRobot, and CSV with any names have names,
//!   units and rates of their own. Each is read as [series] of numbers with the stamps of its own
//!   stream; a name is the path to the number. The `[[column]]` of a study state which quantity of
//!   the model each series is. [`propose`] suggests them by names, units, ranges and fit. Streams
//!   are [aligned](align), and [`episode::of_table`] checks the resulting table.
//!
//! Readers trust no input: a damaged or cut file gives one line of error, whatever its bytes.
//! Formats that need more than the default build has (SQLite, compression) are behind the features
//! `ros` and `parquet`.

pub mod align;
#[cfg(feature = "ros")]
pub mod bag;
pub mod counted;
mod csv_file;
pub mod episode;
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
mod text_table;

pub use format::{LogFormat, LogSettings};
pub use open::Opener;
pub use raw::{Numberless, RawLog};
pub use series::Series;
