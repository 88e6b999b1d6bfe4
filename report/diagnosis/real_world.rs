//! The value of the answer in practice: the task in the real world, before and after.

use asid_results::diagnosis::{DiagnosisResult, RealWorld, TaskTrial};

use crate::number::{quantity, significant};
use crate::page::{Cell, Column, Figure, Section, Table};
use crate::plot::{Axis, Colour, Ranked, Ranking};

fn successes(trial: &TaskTrial) -> String {
    format!("{} of {}", trial.successes, trial.values.len())
}

/// Mean of the metric.
fn mean(trial: &TaskTrial) -> f64 {
    trial.values.iter().sum::<f64>() / trial.values.len() as f64
}

/// Lines for a terminal.
#[must_use]
pub fn lines(world: &RealWorld) -> Vec<String> {
    let trials = world.trials.iter().filter(|t| !t.values.is_empty());
    let experiments = (!world.experiments.is_empty()).then(|| world.experiments.clone());
    let counted = trials.map(|t| {
        let mean = quantity(&significant(mean(t), 3), &world.unit);
        format!(
            "  {}, {}: {} in the mean {mean}, {} succeed",
            t.world,
            t.simulator,
            world.metric,
            successes(t)
        )
    });
    experiments.into_iter().chain(counted).collect()
}

pub(super) fn section(d: &DiagnosisResult) -> Option<Section> {
    let world = d.real_world.as_ref()?;
    let trials: Vec<&TaskTrial> = world
        .trials
        .iter()
        .filter(|t| !t.values.is_empty())
        .collect();
    if trials.is_empty() {
        return None;
    }
    let case = if world.condition.is_empty() {
        world.task.clone()
    } else {
        format!("{}, {}", world.task, world.condition)
    };
    let rows = trials.iter().map(|t| {
        let share = 100.0 * t.successes as f64 / t.values.len() as f64;
        let colour = match &*t.simulator {
            "the refined model" => Colour::Blue,
            _ if t.world == "the real world" => Colour::Vermillion,
            _ => Colour::Muted,
        };
        Ranked::new(t.world.clone(), share, successes(t))
            .note(t.simulator.clone())
            .colour(colour)
            .strong()
    });
    let axis = Axis::new("runs that succeed", "%").domain([0.0, 100.0]);
    let ranking = Ranking::new("Success in the real world", axis).rows(rows);
    let caption = format!(
        "Longer is better. A run explores, identifies, solves and tries once; success: {}.",
        world.rule
    );
    let metric = format!("mean {}", world.metric);
    let columns = vec![
        Column::text("in"),
        Column::text("with"),
        Column::number("success"),
        Column::number(&metric),
    ];
    let table = trials.iter().fold(Table::new(columns), |table, t| {
        table.row(vec![
            Cell::from(t.world.clone()),
            t.simulator.clone().into(),
            successes(t).into(),
            quantity(&significant(mean(t), 3), &world.unit).into(),
        ])
    });
    let mut facts = Vec::new();
    if !world.effects.is_empty() {
        let what = "what the real world has and the model as given lacks";
        facts.push((what.to_owned(), world.effects.join(", ")));
    }
    if !world.experiments.is_empty() {
        facts.push(("experiments".to_owned(), world.experiments.clone()));
    }
    for (name, value) in &world.truth {
        facts.push((format!("true {name}"), significant(*value, 4)));
    }
    Some(
        Section::new("The task, before and after")
            .lead(format!(
                "{case}: solved in the model as given, and in the model with the verdict's effects, then tried in the real world."
            ))
            .figures(vec![Figure::new(
                "Success with each simulator",
                ranking.description(caption.clone()),
                caption,
            )])
            .table(table)
            .facts(facts),
    )
}
