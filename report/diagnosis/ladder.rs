//! How far each step and each single effect reduces the gap.

use asid_results::diagnosis::DiagnosisResult;
use asid_results::trace::DiagnosisTrace;

use super::head::refined;
use super::words::{found, gap, set};
use crate::number::{quantity, significant};
use crate::page::{Cell, Column, Figure, Section, Table};
use crate::plot::{Axis, Colour, Ranked, Ranking, Spacing};

/// Number of single effects that are shown.
const MOST: usize = 16;

/// Ratio of the largest to the smallest gap above which the axis is logarithmic.
const DECADES: f64 = 8.0;

pub(super) fn section(d: &DiagnosisResult, t: &DiagnosisTrace) -> Section {
    let lead = "Gap: root mean square of real minus simulated over all readings of the held-out episodes, each divided by its \
                sensor's noise. At 1 the simulation is as good as the sensors allow. Nominal is the model as given; identified after \
                fitting only the study's own parameters; refined with the verdict's effects added.";
    let section = Section::new("How far the gap closes")
        .lead(lead)
        .figures(vec![figure(d, t)]);
    if d.gap.signals.is_empty() {
        section
    } else {
        section.table(by_signal(d))
    }
}

fn figure(d: &DiagnosisResult, t: &DiagnosisTrace) -> Figure {
    let found = found(d);
    // The verdict's own rung is the refined model.
    let mut singles: Vec<(&str, f64)> = (t.ladder.iter())
        .filter(|r| found != [r.label.clone()])
        .map(|r| (&*r.label, r.gap))
        .collect();
    singles.sort_by(|a, b| a.1.total_cmp(&b.1));
    let left_out = singles.len().saturating_sub(MOST);
    singles.truncate(MOST);
    singles.reverse();

    let step = |name: &str, value: f64, colour| {
        Ranked::new(name, value, gap(value)).colour(colour).strong()
    };
    let mut rows = vec![
        step("nominal", d.gap.nominal, Colour::Muted).note("the model as given"),
        step("identified", d.gap.identified, Colour::Vermillion).note("its own parameters fitted"),
    ];
    rows.extend(singles.iter().map(|(label, value)| {
        let rival = d
            .verdict
            .ambiguous_with
            .iter()
            .any(|set| set == &[(*label).to_owned()]);
        let row = Ranked::new(format!("with {label}"), *value, gap(*value));
        if rival {
            row.colour(Colour::Purple)
        } else {
            row.colour(Colour::Ochre)
        }
    }));
    if refined(d) {
        let note = if found.is_empty() {
            "the best that was found".to_owned()
        } else {
            format!("with {}", set(&found))
        };
        rows.push(step("refined", d.gap.refined, Colour::Blue).note(note));
    }

    let values = (t.ladder.iter().map(|r| r.gap))
        .chain([d.gap.nominal, d.gap.identified, d.gap.refined])
        .filter(|g| g.is_finite() && *g > 0.0);
    let [low, high] = values.fold([1.0f64, 1.0f64], |[l, h], g| [l.min(g), h.max(g)]);
    let log = high / low > DECADES;
    let axis = Axis::new("gap, in units of the noise", "");
    let ranking = Ranking::new(
        "Gap of each model",
        if log {
            axis.spacing(Spacing::Log)
        } else {
            axis
        },
    )
    .base(if log { 1.0 } else { 0.0 })
    .reference(1.0, "noise floor")
    .rows(rows);
    let mut caption = "Shorter is better".to_owned();
    if log {
        caption.push_str("; the axis is logarithmic and bars start at the noise floor");
    }
    caption.push('.');
    if !singles.is_empty() {
        caption.push_str(" Between: each effect that was tried alone to the end");
        if left_out > 0 {
            caption.push_str(&format!(" (the best {MOST}, {left_out} more were worse)"));
        }
        caption.push('.');
        if !d.verdict.ambiguous_with.is_empty() {
            caption.push_str(" Purple: what these data cannot tell from the verdict.");
        }
    }
    Figure::new(
        if refined(d) {
            "Gap of each model: nominal, identified, with one effect, refined"
        } else {
            "Gap of each model: nominal, identified, with one effect"
        },
        ranking.description(caption.clone()),
        caption,
    )
}

fn by_signal(d: &DiagnosisResult) -> Table {
    let mut columns = vec![
        Column::text("sensor"),
        Column::number("nominal"),
        Column::number("identified"),
    ];
    if refined(d) {
        columns.push(Column::number("refined"));
    }
    let table = Table::new(columns).caption("The same gaps, sensor by sensor.");
    d.gap.signals.iter().fold(table, |table, s| {
        let mut row = vec![Cell::from(s.signal.clone()).note(format!(
            "noise {}",
            quantity(&significant(s.noise, 2), &s.unit)
        ))];
        let gaps = [s.nominal, s.identified, s.refined];
        row.extend(gaps.map(|g| gap(g).into()));
        table.row(row)
    })
}
