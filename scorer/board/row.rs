//! One row of the scoreboard: a group of cases.

use std::collections::BTreeMap;

use serde::Serialize;

use super::EDGES;
use crate::case::Case;
use crate::judge::Standing;
use crate::statistics::{Figure, Share, median};

/// Figures of a group of cases.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The property that the cases share: `all`, `machine`, `world`, `cause`, `magnitude` or
    /// `fault`.
    pub by: &'static str,
    /// Value of that property.
    pub name: String,
    /// Number of cases.
    pub cases: usize,
    /// Right verdicts. This and the next two figures cover cases whose answer may name something.
    pub right: Share,
    /// Right, or a right set among the two most probable.
    pub top2: Share,
    /// Right, or a right set in the ambiguity set.
    pub covered: Share,
    /// Cases without an answer.
    pub unanswered: Share,
    /// Mean probability given to right sets.
    pub true_probability: Option<Figure>,
    /// Median size of the ambiguity sets, the verdict included.
    pub set_size: Option<f64>,
    /// Median of the closed share of what the true effects close.
    pub closed: Option<Figure>,
    /// Median wall time, s.
    pub seconds: Option<f64>,
}

impl Row {
    fn of(by: &'static str, name: &str, cases: &[&Case]) -> Self {
        let share = |f: &dyn Fn(&Case) -> bool| Share::of(cases.iter().map(|c| f(c)));
        let named = || cases.iter().filter(|c| c.names());
        let share_named = |f: &dyn Fn(&Case) -> bool| Share::of(named().map(|c| f(c)));
        let figures = |f: &dyn Fn(&Case) -> Option<f64>| -> Vec<f64> {
            cases.iter().filter_map(|c| f(c)).collect()
        };
        let closed = figures(&|c| c.physics.gaps.and_then(|g| g.closed_of_possible));
        let size = |c: &Case| (c.set_size > 0).then_some(c.set_size as f64);
        Self {
            by,
            name: name.to_owned(),
            cases: cases.len(),
            right: share_named(&|c| c.standing.is_right()),
            top2: share_named(&|c| c.top2),
            covered: share_named(&|c| c.covered),
            unanswered: share(&|c| c.standing == Standing::NoAnswer),
            true_probability: Figure::mean(&figures(&|c| c.names().then_some(c.true_probability))),
            set_size: median(&figures(&size)),
            closed: Figure::median(&closed),
            seconds: median(&figures(&|c| Some(c.seconds))),
        }
    }
}

/// Name of the bin of an excess gap.
fn magnitude(gap: f64) -> String {
    let above = EDGES.iter().rposition(|e| gap > *e).unwrap_or(0);
    match EDGES.get(above + 1) {
        Some(high) => format!("gap {} to {high}", EDGES[above]),
        None => format!("gap over {}", EDGES[above]),
    }
}

/// Clean or dirty, and the multiple of the gap of the dirt that the cause reaches.
fn world(c: &Case) -> String {
    match (c.dirty, c.kind) {
        (false, _) => "clean".into(),
        (true, "none") => "dirty, no cause".into(),
        (true, _) => format!("dirty, cause {} times", c.factor),
    }
}

/// All rows: all cases, then by machine, world, cause, magnitude and fault.
pub(super) fn rows(cases: &[&Case]) -> Vec<Row> {
    let mut rows = vec![Row::of("all", "all cases", cases)];
    type Keys<'a> = &'a dyn Fn(&Case) -> Vec<String>;
    let one = |name: &str| vec![name.to_owned()];
    let groups: [(&'static str, Keys<'_>); 5] = [
        ("machine", &|c| one(&c.world)),
        ("world", &|c| one(&world(c))),
        ("cause", &|c| one(&c.cause)),
        ("magnitude", &|c| {
            if ["none", "unknown"].contains(&c.kind) || c.cause_gap <= 0.0 {
                return Vec::new();
            }
            one(&magnitude(c.cause_gap))
        }),
        ("fault", &|c| {
            let all = c.log_faults.iter().chain(&c.wiring_faults);
            let all: Vec<String> = all.cloned().collect();
            if all.is_empty() { one("none") } else { all }
        }),
    ];
    for (by, keys) in groups {
        let mut parts: BTreeMap<String, Vec<&Case>> = BTreeMap::new();
        for c in cases {
            for key in keys(c) {
                parts.entry(key).or_default().push(c);
            }
        }
        let mut parts: Vec<(String, Vec<&Case>)> = parts.into_iter().collect();
        if by == "magnitude" {
            let least = |p: &(String, Vec<&Case>)| {
                p.1.iter()
                    .map(|c| c.cause_gap)
                    .fold(f64::INFINITY, f64::min)
            };
            parts.sort_by(|a, b| least(a).total_cmp(&least(b)));
        }
        rows.extend(parts.iter().map(|(name, part)| Row::of(by, name, part)));
    }
    rows
}
