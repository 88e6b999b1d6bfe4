//! The top of the page: the answer and the key figures.

use asid_results::diagnosis::{DiagnosisResult, Kind};
use asid_results::trace::DiagnosisTrace;

use super::words::{count, found, gap, joined, percent, probability, set};
use crate::number::round;
use crate::page::{Page, Tile, Tone};

pub(super) fn page(d: &DiagnosisResult, t: &DiagnosisTrace) -> Page {
    let title = if d.study.is_empty() {
        "Diagnosis"
    } else {
        &d.study
    };
    let (badge, tone) = badge(d);
    let mut page = Page::new(title)
        .kicker("ASID diagnose: where simulation departs from reality, and why")
        .badge(badge, tone)
        .answer(answer(d));
    if !t.engine.is_empty() {
        page = page.fact("simulator", t.engine.clone());
    }
    let failed: Vec<String> = (d.checks.iter().filter(|c| !c.ok))
        .map(|c| c.check.clone())
        .collect();
    if !failed.is_empty() {
        page = page.fact(
            "read with care",
            format!("not all checks passed: {}", joined(&failed, "and")),
        );
    }
    tiles(d, t).into_iter().fold(page, Page::tile)
}

fn badge(d: &DiagnosisResult) -> (&'static str, Tone) {
    match d.verdict.kind {
        Kind::None => ("no effect missing", Tone::Good),
        Kind::Effects if d.verdict.ambiguous_with.is_empty() => ("cause found", Tone::Good),
        Kind::Effects => ("cause narrowed down", Tone::Fair),
        Kind::Unknown => ("cause unknown", Tone::Bad),
    }
}

fn answer(d: &DiagnosisResult) -> String {
    if !d.sentence.is_empty() {
        return d.sentence.clone();
    }
    match d.verdict.kind {
        Kind::None => "No effect was found missing.".to_owned(),
        Kind::Effects => format!("The simulation lacks {}.", joined(&found(d), "and")),
        Kind::Unknown => {
            "The simulation lacks something that no effect of the catalogue is.".to_owned()
        }
    }
}

fn tiles(d: &DiagnosisResult, t: &DiagnosisTrace) -> Vec<Tile> {
    let gaps = [d.gap.nominal, d.gap.identified, d.gap.refined];
    let shown = if refined(d) { &gaps[..] } else { &gaps[..2] };
    let names = if refined(d) {
        "nominal → identified → refined"
    } else {
        "nominal → identified"
    };
    let text: Vec<String> = shown.iter().map(|g| gap(*g)).collect();
    let mut tiles = vec![
        Tile::new("gap, in units of the noise", &text.join(" → "))
            .note(format!("{names}; 1 is as good as the sensors allow")),
    ];
    tiles.push(closed(d));
    let rivals = match d.verdict.ambiguous_with.len() {
        0 => String::new(),
        n => format!("{} cannot be told from it", count(n, "other explanation")),
    };
    let verdict = match d.verdict.kind {
        Kind::None => "that nothing is missing".to_owned(),
        Kind::Effects => format!("of {}", set(&found(d))),
        Kind::Unknown => "that the cause is not in the catalogue".to_owned(),
    };
    let note = if rivals.is_empty() {
        verdict
    } else {
        format!("{verdict}; {rivals}")
    };
    tiles.push(
        Tile::new(
            "probability of the verdict",
            &probability(d.verdict.probability),
        )
        .note(note),
    );
    if t.held_out > 0 {
        let note = if t.fitted_to > 0 {
            format!(
                "every gap is measured on these; the models are fitted to {} others",
                t.fitted_to
            )
        } else {
            "every gap is measured on these; no fit saw them".to_owned()
        };
        tiles.push(Tile::new("held out", &count(t.held_out, "episode")).note(note));
    }
    tiles
}

fn closed(d: &DiagnosisResult) -> Tile {
    let Some(closed) = d.gap.closed.filter(|c| c.is_finite()) else {
        let why = if d.gap.identified <= 1.05 {
            "no gap is left once the study's parameters are fitted"
        } else {
            "not known"
        };
        return Tile::new("gap closed", "–").note(why);
    };
    let tone = match closed {
        c if !refined(d) || c.is_nan() => Tone::Plain,
        c if c >= 0.8 => Tone::Good,
        c if c >= 0.4 => Tone::Fair,
        _ => Tone::Bad,
    };
    let note = d
        .gap
        .closed_interval95
        .filter(|i| i.iter().all(|x| x.is_finite()));
    let note = note.map_or_else(
        || "of what is above the noise floor, squared".to_owned(),
        |[low, high]| {
            let [low, end] = [low, high].map(|x| round((100.0 * x).round(), 3));
            if low == end {
                return "of the squared gap above the floor".to_owned();
            }
            format!(
                "95 % interval {low} to {}; of the squared gap above the floor",
                percent(high)
            )
        },
    );
    Tile::new("gap closed", &percent(closed))
        .note(note)
        .tone(tone)
}

/// Whether there is a refined model that differs from the identified one.
pub(super) fn refined(d: &DiagnosisResult) -> bool {
    !found(d).is_empty() || (d.gap.refined - d.gap.identified).abs() > 1e-9
}
