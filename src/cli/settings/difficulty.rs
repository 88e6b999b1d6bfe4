//! How hard a task is: its own values, overridden by a preset's, then by single ones.
//!
//! The difficulty is applied before anything else is resolved, because noise, goal and scene follow
//! from it.

use std::collections::BTreeMap;

use anyhow::Result;
use asid_core::{Levels, Task};

use super::table::{configured, numbers, section, set, text, wrong};
use crate::cli::options::Common;

/// Values of a task's difficulties, by name.
///
/// They are those of the file, unless the command line names a preset; `--set` overrides both.
pub fn levels(task: &dyn Task, common: &Common) -> Result<BTreeMap<String, f64>> {
    let file = configured(common)?;
    let mut given = toml::Table::new();
    for assignment in &common.set {
        set(&mut given, assignment)?;
    }
    let preset = match &common.preset {
        Some(name) => Some(name.clone()),
        None => text(&given, "preset")?,
    };
    let start = match preset {
        Some(name) => Levels::preset(task.difficulty(), &name)?,
        None => of_file(task, &file)?,
    };
    let last = numbers("difficulty", &section(&given, "difficulty")?)?;
    Ok(start.with(&last)?.values())
}

/// The levels of a configuration file.
fn of_file(task: &dyn Task, file: &toml::Table) -> Result<Levels> {
    let start = match text(file, "preset")? {
        Some(name) => Levels::preset(task.difficulty(), &name)?,
        None => Levels::new(task.difficulty()),
    };
    Ok(start.with(&numbers("difficulty", &section(file, "difficulty")?)?)?)
}

/// The task with these levels.
pub fn at(task: Box<dyn Task>, levels: &BTreeMap<String, f64>) -> Result<Box<dyn Task>> {
    if *levels == Levels::new(task.difficulty()).values() {
        return Ok(task);
    }
    task.adjusted(levels)?.ok_or_else(|| {
        let message = "the task names difficulties and cannot be set to any".to_owned();
        wrong("difficulty", message)
    })
}

/// Removes the noise from a file's settings where it only repeats what follows from the file's own
/// difficulty.
///
/// Another difficulty then gets its own noise.
pub fn forget_noise(task: &dyn Task, file: &mut toml::Table) -> Result<()> {
    let levels = of_file(task, file)?.values();
    let Some(toml::Value::Table(noise)) = file.get_mut("noise") else {
        return Ok(());
    };
    let other = task.adjusted(&levels)?;
    let protocol = other.as_deref().unwrap_or(task).exploration();
    for signal in &protocol.signals {
        let same = |v: &toml::Value| v.as_float() == Some(signal.noise);
        if noise.get(&signal.sensor).is_some_and(same) {
            noise.remove(&signal.sensor);
        }
    }
    Ok(())
}
