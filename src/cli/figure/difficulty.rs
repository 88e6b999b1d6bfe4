//! Success of methods as a task gets harder. Each level of one difficulty has a comparison, kept in
//! the figure's folder, so that a figure that was stopped can be resumed.

mod shown;

use std::path::Path;

use anyhow::Result;
use asid_comparison::rows::{ComparisonResult, Row};
use asid_core::Error;
use asid_core::difficulty::Difficulty;
use asid_statistics as statistics;

use super::{Data, Drawing, Request, share, task};
use crate::cli::settings::wrong;
use shown::{claims, metric, success, table};

/// The task that is shown where none is named.
const TASK: &str = "rod-balancing";

/// Difficulty and levels of a task where none are given, the easiest first. They hold the task's
/// own value, one that is easier, and three that are harder. The hardest rod ledge is an eighth as
/// wide as the task's own, the hardest goal a fifth as large.
const LEVELS: [(&str, &str, [f64; 5]); 4] = [
    (
        "rod-balancing",
        "ledge_width",
        [0.06, 0.04, 0.02, 0.01, 0.005],
    ),
    (
        "sphere-striking",
        "goal_radius",
        [0.1, 0.05, 0.03, 0.02, 0.01],
    ),
    (
        "sphere-patches",
        "goal_radius",
        [0.1, 0.05, 0.03, 0.02, 0.01],
    ),
    ("shuffleboard", "zone_length", [0.25, 0.15, 0.1, 0.06, 0.03]),
];

/// Runs of a method at a level, over all conditions.
struct Point {
    method: String,
    successes: usize,
    n: usize,
    /// Interquartile mean of the metric and its interval.
    metric: [f64; 3],
}

pub fn draw(request: &Request<'_>, kept: &Path) -> Result<Drawing> {
    let name = match &request.tasks[..] {
        [] => TASK,
        [one] => one,
        _ => return Err(wrong("difficulty", "is shown of one task at a time")),
    };
    let task = task(name)?;
    let given = request.levels.as_deref();
    let (setting, levels) = levels(given, request.quick, name, &task.difficulty())?;
    let mut data = Data::new(
        "difficulty.csv",
        &[
            "level",
            "method",
            "world",
            "engine",
            "condition",
            "n",
            "success_rate",
            "iqm",
            "iqm_low",
            "iqm_high",
        ],
    );
    let mut points: Vec<(f64, Vec<Point>)> = Vec::new();
    let mut notes = Vec::new();
    for level in levels {
        let assigned = format!("{}={level}", setting.name);
        let folder = kept.join(&assigned);
        let result = (request.compare)(name, &format!("difficulty.{assigned}"), &folder)?;
        data.rows.extend(result.rows.iter().map(|r| csv(level, r)));
        left_out(&result, &mut notes);
        points.push((level, pooled(&result.rows)));
    }
    let unit = &setting.unit;
    let mut drawing = Drawing {
        notes,
        data: vec![data],
        panels: vec![
            success(&setting, &points),
            metric(&*task, &setting, &points),
        ],
        tables: vec![table(&setting, &points)],
        claims: claims(&points),
        ..Drawing::new(
            &format!("{name} as it gets harder"),
            format!(
                "Success of methods on {name} over {}, {}, all conditions together. Each level is a comparison of \
                 its own in levels/, with the same seeds.",
                setting.name, setting.about
            ),
        )
    };
    for (level, of) in &points {
        drawing.numbers.extend(of.iter().map(|p| {
            let quantity = format!("success at {} = {level} {unit}", setting.name);
            share(&p.method, quantity.trim_end(), p.successes, p.n)
        }));
    }
    Ok(drawing)
}

