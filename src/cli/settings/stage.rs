//! The stage that settings are resolved for, and the start pose of stages that take one.

use std::collections::BTreeMap;

use anyhow::Result;
use asid_core::task::Coordinate;
use asid_core::{Error, Task};
use serde::Serialize;

use super::table::{numbers, wrong};

/// The stage that settings are resolved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// The whole pipeline, or many runs of it.
    Run,
    /// Exploration alone.
    Explore,
    /// Identification alone.
    Identify,
    /// Solving alone.
    Solve,
}

impl Stage {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Explore => "explore",
            Self::Identify => "identify",
            Self::Solve => "solve",
        }
    }

    /// Coordinates of the start pose that the stage takes.
    pub fn start(self, task: &dyn Task) -> &[Coordinate] {
        match self {
            Self::Run | Self::Identify => &[],
            Self::Explore => &task.exploration().start,
            Self::Solve => &task.downstream().start,
        }
    }

    pub(super) fn is_run(&self) -> bool {
        *self == Self::Run
    }
}

/// The start pose of a stage that takes one.
///
/// Coordinates that were not given get the middle of their range; their names are returned too.
pub fn start(
    stage: Stage,
    task: &dyn Task,
    table: &toml::Table,
) -> Result<(BTreeMap<String, f64>, Vec<String>)> {
    let given = numbers("start", table)?;
    let coordinates = stage.start(task);
    for (name, &value) in &given {
        if coordinates.is_empty() {
            return Err(wrong(
                &format!("start.{name}"),
                format!(
                    "`{}` takes no start pose; `explore` and `solve` do",
                    stage.name()
                ),
            ));
        }
        let Some(c) = coordinates.iter().find(|c| &c.name == name) else {
            let known = coordinates.iter().map(|c| &*c.name);
            return Err(Error::unknown("start coordinate", name, known).into());
        };
        // A tracker may report an object slightly outside the range; a value further off has
        // another unit or frame.
        let [low, high] = c.range;
        let slack = high - low;
        if !(low - slack..=high + slack).contains(&value) {
            return Err(wrong(
                &format!("start.{name}"),
                format!(
                    "{value} {} is far outside the task's range, {low} to {high}",
                    c.unit
                ),
            ));
        }
    }
    let missing = coordinates.iter().filter(|c| !given.contains_key(&c.name));
    let assumed = missing.map(|c| c.name.clone()).collect();
    let all = coordinates
        .iter()
        .map(|c| {
            (
                c.name.clone(),
                given.get(&c.name).copied().unwrap_or(c.center()),
            )
        })
        .collect();
    Ok((all, assumed))
}
