//! `asid list`: what there is, what is missing, and why.

use std::io::Write as _;

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{
    BackendEntry, EffectEntry, Entry, ExplorerEntry, IdentifierEntry, SolverEntry, TaskEntry, all,
};
use serde::Serialize;

/// Arguments of `list`.
#[derive(clap::Args)]
pub struct Arguments {
    /// As JSON
    #[arg(long)]
    json: bool,
}

/// What this build may lack: kind, name, the feature that brings it.
const OPTIONAL: [(&str, &str, &str); 3] = [
    ("backend", "mujoco", "mujoco"),
    ("backend", "rapier", "rapier"),
    ("explorer", "fisher-ppo", "torch"),
];

/// Says how to get something that this build lacks.
pub fn missing(kind: &str, name: &str) -> Option<Error> {
    OPTIONAL
        .iter()
        .find(|(k, n, _)| *k == kind && *n == name)
        .map(|(_, _, feature)| Error::Missing {
            what: format!("{kind} `{name}`"),
            message: reason(feature),
        })
}

fn reason(feature: &str) -> String {
    let setup = if feature == "rapier" {
        ""
    } else {
        "`cargo xtask setup`, then "
    };
    format!("this build is without it; {setup}build with `--features {feature}`")
}

#[derive(Serialize)]
struct Row {
    kind: &'static str,
    name: String,
    about: String,
    available: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<String>,
}

fn rows<E: Entry>() -> Vec<Row> {
    let mut rows: Vec<Row> = all::<E>()
        .iter()
        .map(|e| Row {
            kind: E::KIND,
            name: e.name().to_owned(),
            about: e.about().to_owned(),
            available: true,
            why: None,
        })
        .collect();
    for (kind, name, feature) in OPTIONAL {
        if kind == E::KIND && !rows.iter().any(|r| r.name == name) {
            rows.push(Row {
                kind,
                name: name.to_owned(),
                about: String::new(),
                available: false,
                why: Some(reason(feature)),
            });
        }
    }
    rows.sort_by(|a, b| a.name.cmp(&b.name));
    rows
}

/// Prints the list.
pub fn list(arguments: &Arguments) -> Result<()> {
    let mut all: Vec<Row> = rows::<BackendEntry>();
    for row in &mut all {
        if let Ok(entry) = asid_core::registry::find::<BackendEntry>(&row.name) {
            match (entry.make)() {
                Ok(backend) => row.about = format!("{}, version {}", row.about, backend.version()),
                Err(e) => (row.available, row.why) = (false, Some(e.to_string())),
            }
        }
    }
    all.extend(rows::<TaskEntry>());
    all.extend(rows::<ExplorerEntry>());
    all.extend(rows::<IdentifierEntry>());
    all.extend(rows::<SolverEntry>());
    all.extend(rows::<EffectEntry>());
    let mut out = std::io::stdout().lock();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&all)?)?;
        return Ok(());
    }
    for row in all {
        let text = row.why.map_or(row.about, |why| format!("missing: {why}"));
        writeln!(out, "{:<11} {:<14} {text}", row.kind, row.name)?;
    }
    Ok(())
}
