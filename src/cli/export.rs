//! `asid export`: a task's scene, or a refined model of any machine, as one MJCF document.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{TaskEntry, find};

use super::machine;
use super::options::Common;
use super::output::create_text;
use super::settings::difficulty;

/// Arguments of `export`.
#[derive(clap::Args)]
#[command(after_help = "\
A study, or a refined model as `asid diagnose` and `asid identify` write it, becomes a plain MJCF document: values \
are written, effects become MJCF's own elements, and one sentence tells of each that has none. Mesh files stay \
where they are; the document refers to their paths. The logs of a study are \
replayed in the model that it has and in the exported document, and the gap of each is printed.")]
pub struct Arguments {
    /// The task, or a study (a folder or TOML file), a refined model (TOML) or an MJCF file
    task: String,
    /// Write this file; it must not exist
    #[arg(long, visible_alias = "mjcf", value_name = "FILE.xml")]
    out: PathBuf,
    /// Check the exported model with this engine (of a study or model only; see `asid list`)
    #[arg(long, value_name = "NAME")]
    backend: Option<String>,
    /// Print a summary of the export as JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
    /// Set the difficulty of a task: default, or published (values of the paper or its code)
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Set one difficulty of a task, such as difficulty.ledge_width=0.02 (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Writes the scene.
pub fn export(arguments: &Arguments) -> Result<()> {
    if let Some(path) = machine::path_of(&arguments.task)? {
        if arguments.preset.is_some() || !arguments.set.is_empty() {
            return Err(Error::Config {
                key: "--preset, --set".into(),
                message: format!("are of tasks, and `{}` is none", arguments.task),
            }
            .into());
        }
        return machine::export::export(&machine::export::Request {
            path,
            out: &arguments.out,
            backend: arguments.backend.as_deref(),
            json: arguments.json,
        });
    }
    let task = (find::<TaskEntry>(&arguments.task)?.make)()?;
    let common = Common {
        preset: arguments.preset.clone(),
        set: arguments.set.clone(),
        ..Common::default()
    };
    let levels = difficulty::levels(&*task, &common)?;
    let task = difficulty::at(task, &levels)?;
    create(&arguments.out, task.scene().xml())?;
    if arguments.json {
        let summary = serde_json::json!({
            "schema": super::result::SCHEMA,
            "task": arguments.task,
            "file": arguments.out,
        });
        writeln!(std::io::stdout(), "{summary:#}")?;
    }
    Ok(())
}

/// Writes a file that must not exist yet.
pub fn create(path: &Path, text: &str) -> Result<()> {
    let failed = |e: std::io::Error| Error::File {
        path: path.to_owned(),
        message: match e.kind() {
            std::io::ErrorKind::AlreadyExists => "exists already; choose another name".into(),
            _ => format!("cannot be written: {e}"),
        },
    };
    create_text(path, text).map_err(failed)?;
    Ok(())
}
