//! The folder of a comparison: claimed before the work, summarised after it.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_comparison::cell::{Cell, CellKey, Failure};
use asid_comparison::document::Document;
use asid_comparison::rows::{ComparisonResult, summarise};
use asid_comparison::store::{CellTime, Store, write};
use asid_comparison::table;
use asid_core::Error;
use serde::Serialize;

use super::page;
use crate::cli::output::OutFolder;

/// The command that repeats a comparison, whatever command line made it.
const REPEAT: &str = "asid compare --config config.toml";

/// The comparison's folder: the named one, which is new or already begun, or the next free one.
///
/// # Errors
/// When it holds something else or cannot be written.
pub fn claim(out: Option<&Path>) -> Result<Store> {
    if let Some(path) = out {
        let store = Store::new(path);
        if store.is_begun() {
            Document::read(&store.config()).map_err(|e| {
                wrong(
                    path,
                    format!("holds something else; choose another --out ({e})"),
                )
            })?;
            return Ok(store);
        }
        if only_hidden(path) {
            return Ok(store);
        }
        OutFolder::claim(Some(path), "compare")?;
        return Ok(store);
    }
    loop {
        let path = OutFolder::claim(None, "compare")?.path();
        let made = std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))
            .and_then(|()| std::fs::create_dir(&path));
        match made {
            Ok(()) => return Ok(Store::new(&path)),
            // Another process was faster; try the next free one.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(wrong(&path, format!("cannot be made: {e}"))),
        }
    }
}

fn wrong(path: &Path, message: String) -> anyhow::Error {
    Error::File {
        path: path.to_owned(),
        message,
    }
    .into()
}

/// Whether another process has just begun to write a comparison into the folder.
fn only_hidden(path: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(path) else {
        return false;
    };
    let mut names = entries.filter_map(|e| Some(e.ok()?.file_name())).peekable();
    names.peek().is_some() && names.all(|n| n.to_string_lossy().starts_with(".config.toml."))
}

/// The existing results of a plan.
pub struct Contents {
    /// Cells, in the plan's order.
    pub cells: Vec<Cell>,
    /// Why other cells are absent, in the plan's order.
    pub failures: Vec<Failure>,
    /// Places in the plan of cells without result or failure; those of an arm that cannot be run do
    /// not count.
    pub missing: Vec<usize>,
}

impl Contents {
    /// Whether a failure applies to every cell of its arm.
    fn rules_out(&self, failure: &Failure) -> bool {
        failure.of_all && !self.cells.iter().any(|c| c.key.arm_mate(&failure.key))
    }

    /// Failures of single runs.
    pub fn single_failures(&self) -> impl Iterator<Item = &Failure> {
        self.failures.iter().filter(|f| !self.rules_out(f))
    }
}

/// Reads the existing results of a plan.
///
/// # Errors
/// When a file cannot be read.
pub fn contents(store: &Store, keys: &[CellKey]) -> Result<Contents> {
    let (mut cells, mut failures): (Vec<Cell>, Vec<Failure>) = (Vec::new(), Vec::new());
    let mut open = Vec::new();
    for (place, key) in keys.iter().enumerate() {
        match (store.cell(key)?, store.failure(key)?) {
            (Some(cell), _) => cells.push(cell),
            (None, Some(failure)) => failures.push(failure),
            (None, None) => open.push((place, key)),
        }
    }
    let mut there = Contents {
        cells,
        failures,
        missing: Vec::new(),
    };
    // If an arm cannot be run, the failure of one cell stands for all.
    let ruled_out = |key: &CellKey| {
        let mut failures = there.failures.iter();
        failures.any(|f| f.key.arm_mate(key) && there.rules_out(f))
    };
    open.retain(|(_, key)| !ruled_out(key));
    there.missing = open.into_iter().map(|(place, _)| place).collect();
    Ok(there)
}

/// Computing times, kept apart from the results, which are the same for every run of a comparison.
#[derive(Serialize)]
struct Times {
    /// Sum over the cells, s.
    cells_s: f64,
    /// Sum over what was trained, s.
    training_s: f64,
    training: Vec<TrainingTime>,
    cells: Vec<CellTime>,
}

/// Seconds that a training took.
#[derive(Serialize)]
struct TrainingTime {
    policy: String,
    wall_s: f64,
}

/// A comparison, summarised in its folder.
pub struct SummedUp {
    /// The rows.
    pub result: ComparisonResult,
    markdown: String,
    report: PathBuf,
}

impl SummedUp {
    /// Prints the tables, or the result as JSON.
    ///
    /// # Errors
    /// When standard output is closed.
    pub fn print(&self, json: bool) -> Result<()> {
        let mut stdout = std::io::stdout().lock();
        if json {
            writeln!(stdout, "{}", serde_json::to_string_pretty(&self.result)?)?;
        } else {
            let (markdown, report) = (&self.markdown, self.report.display());
            writeln!(stdout, "{markdown}\nreport: {report}")?;
        }
        Ok(())
    }
}

/// Summarises the existing results and writes the tables.
///
/// # Errors
/// When a file cannot be written, or there are no results.
pub fn sum_up(store: &Store, document: &Document, contents: &Contents) -> Result<SummedUp> {
    let plan = &document.plan;
    let settings = |hash: &str| store.settings(hash);
    let result = summarise(plan, &contents.cells, &contents.failures, &settings);
    let markdown = table::markdown(plan, &result);
    let file = |name: &str| store.root().join(name);
    write(&file("runs.json"), &json(&contents.cells)?)?;
    write(&file("table.md"), &format!("{markdown}\n`{REPEAT}`\n"))?;
    write(&file("times.json"), &json(&times(store, &contents.cells)?)?)?;
    let html = page::html(plan, &result, &contents.cells, REPEAT);
    write(&file("report.html"), &html)?;
    // Write the result last: its presence means that all the rest is there.
    write(&file("result.json"), &json(&result)?)?;
    Ok(SummedUp {
        result,
        markdown,
        report: file("report.html"),
    })
}

fn times(store: &Store, cells: &[Cell]) -> Result<Times> {
    let of = cells.iter().map(|c| store.time(&c.key));
    let cells: Vec<CellTime> = of
        .collect::<asid_core::Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let mut training: Vec<TrainingTime> = Vec::new();
    let folders = std::fs::read_dir(store.policies()).into_iter().flatten();
    let mut folders: Vec<PathBuf> = folders.filter_map(|e| Some(e.ok()?.path())).collect();
    folders.sort();
    for folder in folders {
        let text = std::fs::read_to_string(folder.join(TRAINED)).ok();
        if let Some(wall_s) = text.and_then(|t| t.trim().parse().ok()) {
            let policy = folder.file_name().unwrap_or_default().to_string_lossy();
            training.push(TrainingTime {
                policy: policy.into_owned(),
                wall_s,
            });
        }
    }
    Ok(Times {
        cells_s: cells.iter().fold(0.0, |sum, t| sum + t.wall_s),
        training_s: training.iter().fold(0.0, |sum, t| sum + t.wall_s),
        training,
        cells,
    })
}

/// Name of the file, in the folder of a training, that holds its seconds.
pub const TRAINED: &str = "seconds";

fn json(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}
