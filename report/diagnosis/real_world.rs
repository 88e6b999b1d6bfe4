//! What the answer is worth where it counts: the task in the real world, before and after.

use serde::{Deserialize, Serialize};

use super::data::Diagnosis;
use crate::number::{quantity, significant};
use crate::page::{Cell, Column, Figure, Section, Table};
use crate::plot::{Axis, Colour, Ranked, Ranking};

/// A task in the real world with one simulator after the other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RealWorld {
    /// The task.
    pub task: String,
    /// Its condition; may be empty.
    pub condition: String,
    /// Name of its metric.
    pub metric: String,
    /// Unit of the metric.
    pub unit: String,
    /// The rule of success, in words.
    pub rule: String,
    /// Effects that the real world has and the simulator lacks.
    pub effects: Vec<String>,
    /// Episodes that were played to tell explanations apart, in words; may be empty.
    pub experiments: String,
    /// The hidden true values, by name.
    pub truth: Vec<(String, f64)>,
    /// One a world and simulator, in the order shown.
    pub trials: Vec<TaskTrial>,
}

/// Runs of a task in one world with one simulator.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskTrial {
    /// In which world.
    pub world: String,
    /// With which simulator.
    pub simulator: String,
    /// The metric of each run, in its unit.
    pub values: Vec<f64>,
    /// Runs that succeeded.
    pub successes: usize,
}

impl TaskTrial {
    fn label(&self) -> String {
        format!("{}, {}", self.world, self.simulator)
    }

    fn successes(&self) -> String {
        format!("{} of {}", self.successes, self.values.len())
    }

    /// Mean of the metric.
    fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len() as f64
    }
}

impl RealWorld {
    /// Lines for a terminal.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let trials = self.trials.iter().filter(|t| !t.values.is_empty());
        let experiments = (!self.experiments.is_empty()).then(|| self.experiments.clone());
        let counted = trials.map(|t| {
            let mean = quantity(&significant(t.mean(), 3), &self.unit);
            let (label, successes) = (t.label(), t.successes());
            format!(
                "  {label}: {} in the mean {mean}, {successes} succeed",
                self.metric
            )
        });
        experiments.into_iter().chain(counted).collect()
    }
}

pub(super) fn section(d: &Diagnosis) -> Option<Section> {
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
        Ranked::new(t.world.clone(), share, t.successes())
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
    let mean = format!("mean {}", world.metric);
    let columns = vec![
        Column::text("in"),
        Column::text("with"),
        Column::number("success"),
        Column::number(&mean),
    ];
    let table = trials.iter().fold(Table::new(columns), |table, t| {
        table.row(vec![
            Cell::from(t.world.clone()),
            t.simulator.clone().into(),
            t.successes().into(),
            quantity(&significant(t.mean(), 3), &world.unit).into(),
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
