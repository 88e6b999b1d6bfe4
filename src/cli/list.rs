//! `asid list`: what is available, what is missing, and why.

use std::io::Write as _;

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{
    BackendEntry, Entry, ExplorerEntry, IdentifierEntry, Origin, SolverEntry, TaskEntry, all,
};
use asid_effects::EffectEntry;
use serde::Serialize;

use super::plugins::Refused;

/// Arguments of `list`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

/// What this build may lack: kind, name, and the feature that adds it. What is not built in cannot
/// register itself.
const OPTIONAL: [(&str, &str, &str); 3] = [
    ("backend", "mujoco", "mujoco"),
    ("backend", "rapier", "rapier"),
    ("solver", "ppo", "torch"),
];

/// Features that need a native library.
const NATIVE: [&str; 2] = ["mujoco", "torch"];

/// Packages whose parts count as built in.
const OWN: [&str; 7] = [
    "asid-algorithms",
    "asid-effects",
    "asid-learned",
    "asid-mujoco",
    "asid-nn",
    "asid-rapier",
    "asid-tasks",
];

/// The error that says how to get something that this build lacks.
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
    let setup = if NATIVE.contains(&feature) {
        "`cargo xtask setup`, then "
    } else {
        ""
    };
    format!("this build is without it; {setup}build with `--features {feature}`")
}

#[derive(Serialize)]
struct Row {
    kind: &'static str,
    name: String,
    about: String,
    available: bool,
    /// `built in`, the package that is linked in, or the plugin's file.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<String>,
}

fn origin(origin: Origin) -> String {
    match origin {
        Origin::Linked(package) if OWN.contains(&package.name) => "built in".into(),
        other => other.to_string(),
    }
}

/// A one-line description of an entry; if its own name was taken, the line says so.
fn about<E: Entry>(entry: &E) -> String {
    match entry.name().split_once("@plugin") {
        Some((own, _)) => format!("{} (its name `{own}` is taken)", entry.about()),
        None => format!("{}{}", entry.about(), trained(E::KIND, entry.name())),
    }
}

/// Text on what is shipped trained for a learned algorithm, and what its training needs.
fn trained(kind: &str, name: &str) -> String {
    use asid_learned::{estimator, learning, shipped};
    let (files, can_train): (Vec<String>, bool) = match (kind, name) {
        ("explorer", "fisher-ppo" | "maxmi" | "max" | "task-ppo") => (
            shipped::tasks(name).iter().map(|&t| t.into()).collect(),
            learning::can_train(name),
        ),
        ("identifier", estimator::NAME) => (
            shipped::ALL
                .iter()
                .filter_map(|s| {
                    let explorer = s.name.strip_prefix("estimator-")?;
                    Some(format!("{} explored by {explorer}", s.task))
                })
                .collect(),
            estimator::can_train(),
        ),
        _ => return String::new(),
    };
    let ships = if files.is_empty() {
        "none ships trained".to_owned()
    } else {
        format!("trained for {}", files.join(", "))
    };
    let needs = if can_train {
        String::new()
    } else {
        format!("; to train: {}", reason("torch"))
    };
    format!(" ({ships}{needs})")
}

fn rows<E: Entry>() -> Vec<Row> {
    let mut rows: Vec<Row> = all::<E>()
        .iter()
        .map(|e| Row {
            kind: E::KIND,
            name: e.name().to_owned(),
            about: about(*e),
            available: true,
            origin: Some(origin(e.origin())),
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
                origin: None,
                why: Some(reason(feature)),
            });
        }
    }
    rows.sort_by(|a, b| a.name.cmp(&b.name));
    rows
}

/// Prints the list.
pub fn list(arguments: &Arguments, refused: &[Refused]) -> Result<()> {
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
    all.extend(refused.iter().map(|r| Row {
        kind: "plugin",
        name: r.path.display().to_string(),
        about: String::new(),
        available: false,
        origin: None,
        why: Some(format!("refused: {}", r.why)),
    }));
    let mut out = std::io::stdout().lock();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&all)?)?;
        return Ok(());
    }
    for row in all {
        let text = match (row.why, row.origin) {
            (Some(why), _) if row.kind == "plugin" => why,
            (Some(why), Some(origin)) => format!("missing: {why} [{origin}]"),
            (Some(why), None) => format!("missing: {why}"),
            (None, origin) => format!("{} [{}]", row.about, origin.unwrap_or_default()),
        };
        writeln!(out, "{:<11} {:<16} {text}", row.kind, row.name)?;
    }
    Ok(())
}
