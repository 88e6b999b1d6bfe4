//! The scoreboard: all cases of a set, and groups of them.

mod row;

use std::collections::BTreeMap;

use serde::Serialize;

use crate::case::{Alarm, Case};
use crate::judge::Standing;
use crate::statistics::{Calibration, Figure, Share};
use crate::values::Estimate;
pub use row::Row;

/// Smallest probability in a logarithm.
///
/// A few hundred cases cannot verify a frequency below one in a thousand. A single answer that is
/// sure and wrong should not outweigh all others.
const FLOOR: f64 = 1e-3;

/// Edges of the bins of a power curve: excess gaps in units of the noise. They double from a gap
/// that hardly shows.
const EDGES: [f64; 7] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// False alarms in worlds without a cause.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Alarms {
    /// Cases in which an effect is named that is absent, or dirt that is far too large.
    pub effect: Share,
    /// Clean worlds with the answer `unknown`.
    pub unknown: Share,
    /// Dirty worlds with the answer `unknown`: neither right nor a false alarm.
    pub apart: Share,
}

/// Cases whose causes have an excess gap in one bin.
#[derive(Clone, Debug, Serialize)]
pub struct Power {
    /// Smallest and largest excess gap, in units of the noise; null if there is no largest.
    pub gap: (f64, Option<f64>),
    /// Mean excess gap.
    pub mean_gap: f64,
    /// Cases in which something was named.
    pub noticed: Share,
    /// Cases with a right verdict.
    pub right: Share,
}

/// Errors of estimates.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Errors {
    /// Median relative error.
    pub error: Option<Figure>,
    /// Share of 95 % intervals that contain the true value.
    pub covered: Share,
}

impl Errors {
    fn of<'a>(estimates: impl Iterator<Item = &'a Estimate>) -> Self {
        let all: Vec<&Estimate> = estimates.collect();
        let errors: Vec<f64> = all.iter().map(|e| e.error).collect();
        Self {
            error: Figure::median(&errors),
            covered: Share::of(all.iter().filter_map(|e| e.covered)),
        }
    }
}

/// Score of wiring faults over all cases.
#[derive(Clone, Debug, Default, Serialize)]
pub struct WiringScore {
    /// Faults found.
    pub found: Share,
    /// Cases in which an absent fault is named.
    pub false_alarms: Share,
}

/// Score of one method on a set of cases; `result.json` of `withheld`.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// Version of the format: 1.
    pub schema: u32,
    /// The method that answered: `diagnose` or a baseline.
    pub method: String,
    /// Number of cases that count.
    pub cases: usize,
    /// Number of right verdicts.
    pub right: usize,
    /// Number of cases that are right, or have a right set among the two most probable.
    pub top2: usize,
    /// Number of cases that are right, or have a right set in the ambiguity set.
    pub covered: usize,
    /// Rows: all cases, then machine by machine, and so on.
    pub rows: Vec<Row>,
    /// False alarms in clean worlds without a cause.
    pub clean_alarms: Alarms,
    /// False alarms in dirty worlds without a cause.
    pub dirty_alarms: Alarms,
    /// Causes of no catalogue that were called `unknown`.
    pub unknowns: Share,
    /// Mean logarithm of the probability given to right sets.
    pub log_score: Option<Figure>,
    /// The log score of a guess by how often each cause occurs.
    pub base_log_score: f64,
    /// Mean squared difference of the stated probability and its event.
    pub brier: Option<Figure>,
    /// Calibration of the stated probabilities.
    pub calibration: Calibration,
    /// Mean F1 of the columns in which the answer locates the excess.
    pub localization_signals: Option<Figure>,
    /// Mean F1 of columns with regimes.
    pub localization_regimes: Option<Figure>,
    /// Faults of wiring.
    pub wiring: WiringScore,
    /// Errors of the values of rightly named effects.
    pub effect_values: Errors,
    /// Errors of the study's parameters, over all cases with an answer.
    pub parameters: Errors,
    /// Share of right verdicts by the excess gap of the causes.
    pub power: Vec<Power>,
    /// Counts of truth and verdict, by names without sites.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Longest case, s.
    pub slowest: f64,
    /// Largest memory of a case, MiB.
    pub largest_memory_mib: Option<f64>,
    /// Cases that the engine cannot simulate, with the reason; no figure includes them.
    pub left_out: BTreeMap<String, String>,
    /// Each case.
    pub answers: Vec<Case>,
}

/// Names of a set without sites.
fn plain(set: &[String]) -> String {
    if set.is_empty() {
        return "no answer".to_owned();
    }
    let mut names: Vec<&str> = set.iter().map(|e| crate::label::name_of(e)).collect();
    names.sort_unstable();
    names.dedup();
    names.join(" + ")
}

