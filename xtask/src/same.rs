//! `cargo xtask same OLD NEW`: whether two builds of `asid` give the same results, to the bit.
//!
//! It checks changes that are meant to change no result. It compares runs of every task on every
//! engine, a comparison, a diagnosis of every study, and conformance, all with the smallest
//! searches. It ignores what differs between two runs of one build: times, versions and the command
//! line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::library::repository;

/// Keys whose values are not part of the result.
const APART: [&str; 7] = [
    "wall_s",
    "seconds",
    "seconds_to_first_table",
    "versions",
    "git",
    "commit",
    "command",
];

/// Settings of the smallest searches; these take the same code paths as long ones.
const TINY: [&str; 11] = [
    "explorer.iterations=1",
    "explorer.population=4",
    "explorer.prior_samples=1",
    "identifier.iterations=1",
    "identifier.population=8",
    "identifier.sampling.rounds=1",
    "identifier.sampling.draws=8",
    "solver.iterations=1",
    "solver.population=2",
    "solver.belief_samples=1",
    "expected.rounds=0",
];

/// Maximum number of differences of a result that are shown.
const TOLD: usize = 5;

/// Compares two builds; false if a result differs.
pub fn run(arguments: &[String]) -> Result<bool> {
    let [old, new] = arguments else {
        bail!("`same` takes two programs, the old build and the new one");
    };
    let programs = [old, new].map(PathBuf::from);
    for program in &programs {
        if !program.is_file() {
            bail!("there is no program {}", program.display());
        }
    }
    let folder = tempfile::tempdir()?;
    let mut all_same = true;
    println!("{:<46} result", "command");
    for (name, command) in commands(&programs[1])? {
        let sides = [0, 1].map(|side| {
            let out = folder
                .path()
                .join(format!("{side}-{}", name.replace(' ', "-")));
            result(&programs[side], &command, &out)
        });
        let told = match &sides {
            [Ok(a), Ok(b)] => {
                let differences = differences(a, b);
                if differences.is_empty() {
                    "same".to_owned()
                } else {
                    differences.join("; ")
                }
            }
            [Err(a), Err(b)] if a.to_string() == b.to_string() => format!("both: {a}"),
            [a, b] => {
                let said = |r: &Result<_>| {
                    r.as_ref()
                        .map_or_else(|e| format!("{e}"), |_| "done".into())
                };
                format!("old: {}; new: {}", said(a), said(b))
            }
        };
        all_same &= told == "same" || told.starts_with("both: ");
        println!("{name:<46} {told}");
    }
    Ok(all_same)
}

/// Names and arguments of all compared commands; `program` lists the tasks and engines.
fn commands(program: &Path) -> Result<Vec<(String, Vec<String>)>> {
    let listed = output(program, &["list", "--json"])?;
    let rows: Vec<Value> = serde_json::from_str(&listed)?;
    let of = |kind: &str| -> Vec<String> {
        let named = rows
            .iter()
            .filter(|r| r["kind"] == kind && r["available"] == true);
        named
            .filter_map(|r| Some(r["name"].as_str()?.to_owned()))
            .collect()
    };
    let tiny = || {
        TINY.iter()
            .flat_map(|s| ["--set".to_owned(), (*s).to_owned()])
    };
    let words = |text: &str| -> Vec<String> { text.split(' ').map(str::to_owned).collect() };
    let mut all = Vec::new();
    for engine in of("backend") {
        for task in of("task") {
            let name = format!("run {task} --backend {engine}");
            let mut command = words(&format!("{name} --seed 5"));
            command.extend(tiny());
            all.push((name, command));
        }
        let name = format!("conformance --backend {engine}");
        all.push((name.clone(), words(&name)));
        let name = format!("compare rod-balancing --backend {engine}");
        let mut command = words(&format!(
            "{name} --method asid --method random --method dr --seeds 1"
        ));
        command.extend(tiny());
        all.push((name, command));
    }
    let studies = std::fs::read_dir(repository().join("studies"))?;
    let mut studies: Vec<PathBuf> = studies.filter_map(|e| Some(e.ok()?.path())).collect();
    studies.retain(|s| s.join("study.toml").is_file());
    studies.sort();
    for study in studies {
        let file = study.file_name().unwrap_or_default().to_string_lossy();
        let command = ["diagnose".to_owned(), study.display().to_string()];
        all.push((format!("diagnose {file}"), command.into()));
    }
    Ok(all)
}

/// Output of a program.
fn output(program: &Path, arguments: &[&str]) -> Result<String> {
    let done = Command::new(program).args(arguments).output()?;
    Ok(String::from_utf8(done.stdout)?)
}

/// The values in a command's `result.json`, by their paths.
fn result(program: &Path, command: &[String], out: &Path) -> Result<BTreeMap<String, String>> {
    let done = Command::new(program)
        .args(command)
        .arg("--quiet")
        .arg("--out")
        .arg(out)
        .output()
        .context("cannot start the program")?;
    let file = out.join("result.json");
    if !file.is_file() {
        let said = String::from_utf8_lossy(&done.stderr);
        bail!("{}", said.lines().last().unwrap_or("says nothing"));
    }
    let value: Value = serde_json::from_slice(&std::fs::read(file)?)?;
    let mut found = BTreeMap::new();
    flatten(&value, String::new(), &mut found);
    Ok(found)
}

/// Collects every value of a document by its path.
fn flatten(value: &Value, place: String, found: &mut BTreeMap<String, String>) {
    match value {
        Value::Object(fields) => {
            for (key, inner) in fields.iter().filter(|(k, _)| !APART.contains(&k.as_str())) {
                flatten(inner, format!("{place}.{key}"), found);
            }
        }
        Value::Array(items) => {
            for (i, inner) in items.iter().enumerate() {
                flatten(inner, format!("{place}[{i}]"), found);
            }
        }
        plain => {
            found.insert(place, plain.to_string());
        }
    }
}

/// The first paths at which two results differ.
fn differences(old: &BTreeMap<String, String>, new: &BTreeMap<String, String>) -> Vec<String> {
    let mut places: Vec<&String> = old.keys().chain(new.keys()).collect();
    places.sort();
    places.dedup();
    let differ = places.into_iter().filter(|p| old.get(*p) != new.get(*p));
    let nothing = "nothing".to_owned();
    differ
        .take(TOLD)
        .map(|p| {
            let of = |side: &BTreeMap<String, String>| side.get(p).unwrap_or(&nothing).clone();
            format!("{p}: {} -> {}", of(old), of(new))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_compared_value_by_value_but_for_times() {
        let of = |text: &str| {
            let mut found = BTreeMap::new();
            flatten(
                &serde_json::from_str(text).unwrap(),
                String::new(),
                &mut found,
            );
            found
        };
        let old = of(r#"{"a": [1, {"wall_s": 3}], "b": 0.5}"#);
        assert!(differences(&old, &of(r#"{"b": 0.5, "a": [1, {"wall_s": 4}]}"#)).is_empty());
        let new = of(r#"{"a": [2], "c": null}"#);
        let told = differences(&old, &new);
        assert_eq!(
            told,
            [".a[0]: 1 -> 2", ".b: 0.5 -> nothing", ".c: nothing -> null"]
        );
    }
}
