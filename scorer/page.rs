//! The scoreboard as a page.

mod pictures;
mod tables;

use asid_report::page::{Page, Section, Tile};

use crate::board::Score;
use crate::lines::percent;
use pictures::{machines, power, probabilities};
use tables::{cases, confusion, methods, part};

/// Facts of the page besides the scores.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// The call.
    pub command: String,
    /// Name and version of the engine.
    pub engine: String,
    /// Expected result of a control, in a check that was spoilt on purpose.
    pub control: Option<&'static str>,
    /// Time limit of each case, s.
    pub limit: Option<f64>,
}

/// The page of the scores on one set of cases; the first score is shown in full.
#[must_use]
pub fn page(scores: &[Score], about: &About) -> String {
    let Some(score) = scores.first() else {
        return Page::new("Withheld causes").html();
    };
    let mut page = Page::new("Withheld causes")
        .kicker("asid withheld")
        .answer(answer(score))
        .fact("engine", &*about.engine)
        .fact("cases", score.cases.to_string())
        .fact(
            "limit",
            about
                .limit
                .map_or_else(|| "none".into(), |l| format!("{l} s a case")),
        );
    if let Some(control) = about.control {
        page = page.lead(format!("A control, which must fail: {control}."));
    }
    page = tiles(page, score);
    if scores.len() > 1 {
        page = page.section(methods(scores));
    }
    page = page.section(machines(score));
    if !score.power.is_empty() {
        page = page.section(power(score));
    }
    page = page.section(probabilities(score)).section(confusion(score));
    for (by, title) in [
        ("world", "Clean and dirty worlds"),
        ("cause", "Causes"),
        ("magnitude", "Magnitudes"),
        ("fault", "Faults of logs and wiring"),
    ] {
        if score.rows.iter().any(|r| r.by == by) {
            page = page.section(part(score, by, title));
        }
    }
    page.section(cases(score))
        .section(Section::new("Again").command(&*about.command))
        .html()
}

fn answer(score: &Score) -> String {
    let interval = score
        .rows
        .first()
        .map_or_else(String::new, |r| percent(&r.right));
    format!(
        "{} of {} cases are right: {interval}.",
        score.right, score.cases
    )
}

fn tiles(page: Page, s: &Score) -> Page {
    let mut page = page;
    let log = s
        .log_score
        .map_or_else(|| "-".into(), |l| format!("{:.2}", l.value));
    let closed = s.rows.first().and_then(|r| r.closed);
    for (label, value, note) in [
        (
            "among the two most probable",
            s.top2.to_string(),
            format!("of {}", s.cases),
        ),
        (
            "in the ambiguity set",
            s.covered.to_string(),
            format!("of {}", s.cases),
        ),
        (
            "false alarms, clean worlds",
            s.clean_alarms.effect.text(),
            format!("{} more say unknown", s.clean_alarms.unknown.count),
        ),
        (
            "false alarms, dirty worlds",
            s.dirty_alarms.effect.text(),
            format!("{} say unknown, counted apart", s.dirty_alarms.apart.count),
        ),
        ("unknowns found", s.unknowns.text(), String::new()),
        (
            "log score",
            log,
            format!("base rate {:.2}", s.base_log_score),
        ),
        (
            "closed of the possible",
            closed.map_or_else(|| "-".into(), |c| format!("{:.0} %", 100.0 * c.value)),
            "median".into(),
        ),
        (
            "slowest case",
            format!("{:.0} s", s.slowest),
            s.largest_memory_mib
                .map_or_else(String::new, |m| format!("at most {m:.0} MiB")),
        ),
    ] {
        page = page.tile(Tile::new(label, &value).note(note));
    }
    page
}
