//! Comparisons of methods, without an engine: what is run, where it is kept, what is said of it.
//!
//! The unit is the [cell](cell::Cell): one run of one method, in one world, under one condition of
//! one task, on one engine, with one seed. A [plan](plan::Plan) lists cells in a fixed order, a
//! [store](store::Store) keeps each as a file of its own, a [schedule] spreads those that are
//! missing over threads. Whatever is written about a comparison is made from the files of its cells
//! and from the plan, and from nothing else: no clock, no order of finishing, no machine. That is
//! why an interrupted comparison, a [shard]ed one and an undisturbed one give the same bytes.
//!
//! [`rows`] are the statistics of its cells ([`asid_statistics`]), [`table`] sets them as Markdown, and
//! [`paper`] holds the published values that stand beside them.

pub mod cell;
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