/// Adds a note for each method that was left out at a level; the same one of several levels counts
/// once.
fn left_out(result: &ComparisonResult, notes: &mut Vec<String>) {
    for o in &result.omitted {
        let note = format!(
            "Left out: {} on {}, {}, {}: {}",
            o.method, o.task, o.world, o.backend, o.reason
        );
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
}

/// The chosen difficulty out of `all` that the task has, with its levels.
///
/// The levels are those given, else the task's own. With `quick`, only the first, the middle and
/// the last of the task's own are used.
fn levels(
    given: Option<&str>,
    quick: bool,
    task: &str,
    all: &[Difficulty],
) -> Result<(Difficulty, Vec<f64>)> {
    if all.is_empty() {
        let message = format!(
            "`{}` has no difficulty levels, over which the figure `difficulty` is drawn",
            task
        );
        return Err(wrong("TASK", message));
    }
    let (name, mut levels) = match given {
        Some(text) => read(text)?,
        None => {
            let own = LEVELS.iter().find(|(name, ..)| *name == task);
            let (_, name, levels) = own.ok_or_else(|| {
                let known: Vec<&str> = all.iter().map(|d| &*d.name).collect();
                let message = format!(
                    "`{}` has no levels of its own: give NAME=VALUE,VALUE with one of {}",
                    task,
                    known.join(", ")
                );
                wrong("--levels", message)
            })?;
            ((*name).to_owned(), levels.to_vec())
        }
    };
    let known = || all.iter().map(|d| &*d.name);
    let found = all.iter().find(|d| d.name == name);
    let found = found.ok_or_else(|| Error::unknown("difficulty", &name, known()))?;
    for level in &levels {
        found.check(*level)?;
    }
    if quick && given.is_none() {
        levels = vec![
            levels[0],
            levels[levels.len() / 2],
            levels[levels.len() - 1],
        ];
    }
    Ok((found.clone(), levels))
}

/// `NAME=VALUE,VALUE`.
fn read(text: &str) -> Result<(String, Vec<f64>)> {
    let shape = || wrong("--levels", format!("`{text}` is not NAME=VALUE,VALUE"));
    let (name, values) = text.split_once('=').ok_or_else(shape)?;
    let values: Result<Vec<f64>> = values
        .split(',')
        .map(|v| v.trim().parse().map_err(|_| shape()))
        .collect();
    Ok((name.trim().to_owned(), values?))
}

fn csv(level: f64, row: &Row) -> Vec<String> {
    let s = &row.summary;
    let names = [&row.method, &row.world, &row.backend, &row.condition];
    let numbers = [
        s.success_rate,
        s.iqm,
        s.iqm_interval95[0],
        s.iqm_interval95[1],
    ];
    let mut cells = vec![level.to_string()];
    cells.extend(names.map(String::clone));
    cells.push(s.n.to_string());
    cells.extend(numbers.map(|x| format!("{x:.5}")));
    cells
}

/// Methods pooled over all conditions. Their names include world and engine where there are
/// several.
fn pooled(rows: &[Row]) -> Vec<Point> {
    let several = |pick: fn(&Row) -> &String| rows.iter().any(|r| pick(r) != pick(&rows[0]));
    let (worlds, engines) = (several(|r| &r.world), several(|r| &r.backend));
    let label = |row: &Row| {
        let parts = [
            (true, &row.method),
            (worlds, &row.world),
            (engines, &row.backend),
        ];
        let shown = parts.iter().filter(|(shown, _)| *shown);
        let words: Vec<&str> = shown.map(|(_, name)| name.as_str()).collect();
        words.join(", ")
    };
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        if !names.contains(&label(row)) {
            names.push(label(row));
        }
    }
    names
        .into_iter()
        .map(|method| {
            let of: Vec<&Row> = rows.iter().filter(|r| label(r) == method).collect();
            let successes = of
                .iter()
                .map(|r| (r.summary.success_rate * r.summary.n as f64).round() as usize);
            let values: Vec<Vec<f64>> = of.iter().map(|r| r.values.clone()).collect();
            let [low, high] = statistics::bootstrap(&values, statistics::interquartile_mean);
            Point {
                successes: successes.sum(),
                n: of.iter().map(|r| r.summary.n).sum(),
                metric: [statistics::interquartile_mean(&values.concat()), low, high],
                method,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_without_difficulties_is_refused_in_a_whole_sentence() {
        for given in [None, Some("mass=1,2")] {
            let error = levels(given, false, "my-task", &[]).unwrap_err();
            assert_eq!(
                error.to_string(),
                "config TASK: `my-task` has no difficulty levels, over which the figure `difficulty` is drawn"
            );
        }
    }

    #[test]
    fn levels_are_read_and_the_own_ones_fit_their_tasks() {
        let (name, values) = read("ledge_width=0.04,0.02").unwrap();
        assert_eq!((&*name, &values[..]), ("ledge_width", &[0.04, 0.02][..]));
        assert!(read("ledge_width").is_err() && read("ledge_width=a").is_err());
        for (name, setting, levels) in LEVELS {
            let task = task(name).unwrap();
            let all = task.difficulty();
            let found = all.iter().find(|d| d.name == setting).unwrap();
            for level in levels {
                found.check(level).unwrap();
            }
            assert!(levels.contains(&found.default), "{name}");
        }
    }
}
