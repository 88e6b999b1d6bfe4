//! The tables at the end: parameters, costs, versions, files, and how to repeat the run.

use super::head::{covered, interval, precision};
use super::trace::{Prior, RunReport};
use crate::number::{decimals, duration, grouped, quantity, round, unit_symbol};
use crate::page::{Cell, Column, Section, Table, Tone};

pub(super) fn parameters(report: &RunReport) -> Option<Section> {
    if report.parameters.is_empty() {
        return None;
    }
    let columns = vec![
        Column::text("parameter"),
        Column::text("unit"),
        Column::number("estimate ± std"),
        Column::number("95 % interval"),
        Column::number("truth"),
        Column::number("error"),
        Column::text("inside"),
        Column::text("prior"),
        Column::text("target"),
    ];
    let mut table = Table::new(columns);
    for p in &report.parameters {
        let dash = || "–".to_owned();
        let precision = precision(p);
        let inside: Cell = match covered(p) {
            Some(true) => Cell::toned("yes", Tone::Good),
            Some(false) => Cell::toned("no", Tone::Bad),
            None => "–".into(),
        };
        table = table.row(vec![
            p.name.clone().into(),
            unit_symbol(&p.unit).into(),
            precision.with_uncertainty(p.estimate, p.std).into(),
            interval(p).unwrap_or_else(dash).into(),
            p.truth.map_or_else(dash, |t| precision.show(t)).into(),
            p.truth
                .map_or_else(dash, |t| precision.show(p.estimate - t))
                .into(),
            inside,
            p.prior.as_ref().map_or_else(dash, prior).into(),
            p.target.clone().into(),
        ]);
    }
    Some(Section::new("Parameters").table(table))
}

fn prior(prior: &Prior) -> String {
    let n = |x: f64| round(x, 3);
    match *prior {
        Prior::Uniform { low, high } => format!("uniform, {} to {}", n(low), n(high)),
        Prior::LogUniform { low, high } => format!("log-uniform, {} to {}", n(low), n(high)),
        Prior::Normal {
            mean,
            std,
            low,
            high,
        } => format!("normal {} ± {}, {} to {}", n(mean), n(std), n(low), n(high)),
        Prior::Binary { probability } => format!("1 with probability {}", n(probability)),
    }
}

pub(super) fn costs(report: &RunReport) -> Option<Section> {
    if report.costs.is_empty() {
        return None;
    }
    let columns = vec![
        Column::text("stage"),
        Column::number("time"),
        Column::number("share"),
        Column::number("physics steps"),
        Column::number("steps per second"),
    ];
    let sum: f64 = report
        .costs
        .iter()
        .map(|c| c.wall_s)
        .filter(|s| s.is_finite())
        .sum();
    let row = |name: &str, wall_s: f64, steps: u64| -> Vec<Cell> {
        let share = 100.0 * wall_s / sum;
        let rate = steps as f64 / wall_s;
        vec![
            name.into(),
            duration(wall_s).into(),
            quantity(&decimals(share, 0), "%").into(),
            grouped(steps).into(),
            if rate.is_finite() && steps > 0 {
                grouped(rate.round() as u64)
            } else {
                "–".to_owned()
            }
            .into(),
        ]
    };
    let mut table = Table::new(columns);
    for cost in &report.costs {
        table = table.row(row(&cost.stage, cost.wall_s, cost.physics_steps));
    }
    let steps = report.costs.iter().map(|c| c.physics_steps).sum();
    Some(Section::new("Cost").table(table.row(row("all stages", sum, steps)).total()))
}

pub(super) fn repeat(report: &RunReport) -> Option<Section> {
    if report.command.is_empty() && report.files.is_empty() && report.versions.is_empty() {
        return None;
    }
    let mut section = Section::new("Repeat it")
        .lead("The same seed and binary give the same result, at any thread count.");
    if !report.command.is_empty() {
        section = section.command(report.command.clone());
    }
    section = section.facts(
        report
            .versions
            .iter()
            .map(|v| (v.name.clone(), v.value.clone()))
            .collect(),
    );
    if !report.files.is_empty() {
        let mut table = Table::new(vec![Column::text("file"), Column::prose("holds")]);
        for file in &report.files {
            table = table.row(vec![file.name.clone().into(), file.what.clone().into()]);
        }
        section = section.table(table);
    }
    Some(section)
}
