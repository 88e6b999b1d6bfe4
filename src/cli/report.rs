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

/// Results whose page is made with them and not again: a key, what has it, and the command that
/// writes it.
///
/// The first key that is there counts: scores and checks of engines have `rows` too.
const WRITTEN_ONCE: [(&str, &str, &str); 5] = [
    ("engines", "check of engines", "asid conformance"),
    ("clean_alarms", "score of answers", "asid withheld"),
    ("machine", "motion", "asid explore"),
    ("figure", "figure", "asid compare"),
    ("rows", "comparison", "asid compare"),
];

/// Rewrites `report.html`.
pub fn report(arguments: &Arguments) -> Result<()> {
    let folder = &arguments.dir;
    let value: serde_json::Value = read(folder, "result.json")?;
    let mut once = WRITTEN_ONCE.iter();
    if let Some((_, kind, command)) = once.find(|(key, ..)| value.get(key).is_some()) {
        return Err(Error::File {
            path: folder.clone(),
            message: format!(
                "is the folder of a {kind}, not of a run: its page is {}, which `{command}` writes with it",
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: the folder of `asid conformance` or `asid withheld` was called one of a comparison,
    /// and that of a motion lacked a `trace.json`. Cause: `rows` alone told a comparison.
    #[test]
    fn a_folder_whose_page_is_not_made_again_is_called_what_it_is() {
        for (result, command) in [
            (r#"{"rows": [], "engines": []}"#, "asid conformance"),
            (r#"{"rows": [], "clean_alarms": {}}"#, "asid withheld"),
            (r#"{"machine": "arm", "unknowns": []}"#, "asid explore"),
            (r#"{"figure": "patches"}"#, "asid compare"),
            (r#"{"rows": []}"#, "asid compare"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("result.json"), result).unwrap();
            let dir = folder.path().to_owned();
            let said = report(&Arguments { dir }).unwrap_err().to_string();
            assert!(
                said.contains(&format!("which `{command}` writes")),
                "{said}"
            );
        }
    }
}
