//! How the gap divides among causes, what remains beside the verdict, and what these logs could
//! have shown at all.

use asid_results::diagnosis::{Calibration, DetectionLimit, DiagnosisResult, Remainder, Shares};

use super::words::{joined, percent, probability, set};
use crate::number::{quantity, round};
use crate::page::{Column, Section, Table};
use crate::plot::{Axis, Colour, Ranked, Ranking};

pub(super) fn section(d: &DiagnosisResult) -> Option<Section> {
    let shares = d.gap.shares.as_ref();
    if shares.is_none() && d.detection_limits.is_empty() && d.calibration.is_none() {
        return None;
    }
    let mut section = Section::new("What is left, and what could have been seen");
    if let Some(shares) = shares {
        section = section.figures(vec![figure(shares)]);
    }
    if let Some(remainder) = &d.verdict.remainder {
        section = section.text(told(remainder));
    }
    if !d.detection_limits.is_empty() {
        let seen = d.detection_limits.iter().filter(|l| l.value.is_finite());
        let summary = format!(
            "Detection limits: the smallest value that these logs could have shown, for {} of {} parameters of effects",
            seen.count(),
            d.detection_limits.len()
        );
        let lead = "Recognised: the share of logs drawn with twice that value whose screening ranks the effect first.";
        let table = Section::new("")
            .lead(lead)
            .table(limits(&d.detection_limits));
        section = section.folded(summary, table);
    }
    if let Some(calibration) = &d.calibration {
        section = section
            .heading("The same diagnosis of simulated logs")
            .text(summed(calibration))
            .table(rehearsed(calibration));
    }
    Some(section)
}

/// Text on the answer's calibration by simulated logs.
fn summed(c: &Calibration) -> String {
    let mut text = format!(
        "The model played the commands of the logs {} times, with nothing missing and with each of the leading explanations, and the \
         readings, with the sensors' noise, were diagnosed in place of the real ones.",
        c.runs
    );
    if let Some(p) = c.probability {
        text.push_str(&format!(
            " By Bayes' rule over these runs the answer above is right with probability {}.",
            percent(p)
        ));
    }
    if let Some(p) = c.p_no_gap {
        text.push_str(&format!(
            " A machine that lacks nothing shows as large a gap with probability {} at most.",
            percent(p)
        ));
    }
    text
}

fn rehearsed(c: &Calibration) -> Table {
    let columns = vec![
        Column::prose("the simulated machine lacks"),
        Column::number("runs"),
        Column::number("right"),
        Column::number("none"),
        Column::number("unknown"),
        Column::number("other effects"),
        Column::number("probability stated"),
    ];
    c.rows.iter().fold(Table::new(columns), |table, r| {
        let lacks = if r.effects.is_empty() {
            "nothing".to_owned()
        } else {
            set(&r.effects)
        };
        let counts = [r.runs, r.right, r.none, r.unknown, r.other].map(|n| n.to_string().into());
        let mut row = vec![lacks.into()];
        row.extend(counts);
        row.push(probability(r.probability).into());
        table.row(row)
    })
}

/// A remainder as a sentence.
fn told(r: &Remainder) -> String {
    let most = format!(
        "Beside the verdict {} of the squared gap above the noise floor is left, most of it at {}.",
        percent(r.share),
        r.place
    );
    if r.against.is_empty() {
        return format!(
            "{most} No variable that was looked at (time, commands, and the position, speed, acceleration and load there) predicts as much as 5 % of it."
        );
    }
    let kinds = match &r.kinds[..] {
        [] => String::new(),
        kinds => format!(": it is {}", joined(kinds, "or")),
    };
    format!("{most} It goes with the {}{kinds}.", r.against)
}

fn figure(shares: &Shares) -> crate::page::Figure {
    let row =
        |name: &str, share: f64, colour| Ranked::new(name, share, percent(share)).colour(colour);
    let caption = "Shares of the squared gap above the noise floor. Named: closed by the verdict's effects. Learnable: left by them, and \
                   foretold by a regression on position, speed, load and time, of episodes that it was not fitted to. Not learnable: neither; \
                   chance, or a cause that none of these variables shows.";
    let plot = Ranking::new(
        "How the gap is shared out",
        Axis::new("share", "").domain([0.0, 1.0]),
    )
    .rows(vec![
        row("named", shares.named, Colour::Blue),
        row("learnable", shares.learnable, Colour::Ochre),
        row("not learnable", shares.unrepeatable, Colour::Muted),
    ])
    .description(caption);
    crate::page::Figure::new("What the gap is made of", plot, caption)
}

fn limits(limits: &[DetectionLimit]) -> Table {
    let columns = vec![
        Column::text("effect"),
        Column::text("parameter"),
        Column::number("seen from"),
        Column::number("recognised"),
        Column::text("else taken for"),
    ];
    limits.iter().fold(Table::new(columns), |table, l| {
        let value = if l.value.is_finite() {
            quantity(&round(l.value, 4), &l.unit)
        } else {
            "not seen".to_owned()
        };
        table.row(vec![
            l.effect.clone().into(),
            l.parameter.clone().into(),
            value.into(),
        ])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remainder_says_where_it_is_and_with_what_it_goes() {
        let mut r = Remainder {
            share: 0.25,
            place: "elbow".into(),
            against: "speed".into(),
            kinds: vec!["friction-like".into(), "drag-like".into()],
        };
        let text = told(&r);
        assert!(
            text.contains("at elbow")
                && text.contains("the speed: it is friction-like or drag-like")
        );
        r.against.clear();
        assert!(told(&r).contains("No variable that was looked at"));
    }
}