fn alarms(cases: &[Case], dirty: bool) -> Alarms {
    let of: Vec<Alarm> = cases
        .iter()
        .filter(|c| c.dirty == dirty)
        .filter_map(|c| c.alarm)
        .collect();
    let share = |wanted: Alarm| Share::of(of.iter().map(|a| *a == wanted));
    Alarms {
        effect: share(Alarm::Effect),
        unknown: share(Alarm::Unknown),
        apart: share(Alarm::Apart),
    }
}

fn power(cases: &[&Case]) -> Vec<Power> {
    let mut all = Vec::new();
    for (i, &low) in EDGES.iter().enumerate() {
        let high = EDGES.get(i + 1).copied();
        let inside = |c: &&&Case| {
            let gap = c.cause_gap;
            !["none", "unknown"].contains(&c.kind)
                && c.names()
                && gap > low
                && high.is_none_or(|high| gap <= high)
        };
        let some: Vec<&&Case> = cases.iter().filter(inside).collect();
        if some.is_empty() {
            continue;
        }
        let said_something = |c: &&&Case| !c.verdict.is_empty() && c.verdict != ["none"];
        all.push(Power {
            gap: (low, high),
            mean_gap: some.iter().map(|c| c.cause_gap).sum::<f64>() / some.len() as f64,
            noticed: Share::of(some.iter().map(said_something)),
            right: Share::of(some.iter().map(|c| c.standing.is_right())),
        });
    }
    all
}

fn confusion(cases: &[Case]) -> BTreeMap<String, BTreeMap<String, usize>> {
    let mut counts: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for c in cases {
        let said = if c.standing.is_right() {
            &c.truth
        } else {
            &c.verdict
        };
        let row = counts.entry(c.cause.clone()).or_default();
        *row.entry(plain(said)).or_default() += 1;
    }
    counts
}

impl Score {
    /// Computes the figures of some cases; `left_out` holds the cases without figures, with the
    /// reason.
    #[must_use]
    pub fn of(method: &str, answers: Vec<Case>, left_out: BTreeMap<String, String>) -> Self {
        let counted: Vec<&Case> = answers.iter().filter(|c| c.standing.counts()).collect();
        let n = counted.len().max(1) as f64;
        let count = |f: &dyn Fn(&Case) -> bool| counted.iter().filter(|c| f(c)).count();
        let mut frequency: BTreeMap<&str, f64> = BTreeMap::new();
        for c in &counted {
            *frequency.entry(&c.cause).or_default() += 1.0 / n;
        }
        let logs: Vec<f64> = counted
            .iter()
            .filter(|c| c.names())
            .map(|c| c.true_probability.max(FLOOR).ln())
            .collect();
        let said = |c: &&&Case| c.standing != Standing::NoAnswer && c.names();
        let answered = || counted.iter().filter(said);
        let stated: Vec<(f64, bool)> = answered().map(|c| (c.probability, c.claims_hold)).collect();
        let squares: Vec<f64> = stated
            .iter()
            .map(|(p, t)| (p - f64::from(u8::from(*t))).powi(2))
            .collect();
        let memory = answers.iter().filter_map(|c| c.memory_mib);
        let f1 = |of: &dyn Fn(&Case) -> Option<f64>| {
            let values: Vec<f64> = answers.iter().filter_map(of).collect();
            Figure::mean(&values)
        };
        let wired = answers.iter().map(|c| &c.wiring);
        let found = wired
            .clone()
            .flat_map(|w| (0..w.faults).map(|i| i < w.found));
        Self {
            schema: 1,
            method: method.to_owned(),
            cases: counted.len(),
            right: count(&|c| c.standing.is_right()),
            top2: count(&|c| c.top2),
            covered: count(&|c| c.covered),
            rows: row::rows(&counted),
            clean_alarms: alarms(&answers, false),
            dirty_alarms: alarms(&answers, true),
            unknowns: Share::of(
                counted
                    .iter()
                    .filter(|c| c.kind == "unknown" && c.names())
                    .map(|c| c.standing.is_right()),
            ),
            log_score: Figure::mean(&logs),
            base_log_score: counted
                .iter()
                .map(|c| frequency[&*c.cause].ln())
                .sum::<f64>()
                / n,
            brier: Figure::mean(&squares),
            calibration: Calibration::of(&stated),
            localization_signals: f1(&|c| c.localization.signals),
            localization_regimes: f1(&|c| c.localization.regimes),
            wiring: WiringScore {
                found: Share::of(found),
                false_alarms: Share::of(wired.map(|w| w.false_alarms > 0)),
            },
            effect_values: Errors::of(answers.iter().flat_map(|c| &c.effect_values)),
            parameters: Errors::of(answers.iter().flat_map(|c| &c.parameters)),
            power: power(&counted),
            confusion: confusion(&answers),
            slowest: answers.iter().map(|c| c.seconds).fold(0.0, f64::max),
            largest_memory_mib: memory
                .fold(None, |a: Option<f64>, m| Some(a.map_or(m, |a| a.max(m)))),
            left_out,
            answers,
        }
    }
}
