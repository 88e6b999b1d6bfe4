//! The readers of files that only the command line reads, for tests with damaged files.

use std::path::Path;

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{TaskEntry, find};
use asid_report::run::RunReport;

use super::options::{Algorithms, Common, Worlds};
use super::settings::{Config, Stage, difficulty};

/// Task whose settings are read; all tasks have the same sections.
const TASK: &str = "rod-balancing";

/// Resolves the settings in a `config.toml` of a run.
///
/// # Errors
/// Those reported to the user.
pub fn config(path: &Path) -> Result<()> {
    let task = (find::<TaskEntry>(TASK)?.make)()?;
    let common = Common {
        config: Some(path.to_owned()),
        ..Common::default()
    };
    let levels = difficulty::levels(&*task, &common)?;
    let task = difficulty::at(task, &levels)?;
    let (algorithms, worlds) = (Algorithms::default(), Worlds::default());
    Config::resolve(Stage::Run, &*task, &common, &algorithms, &worlds)?;
    Ok(())
}

/// Reads a `posterior.json`, as `asid solve` does.
///
/// # Errors
/// Those reported to the user.
pub fn posterior(path: &Path) -> Result<()> {
    super::solve::read_posterior(path)?;
    Ok(())
}

/// Reads a `trace.json` of a run and draws its report, as `asid report` does.
///
/// # Errors
/// Those reported to the user.
pub fn trace(path: &Path) -> Result<()> {
    let fail = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
    let report: RunReport = serde_json::from_str(&text).map_err(|e| fail(e.to_string()))?;
    let _ = report.html();
    Ok(())
}
