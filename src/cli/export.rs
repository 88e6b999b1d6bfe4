//! `asid export`: a task's scene as one MJCF document.

use std::path::PathBuf;

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{TaskEntry, find};

use super::config::difficulty;
use super::options::Common;

/// Arguments of `export`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The task
    task: String,
    /// Write this file; it must not exist
    #[arg(long, value_name = "FILE.xml")]
    out: PathBuf,
    /// Make the task as hard as this preset: default, or published; see its page
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Set a difficulty, such as difficulty.ledge_width=0.02 (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Writes the scene.
pub fn export(arguments: &Arguments) -> Result<()> {
    use std::io::Write as _;
    let task = (find::<TaskEntry>(&arguments.task)?.make)()?;
    let common = Common {
        preset: arguments.preset.clone(),
        set: arguments.set.clone(),
        ..Common::default()
    };
    let levels = difficulty::levels(&*task, &common)?;
    let task = difficulty::at(task, &levels)?;
    let failed = |e: std::io::Error| Error::File {
        path: arguments.out.clone(),
        message: match e.kind() {
            std::io::ErrorKind::AlreadyExists => "exists already; choose another name".into(),
            _ => format!("cannot be written: {e}"),
        },
    };
    let mut file = std::fs::File::create_new(&arguments.out).map_err(failed)?;
    file.write_all(task.scene().xml().as_bytes())
        .map_err(failed)?;
    Ok(())
}
