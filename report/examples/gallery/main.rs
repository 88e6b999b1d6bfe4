//! Writes run reports of made-up but realistic data, to look at the layout.
//!
//! `cargo run -p asid-report --example gallery -- FOLDER` writes `full`,
//! `bare` and `crowded` below it, each with `trace.json` and `report.html`.

mod synthetic;

use std::path::PathBuf;

use asid_core::error::{Error, Result};

fn main() -> Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "gallery".into()));
    let runs = [
        ("full", synthetic::full_run()),
        ("bare", synthetic::bare_run()),
        ("crowded", synthetic::crowded_run()),
    ];
    for (name, run) in runs {
        let path = folder.join(name);
        std::fs::create_dir_all(&path).map_err(|e| Error::File {
            path: path.clone(),
            message: e.to_string(),
        })?;
        run.write(&path)?;
    }
    Ok(())
}
