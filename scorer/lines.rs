//! The scoreboard on the terminal.

use crate::board::{Row, Score};
use crate::statistics::{Figure, Share};

/// Width of the names of rows and causes; longer names are cut.
const NAME: usize = 40;

fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    text.chars().take(width - 1).chain(['…']).collect()
}

/// A share in percent, with its interval.
#[must_use]
pub fn percent(share: &Share) -> String {
    match (share.value(), share.interval95) {
        (Some(value), Some([low, high])) => {
            let [value, low, high] = [value, low, high].map(|x| 100.0 * x);
            format!("{value:.0} % ({low:.0} to {high:.0})")
        }
        _ => "-".to_owned(),
    }
}

/// A figure with its interval, times `scale`.
#[must_use]
pub fn figure(of: Option<&Figure>, scale: f64, decimals: usize) -> String {
    of.map_or_else(
        || "-".to_owned(),
        |f| {
            let [low, high] = f.interval95.map(|x| scale * x);
            let value = scale * f.value;
            format!("{value:.decimals$} ({low:.decimals$} to {high:.decimals$})")
        },
    )
}

/// All scores of one set of cases: the first in full, then one line per method.
#[must_use]
pub fn lines(scores: &[Score]) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(score) = scores.first() {
        lines.extend(cases(score));
        lines.push(String::new());
        lines.extend(rows(score));
        lines.push(String::new());
        lines.extend(summary(score));
    }
    if scores.len() > 1 {
        lines.push(String::new());
        lines.extend(methods(scores));
    }
    lines
}

fn cases(score: &Score) -> Vec<String> {
    let mut lines = vec![format!(
        "{:10} {:13} {:8} {:NAME$} {:NAME$} {:>5} {:>5} {:>3} {:>7} {:>6} {:>6}",
        "case", "machine", "", "truth", "verdict", "p", "true", "set", "closed", "s", "MiB"
    )];
    for c in &score.answers {
        let closed = c.physics.gaps.and_then(|g| g.closed_of_possible);
        let said = c.failure.clone().unwrap_or_else(|| c.verdict.join(" + "));
        let line = format!(
            "{:10} {:13} {:8} {:NAME$} {:NAME$} {:5.2} {:5.2} {:3} {:>7} {:6.1} {:>6}",
            c.case,
            cut(&c.world, 13),
            c.standing.word(),
            cut(&c.truth.join(" + "), NAME),
            cut(&said, NAME),
            c.probability,
            c.true_probability,
            c.set_size,
            closed.map_or_else(|| "-".into(), |x| format!("{x:.2}")),
            c.seconds,
            c.memory_mib
                .map_or_else(|| "-".into(), |m| format!("{m:.0}")),
        );
        lines.push(line);
    }
    let left_out = score.left_out.iter();
    lines.extend(left_out.map(|(case, why)| format!("{case:10} left out: {why}")));
    lines
}

fn row(row: &Row) -> String {
    let count = |s: &Share| {
        if s.of == 0 {
            "-".to_owned()
        } else {
            s.count.to_string()
        }
    };
    let size = |s: Option<f64>| s.map_or_else(|| "-".into(), |s| format!("{s:.1}"));
    format!(
        "{:NAME$} {:>5} {:>18} {:>5} {:>7} {:>6} {:>5} {:>4} {:>7} {:>7}",
        cut(&row.name, NAME),
        row.cases,
        percent(&row.right),
        count(&row.top2),
        count(&row.covered),
        row.unanswered.count,
        row.true_probability
            .map_or_else(|| "-".into(), |p| format!("{:.2}", p.value)),
        size(row.set_size),
        row.closed
            .map_or_else(|| "-".into(), |c| format!("{:.2}", c.value)),
        size(row.seconds),
    )
}

fn head(first: &str) -> String {
    format!(
        "{first:NAME$} {:>5} {:>18} {:>5} {:>7} {:>6} {:>5} {:>4} {:>7} {:>7}",
        "cases", "right", "top 2", "covered", "no ans", "true", "set", "closed", "s"
    )
}

fn rows(score: &Score) -> Vec<String> {
    let mut lines = Vec::new();
    let mut by = "";
    for r in &score.rows {
        if r.by != by {
            by = r.by;
            lines.push(head(&format!("by {by}")));
        }
        lines.push(row(r));
    }
    lines
}

/// One line per method.
fn methods(scores: &[Score]) -> Vec<String> {
    let all = scores.iter().filter_map(|s| {
        let all = s.rows.first()?;
        let named = Row {
            name: s.method.clone(),
            ..all.clone()
        };
        Some(row(&named))
    });
    std::iter::once(head("by method")).chain(all).collect()
}

fn summary(s: &Score) -> Vec<String> {
    let c = &s.calibration;
    let mut lines = vec![
        format!(
            "right {} of {}, in the two most probable {}, covered by the ambiguity set {}",
            s.right, s.cases, s.top2, s.covered
        ),
        format!(
            "false alarms: clean {} (unknown {}), dirty {} (unknown, counted apart, {}); unknowns found {}",
            s.clean_alarms.effect.text(),
            s.clean_alarms.unknown.count,
            s.dirty_alarms.effect.text(),
            s.dirty_alarms.apart.count,
            s.unknowns.text()
        ),
        format!(
            "log score {} (base rate {:.2}), Brier {}",
            figure(s.log_score.as_ref(), 1.0, 2),
            s.base_log_score,
            figure(s.brier.as_ref(), 1.0, 3)
        ),
        format!(
            "calibration error {:.3}; a calibrated answer would show {:.3} at this number of cases, and at most {:.3} in 19 of 20",
            c.error, c.error_of_chance, c.error_of_chance95
        ),
        format!(
            "where: F1 of columns {}, of columns and regimes {}",
            figure(s.localization_signals.as_ref(), 1.0, 2),
            figure(s.localization_regimes.as_ref(), 1.0, 2)
        ),
        format!(
            "median error of effect values {} %, intervals that hold the truth {}",
            figure(s.effect_values.error.as_ref(), 100.0, 1),
            percent(&s.effect_values.covered)
        ),
        format!(
            "median error of the study's parameters {} %, intervals that hold the truth {}",
            figure(s.parameters.error.as_ref(), 100.0, 2),
            percent(&s.parameters.covered)
        ),
        format!(
            "wiring faults found {}, cases with one that is not there {}",
            s.wiring.found.text(),
            s.wiring.false_alarms.text()
        ),
    ];
    let memory = s
        .largest_memory_mib
        .map_or_else(String::new, |m| format!(", largest memory {m:.0} MiB"));
    lines.push(format!("slowest {:.1} s{memory}", s.slowest));
    for p in &s.power {
        let to = p
            .gap
            .1
            .map_or_else(|| "on".to_owned(), |high| format!("to {high}"));
        lines.push(format!(
            "excess gap {} {to}: right {}, noticed {}",
            p.gap.0,
            percent(&p.right),
            p.noticed.text()
        ));
    }
    lines
}
