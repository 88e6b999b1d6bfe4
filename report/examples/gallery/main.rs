//! Writes reports of invented but realistic data, to inspect the layout.
//!
//! `cargo run -p asid-report --example gallery -- FOLDER` writes runs (`full`, `bare` and
//! `crowded`, each with `trace.json`) and diagnoses (`patch`, `force`, `complete`, `unexplained`
//! and `empty`) below it, each with `report.html`.

mod diagnosed;
mod synthetic;

use std::path::{Path, PathBuf};

use asid_core::error::{Error, Result};
use asid_report::diagnosis::page;
use diagnosed::Diagnosis;

fn main() -> Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "gallery".into()));
    let runs = [
        ("full", synthetic::full_run()),
        ("bare", synthetic::bare_run()),
        ("crowded", synthetic::crowded_run()),
    ];
    for (name, run) in runs {
        run.write(&made(&folder, name)?)?;
    }
    let diagnoses = [
        ("patch", diagnosed::patch()),
        ("force", diagnosed::by_force()),
        ("complete", diagnosed::complete()),
        ("unexplained", diagnosed::crowded()),
        ("empty", Diagnosis::default()),
    ];
    for (name, diagnosis) in diagnoses {
        let path = made(&folder, name)?.join("report.html");
        std::fs::write(&path, page(&diagnosis.result, &diagnosis.trace)).map_err(|e| {
            Error::File {
                path,
                message: e.to_string(),
            }
        })?;
    }
    Ok(())
}

/// The folder of a report, created if missing.
fn made(folder: &Path, name: &str) -> Result<PathBuf> {
    let path = folder.join(name);
    std::fs::create_dir_all(&path).map_err(|e| Error::File {
        path: path.clone(),
        message: e.to_string(),
    })?;
    Ok(path)
}
