//! `asid report`: the HTML report of a finished run, from its files.

use std::path::PathBuf;

use anyhow::Result;
use asid_core::Error;
use asid_report::run::RunReport;

/// Arguments of `report`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder of a run
    dir: PathBuf,
}

/// Writes `report.html` anew.
pub fn report(arguments: &Arguments) -> Result<()> {
    let path = arguments.dir.join("trace.json");
    let fail = |message: String| Error::File {
        path: path.clone(),
        message,
    };
    let text = std::fs::read_to_string(&path)
        .map_err(|e| fail(format!("{e}; is this the folder of a finished run?")))?;
    let value: serde_json::Value = serde_json::from_str(&text).map_err(|e| fail(e.to_string()))?;
    let page = if value.get("study").is_some() {
        let diagnosis = serde_json::from_value(value).map_err(|e| fail(e.to_string()))?;
        asid_report::diagnosis::page(&diagnosis)
    } else {
        let report: RunReport = serde_json::from_value(value).map_err(|e| fail(e.to_string()))?;
        report.html()
    };
    let html = arguments.dir.join("report.html");
    let staging = arguments.dir.join(".report.html");
    super::output::write_text(&staging, &page)?;
    std::fs::rename(&staging, &html).map_err(|e| Error::File {
        path: html,
        message: e.to_string(),
    })?;
    Ok(())
}
