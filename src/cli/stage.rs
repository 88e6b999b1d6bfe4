//! What the stages `explore`, `identify` and `solve` share.
//!
//! They are the parts of the pipeline, with a real machine in between. `explore` gives commands to
//! play, `identify` takes the resulting log, `solve` gives the commands of the task.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use asid_core::task::Coordinate;
use asid_report::run::RunReport;
use serde::Serialize;

use super::options::Common;
use super::output::{OutFolder, write_json, write_text};
use super::session::Session;
use super::{failure, run, trace};

/// A number with its name and unit.
#[derive(Serialize)]
pub struct Named {
    pub name: String,
    pub value: f64,
    pub unit: String,
}

/// Values with the names and units of their coordinates.
pub fn named(coordinates: &[Coordinate], values: &[f64]) -> Vec<Named> {
    coordinates
        .iter()
        .zip(values)
        .map(|(c, &value)| Named {
            name: c.name.clone(),
            value,
            unit: c.unit.clone(),
        })
        .collect()
}

/// Values by the names of their coordinates.
pub fn pose(coordinates: &[Coordinate], values: &[f64]) -> BTreeMap<String, f64> {
    coordinates
        .iter()
        .map(|c| c.name.clone())
        .zip(values.iter().copied())
        .collect()
}

/// `x 0.5500 m, y 0.0000 m (middle of its range)`.
pub fn start_line(session: &Session) -> String {
    let config = &session.config;
    let coordinates = config.command.start(&*session.task);
    let entries: Vec<String> = coordinates
        .iter()
        .zip(session.start())
        .map(|(c, value)| {
            let assumed = config.assumed.contains(&c.name);
            format!(
                "{} {value:.4} {}{}",
                c.name,
                c.unit,
                if assumed {
                    " (middle of its range)"
                } else {
                    ""
                }
            )
        })
        .collect();
    entries.join(", ")
}

/// Warns of a start pose outside the task's range.
pub fn check_start(session: &Session) {
    let coordinates = session.config.command.start(&*session.task);
    for (c, value) in coordinates.iter().zip(session.start()) {
        if !(c.range[0]..=c.range[1]).contains(&value) {
            failure::warn(&format!(
                "start.{} = {value} {} lies outside the task's range, {} to {}",
                c.name, c.unit, c.range[0], c.range[1]
            ));
        }
    }
}

/// The report of a stage, without the stage's own sections.
pub fn report(session: &Session, wall_s: f64, files: &[(&str, &str)]) -> RunReport {
    let config = &session.config;
    let cost = session.cost(wall_s);
    let all = [
        ("result.json", "the figures"),
        ("config.toml", "all settings, for `--config`"),
    ];
    let all: Vec<(&str, &str)> = all
        .iter()
        .chain(files)
        .copied()
        .chain([("trace.json", "the data of this report")])
        .collect();
    RunReport {
        stage: config.command.name().to_owned(),
        task: config.task.clone(),
        backend: config.backend.clone(),
        seed: config.seed,
        wall_s,
        physics_steps: cost.physics_steps,
        env_steps: cost.env_steps,
        versions: trace::versions(session),
        command: run::command_line(),
        files: trace::files(&all),
        ..RunReport::default()
    }
}

/// Writes what every stage writes and whatever `fill` adds. Then prints the result or `lines` on
/// standard output.
pub fn finish(
    session: &Session,
    common: &Common,
    out: &OutFolder,
    result: &impl Serialize,
    report: &RunReport,
    lines: &[String],
    fill: impl FnOnce(&Path) -> Result<()>,
) -> Result<()> {
    out.write(|folder| {
        write_json(&folder.join("result.json"), result)?;
        write_text(
            &folder.join("config.toml"),
            &toml::to_string_pretty(&session.config)?,
        )?;
        fill(folder)?;
        report.write(folder)?;
        Ok(())
    })?;
    out.tell(common.json, result, lines)
}
