//! `asid report`: the HTML report of a finished run, from its files.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use asid_report::diagnosis;
use asid_report::run::RunReport;
use serde::de::DeserializeOwned;

use super::output::{replace_file, write_text};

/// Arguments of `report`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The folder of a run or of a diagnosis
    dir: PathBuf,
}

/// Reads a file of a result's folder.
fn read<T: DeserializeOwned>(folder: &Path, name: &str) -> Result<T> {
    let path = folder.join(name);
    let read = std::fs::read_to_string(&path);
    let text = read.map_err(|e| format!("{e}; is this the folder of a finished run?"));
    let value = text.and_then(|t| serde_json::from_str(&t).map_err(|e| e.to_string()));
    Ok(value.map_err(|message| Error::File { path, message })?)
}

/// The kind of a result whose page only `asid compare` writes, from its runs; `None` for others.
fn drawn_by_compare(result: &serde_json::Value) -> Option<&'static str> {
    let kinds = [("rows", "comparison"), ("figure", "figure")];
    let kind = kinds.iter().find(|(key, _)| result.get(key).is_some());
    kind.map(|(_, kind)| *kind)
}

/// Rewrites `report.html`.
pub fn report(arguments: &Arguments) -> Result<()> {
    let folder = &arguments.dir;
    let value: serde_json::Value = read(folder, "result.json")?;
    if let Some(kind) = drawn_by_compare(&value) {
        return Err(Error::File {
            path: folder.clone(),
            message: format!(
                "is the folder of a {kind}, not of a run: its page is {}, which `asid compare` writes with it",
                folder.join("report.html").display()
            ),
        }
        .into());
    }
    let page = if value.get("verdict").is_some() {
        diagnosis::page(&read(folder, "result.json")?, &read(folder, "trace.json")?)
    } else {
        read::<RunReport>(folder, "trace.json")?.html()
    };
    replace_file(&folder.join("report.html"), |file| write_text(file, &page))
}
