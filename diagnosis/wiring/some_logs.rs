//! Faults of some logs of a study alone, by the names of columns and logs.

use asid_core::Result;

use crate::machine::Machine;
use crate::study::Study;

use super::evidence::Settings;
use super::hypotheses::Quantity;
use super::record::Recorded;
use super::search::{Apart, Search};
use super::view::View;
use super::windows::{FEW, WINDOWS, Windows};

/// Fault of some logs alone.
#[derive(Clone, Debug)]
pub struct OfSomeLogs {
    /// Name of the fault.
    pub fault: &'static str,
    /// Columns.
    pub columns: Vec<String>,
    /// Names of the logs.
    pub logs: Vec<String>,
    /// Probability.
    pub probability: f64,
}

/// Searches the training and the held-out logs, read by a view, for a fault that some of them have
/// alone.
///
/// # Errors
/// When the engine fails.
pub(super) fn of_some_logs(
    study: &Study,
    machine: &Machine,
    (sensors, quantities): (&[String], &[Quantity]),
    (view, settings): (&View, &Settings),
) -> Result<Option<OfSomeLogs>> {
    let logs: Vec<_> = study.train.iter().chain(&study.test).collect();
    let record = logs
        .iter()
        .map(|(_, e)| Recorded::of(&machine.plant.layout, sensors, e))
        .collect::<Result<Vec<_>>>()?;
    let windows = |count| Windows::new(machine, &record, (sensors, &study.parameters), count);
    let (Some(few), Some(all)) = (windows(FEW)?, windows(WINDOWS)?) else {
        return Ok(None);
    };
    let mut search = Search {
        few,
        all,
        damped: None,
        record: &record,
        quantities,
        settings,
    };
    let of_names = |apart: Apart| OfSomeLogs {
        fault: apart.fault.name(),
        columns: apart
            .quantities
            .iter()
            .map(|&q| quantities[q].name.clone())
            .collect(),
        logs: apart.logs.iter().map(|&log| logs[log].0.clone()).collect(),
        probability: apart.probability,
    };
    Ok(search.apart(view)?.map(of_names))
}
