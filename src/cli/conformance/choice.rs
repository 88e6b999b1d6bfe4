//! Selection and listing of checks, and the documents that they give an engine.

use std::io::Write as _;

use anyhow::Result;
use asid_conformance::{Check, FAMILIES, checks};
use asid_core::{Backend, Error};
use serde::Serialize;

use super::names;

/// The checks whose names contain one of the patterns; all if there is no pattern.
pub fn chosen(patterns: &[String]) -> Result<Vec<&'static Check>> {
    let all: Vec<&Check> = checks().collect();
    if let Some(text) = (patterns.iter()).find(|p| !all.iter().any(|c| c.name.contains(&***p))) {
        return Err(unknown(text, &all).into());
    }
    let holds = |check: &&Check| patterns.iter().any(|p| check.name.contains(p.as_str()));
    Ok(all
        .into_iter()
        .filter(|check| patterns.is_empty() || holds(check))
        .collect())
}

/// An error for a pattern that no check contains: it lists similar names, else the families.
fn unknown(text: &str, all: &[&Check]) -> Error {
    /// Largest number of names in the message.
    const MOST: usize = 5;
    let families: Vec<String> = (FAMILIES.iter())
        .map(|(family, _)| format!("{family}/"))
        .collect();
    // The user may give a name without its family, or a family alone.
    let bare = |name: &'static str| name.split_once('/').map_or(name, |(_, bare)| bare);
    let names = all.iter().flat_map(|check| [check.name, bare(check.name)]);
    let known = names.chain(families.iter().map(String::as_str));
    let mut error = Error::unknown("check", text, known);
    if let Error::UnknownName { near, .. } = &mut error {
        if near.len() > all.len() {
            // All families, because none is similar.
            *near = families;
        } else {
            near.truncate(2 * MOST);
        }
        for name in near.iter_mut() {
            if let Some(check) = all.iter().find(|check| bare(check.name) == name) {
                check.name.clone_into(name);
            }
        }
        let mut seen = Vec::new();
        near.retain(|name| {
            let first = !seen.contains(name);
            seen.push(name.clone());
            first
        });
    }
    error
}

/// What `--list` prints.
#[derive(Serialize)]
struct Listed {
    name: &'static str,
    needs: Vec<&'static str>,
    unit: &'static str,
    reason: &'static str,
}

/// Prints the checks with their requirements and the sources of their tolerances.
pub fn list(checks: &[&Check], json: bool) -> Result<()> {
    let listed: Vec<Listed> = (checks.iter())
        .map(|check| Listed {
            name: check.name,
            needs: names(check.needs),
            unit: check.unit,
            reason: check.reason,
        })
        .collect();
    let mut stdout = std::io::stdout().lock();
    if json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&listed)?)?;
        return Ok(());
    }
    for check in listed {
        let needs = match &check.needs[..] {
            [] => "nothing".to_owned(),
            needs => needs.join(" "),
        };
        writeln!(
            stdout,
            "{}\n    needs {needs}\n    {}",
            check.name, check.reason
        )?;
    }
    Ok(())
}

/// Prints the documents that the checks give an engine.
pub fn scenes(checks: &[&Check], engine: &dyn Backend) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    for check in checks {
        let scenes = check.scenes(engine);
        for (i, xml) in scenes.iter().enumerate() {
            let (check, of) = (check.name, scenes.len());
            writeln!(stdout, "<!-- {check}, {} of {of} -->\n{xml}\n", i + 1)?;
        }
        if scenes.is_empty() {
            writeln!(stdout, "<!-- {}: no document -->\n", check.name)?;
        }
    }
    Ok(())
}
