//! System identification of any machine that has a model, without a task and without code.
//!
//! A machine is its MJCF document, its unknowns are targets with ranges, and its experience is
//! logs. The crate does two things with them:
//!
//! - [`fit`] fits the unknowns to logs by least squares over open-loop replays, with the initial
//!   states of the episodes marginalised ([`dataset`], [`start`]). [`gap`] measures the gap on logs
//!   held out.
//! - [`design`] finds the motion that tells the most about the unknowns ([`tells`], [`expected`])
//!   and keeps all [`limits`]. A [`method`] searches it among [`candidates`]. It is a [`motion`] of
//!   a few numbers, simulated in batches by [`play`], and [`rehearse`]d in simulated true machines.

mod by_drive;
mod by_episodes;
pub mod candidates;
pub mod dataset;
pub mod design;
pub mod expected;
pub mod fit;
pub mod gap;
pub mod limits;
mod look;
mod marginal;
pub mod method;
pub mod motion;
mod open_drives;
mod places;
pub mod play;
pub mod rehearse;
mod search;
mod standstill;
pub mod start;
pub mod tells;
mod valleys;

use asid_core::error::{Error, Result};
use asid_core::{Parameter, Target};

/// Refuses parameters of two values: fits and derivatives are over ranges.
///
/// # Errors
/// When there is one; the message names it.
pub fn check_scales(parameters: &[Parameter]) -> Result<()> {
    match parameters.iter().find(|p| p.is_binary()) {
        None => Ok(()),
        Some(p) => Err(Error::Config {
            key: format!("parameter {}", p.name),
            message:
                "has two values, and only a range can be fitted or explored: give it a linear or \
                      log scale, or one of the values in the model"
                    .into(),
        }),
    }
}

/// Targets of all parameters, in the order of a batch's columns.
#[must_use]
pub fn targets(parameters: &[Parameter]) -> Vec<Target> {
    parameters.iter().flat_map(|p| p.targets.clone()).collect()
}

/// The columns of one simulation at parameter values in their units.
#[must_use]
pub fn columns(parameters: &[Parameter], values: &[f64]) -> Vec<f64> {
    let pairs = parameters.iter().zip(values);
    pairs
        .flat_map(|(p, &x)| std::iter::repeat_n(p.setting(x), p.targets.len()))
        .collect()
}
