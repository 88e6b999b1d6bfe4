//! Where the gap lies: by signal and regime of motion, and on a map.

use asid_results::diagnosis::{DiagnosisResult, Where};
use asid_results::trace::{DiagnosisTrace, Map};

use super::words::percent;
use crate::page::{Figure, Section};
use crate::plot::{Axis, Colour, Outline, Plan, Ranked, Ranking};

/// Number of places that are shown individually.
const MOST: usize = 12;

/// Number of points of the map that are drawn.
const POINTS: usize = 2500;

/// Residuals at which the colour of a point changes, in units of the noise.
const STEPS: [f64; 3] = [2.0, 5.0, 20.0];

pub(super) fn section(d: &DiagnosisResult, t: &DiagnosisTrace) -> Section {
    let section = Section::new("Where the gap lies").lead(
        "Which signals, in which regime of motion, account for the gap of the identified model. Shares are of the squared \
         residual above the noise, on the training logs, before any effect is added.",
    );
    let map = t.map.as_ref().filter(|m| !m.points.is_empty());
    if d.places.is_empty() && map.is_none() {
        return section.note(if d.gap.identified <= 1.05 {
            "Nothing to share out: no residual stands out of the noise."
        } else {
            "The diagnosis kept no shares."
        });
    }
    let mut section = section;
    if !d.places.is_empty() {
        section = section.figures(vec![shares(&d.places)]);
    }
    match map {
        Some(map) => section.figures(vec![plan(map)]),
        None => section,
    }
}

fn shares(places: &[Where]) -> Figure {
    let mut rows: Vec<Ranked> = places.iter().take(MOST).map(row).collect();
    if let Some(rest) = places.get(MOST..).filter(|r| !r.is_empty()) {
        let share = rest.iter().map(|p| p.share).filter(|s| s.is_finite()).sum();
        let name = match rest.len() {
            1 => "one more".to_owned(),
            n => format!("{n} more together"),
        };
        rows.push(Ranked::new(name, 100.0 * share, percent(share)));
    }
    let caption = "Signal and regime; below them, the condition found in the data. Shares of the excess squared residual; together 100 %.";
    let ranking = Ranking::new(
        "Share of the gap by signal and regime",
        Axis::new("share of the gap", "%"),
    )
    .rows(rows)
    .description(caption);
    Figure::new(
        "Where the gap is: by signal and regime of motion",
        ranking,
        caption,
    )
}

fn row(place: &Where) -> Ranked {
    let name = match (&*place.signal, &*place.regime) {
        (signal, "") => signal.to_owned(),
        ("", regime) => regime.to_owned(),
        (signal, regime) => format!("{signal}, {regime}"),
    };
    let row =
        Ranked::new(name, 100.0 * place.share, percent(place.share)).colour(Colour::Vermillion);
    match &place.condition {
        None => row,
        Some(condition) => row.note(format!("where {condition}")),
    }
}

fn plan(map: &Map) -> Figure {
    let caption = "Each dot is one reading of the held-out episodes at its place; its colour tells how far the identified model is off there, \
                   in units of the noise. Errors of an open-loop replay add up: look for where they begin rather than where they are largest.";
    let stride = map.points.len().div_ceil(POINTS);
    let points: Vec<&[f64; 3]> = map
        .points
        .iter()
        .step_by(stride.max(1))
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    let [x, y] = &map.axes;
    let mut plan = Plan::new(
        "Residual by place",
        Axis::new(x, &map.unit),
        Axis::new(y, &map.unit),
    )
    .description(caption);
    // Draw the worst last, on top of the others.
    let colours = [Colour::Cool, Colour::Warm, Colour::Hot, Colour::Fierce];
    for (i, colour) in colours.into_iter().enumerate() {
        let here: Vec<[f64; 2]> = (points.iter())
            .filter(|p| STEPS.iter().filter(|s| p[2].abs() >= **s).count() == i)
            .map(|p| [p[0], p[1]])
            .collect();
        let label = match i {
            0 => format!("under {} × noise", STEPS[0]),
            3 => format!("over {}", STEPS[2]),
            i => format!("{} to {}", STEPS[i - 1], STEPS[i]),
        };
        if !here.is_empty() {
            plan = plan.outline(Outline::spots(here).colour(colour).label(label));
        }
    }
    Figure::new("On the map", plan, caption)
}
