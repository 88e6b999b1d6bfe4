//! Summarises runs from the folders that `asid run` writes: the figures on the tasks' pages that no
//! table of `asid compare` shows.
//!
//!     cargo run -p asid-tasks --example figures -- runs/patches-*

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::{Path, PathBuf};

use asid_tasks::{laptop_articulation, sphere_patches};
use serde_json::Value;

/// A finished run.
struct Run {
    folder: PathBuf,
    result: Value,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut runs = Vec::new();
    for folder in std::env::args().skip(1).map(PathBuf::from) {
        let result = serde_json::from_str(&std::fs::read_to_string(folder.join("result.json"))?)?;
        runs.push(Run { folder, result });
    }
    let n = runs.len();
    let count = |which: &dyn Fn(&Value) -> bool| runs.iter().filter(|r| which(&r.result)).count();
    println!(
        "{n} runs, {} succeed, contact in {}",
        count(&|r| r["downstream"]["success"] == true),
        count(&|r| number(&r["exploration"]["contact_fraction"]) > 0.0),
    );
    unknowns(&runs);
    joints(&runs);
    for run in &runs {
        if run.result["task"] == "sphere-patches" {
            visits(run)?;
        }
    }
    Ok(())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        _ => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

/// Prints each unknown's error next to its posterior's expectation, and the coverage of its
/// interval.
fn unknowns(runs: &[Run]) {
    let of = |run: &Run| run.result["parameters"].as_array().cloned();
    let count = runs.first().and_then(of).map_or(0, |p| p.len());
    for i in 0..count {
        let all: Vec<&Value> = runs.iter().map(|r| &r.result["parameters"][i]).collect();
        let name = all[0]["name"].as_str().unwrap_or_default();
        let unit = all[0]["unit"].as_str().unwrap_or_default();
        let truth = |p: &Value| number(&p["truth"]);
        let error = |p: &Value| (number(&p["estimate"]) - truth(p)).abs();
        if all
            .iter()
            .all(|p| unit.is_empty() && [0.0, 1.0].contains(&truth(p)))
        {
            let sure = all.iter().filter(|p| error(p) < 0.1).count();
            println!(
                "{name}: the true value has over 90 % in {sure} of {}",
                all.len()
            );
            continue;
        }
        let held = all.iter().filter(|p| {
            let [low, high] = [0, 1].map(|k| number(&p["interval95"][k]));
            (low..=high).contains(&truth(p))
        });
        let of_truth = |x: &dyn Fn(&Run, &Value) -> f64| {
            let each = runs.iter().zip(&all);
            100.0 * median(each.map(|(r, p)| x(r, p) / truth(p).abs()).collect())
        };
        println!(
            "{name}: median error {:.2e} {unit} ({:.1} % of the truth), its posterior's deviation {:.1} %, \
             expected from the episode {:.1} %; the 95 % interval holds the truth in {} of {}",
            median(all.iter().map(|p| error(p)).collect()),
            of_truth(&|_, p| error(p)),
            of_truth(&|_, p| number(&p["std"])),
            of_truth(&|r, _| number(&r.result["exploration"]["expected_std"][i])),
            held.count(),
            all.len(),
        );
    }
}

/// Prints the error of the joint that is found from the tracked parts, relative to the laptop's
/// hinge.
fn joints(runs: &[Run]) {
    let (mut axes, mut origins, mut kinds) = (Vec::new(), Vec::new(), Vec::new());
    for run in runs {
        let found = &run.result["articulation"];
        if let Some(kind) = found["joint"].as_str() {
            kinds.push(kind.to_owned());
        }
        let unknowns = &run.result["parameters"];
        if found["axis"].is_null() || number(&unknowns[0]["truth"]) < 0.5 {
            continue;
        }
        let vector = |name: &str| [0, 1, 2].map(|k| number(&found[name][k]));
        let (axis, origin) = (vector("axis"), vector("origin"));
        axes.push(axis[0].abs().min(1.0).acos().to_degrees());
        // The hinge is along x, so the distance is measured in y and z.
        let hinge = laptop_articulation::hinge(number(&unknowns[1]["truth"]));
        origins.push((origin[1] - hinge[1]).hypot(origin[2] - hinge[2]));
    }
    for kind in ["rigid", "revolute", "prismatic"] {
        let n = kinds.iter().filter(|k| *k == kind).count();
        if n > 0 {
            println!(
                "joint of the tracked parts: {kind} in {n} of {}",
                kinds.len()
            );
        }
    }
    if !axes.is_empty() {
        println!(
            "hinge of {} lids that turn: median error of the axis {:.2} degrees, of the origin {:.1} mm",
            axes.len(),
            median(axes),
            1e3 * median(origins)
        );
    }
}

/// Prints the share of the episode that the ball spends in each patch.
fn visits(run: &Run) -> Result<(), Box<dyn Error>> {
    let places = column(&run.folder.join("real.csv"), "ball_pos.1")?;
    let share = |patch: usize| {
        let [low, high] = sphere_patches::PATCHES[patch][1];
        let inside = places.iter().filter(|y| (low..high).contains(*y)).count();
        100.0 * inside as f64 / places.len() as f64
    };
    println!(
        "{}: {:.0} %, {:.0} %, {:.0} % of the episode in the first, second and third patch",
        run.folder.display(),
        share(0),
        share(1),
        share(2)
    );
    Ok(())
}

/// A column of a log.
fn column(path: &Path, name: &str) -> Result<Vec<f64>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default();
    let at = header
        .split(',')
        .position(|c| c == name)
        .ok_or_else(|| format!("{} has no column {name}", path.display()))?;
    lines
        .map(|line| Ok(line.split(',').nth(at).unwrap_or_default().parse()?))
        .collect()
}
