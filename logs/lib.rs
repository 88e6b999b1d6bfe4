//! Logs as episodes: tables of this program's own, and recordings of other stacks.
//!
//! - [`episode`] reads a table whose columns are named after the model, and checks it.
//! - Recordings of ROS 2 (MCAP, or bags of SQLite), of LeRobot, and CSV of any names have names, units and rates of their own.
//!   Each is read as [series] of numbers, with the stamps of its own stream and named by the way to the number. The
//!   `[[column]]` of a study say what each series is on a model's machine; [`propose`] suggests them by names, units, ranges
//!   and fit. Streams are [aligned](align), and [`episode::of_table`] checks the table that comes of it.
//!
//! Readers believe nothing: a damaged or cut file is one line of error, whatever its bytes. The formats that need more
//! than the default build has (SQLite, compression) are behind the features `ros` and `parquet`.

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
