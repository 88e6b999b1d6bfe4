//! Comparisons of methods, independent of any engine: plan, storage and evaluation.
//!
//! The unit is the [cell](cell::Cell): one run of one method, in one world, under one condition of
//! one task, on one engine, with one seed. A [plan](plan::Plan) lists cells in a fixed order. A
//! [store](store::Store) keeps each as a separate file. A [schedule] distributes the missing ones
//! over threads. All output of a comparison depends only on the plan and the files of its cells,
//! and not on clocks, the order of completion, or the machine. An interrupted comparison, a
//! [shard]ed one and an undisturbed one therefore give the same bytes.
//!
//! [`rows`] are the statistics of its cells ([`asid_statistics`]), [`table`] formats them as
//! Markdown, and [`paper`] holds the published values for comparison.

pub mod cell;
mod contents;
pub mod document;
pub mod grid;
pub mod merge;
pub mod method;
mod number;
pub mod paper;
pub mod plan;
pub mod preset;
pub mod rows;
pub mod schedule;
pub mod settings;
pub mod shard;
pub mod slurm;
pub mod store;
pub mod table;
