//! How the gap is shared out, what is left beside the verdict, and what these logs could have shown at all.

use asid_results::diagnosis::{DetectionLimit, DiagnosisResult, Remainder, Shares};

use super::words::{joined, percent};
use crate::number::{quantity, round};
use crate::page::{Column, Section, Table};
use crate::plot::{Axis, Colour, Ranked, Ranking};

pub(super) fn section(d: &DiagnosisResult) -> Option<Section> {
    let shares = d.gap.shares.as_ref();
    if shares.is_none() && d.detection_limits.is_empty() {
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
            "The smallest value that these logs could have shown, of {} of {} effects and their parameters",
            seen.count(),
            d.detection_limits.len()
        );
        section = section.folded(summary, Section::new("").table(limits(&d.detection_limits)));
    }
    Some(section)
}

/// A remainder as a sentence.
fn told(r: &Remainder) -> String {
    let most = format!(
        "Beside the verdict {} of the squared gap above the noise floor is left, most of it at {}.",
        percent(r.share),
        r.place
    );
    if r.against.is_empty() {
        return format!("{most} It goes with nothing that these logs show.");
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
    ];
    limits.iter().fold(Table::new(columns), |table, l| {
        let value = if l.value.is_finite() {
            quantity(&round(l.value, 2), &l.unit)
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
        assert!(told(&r).ends_with("nothing that these logs show."));
    }
}
