//! The ranking of effect sets by evidence, and which of the leading effects these logs can
//! distinguish.

use asid_results::diagnosis::{DiagnosisResult, Isolability, RankedSet};

use super::words::set;
use crate::number::significant;
use crate::page::Figure;
use crate::plot::{Axis, Colour, Heat, Ranked, Ranking};

/// Number of sets that are shown.
const MOST: usize = 12;
/// Least evidence of a set that is shown, natural logarithm: below it the evidence is against the
/// set.
const LEAST: f64 = 0.0;

/// The pictures.
pub(super) fn figures(d: &DiagnosisResult) -> Vec<Figure> {
    let ranking = (!d.ranking.is_empty()).then(|| ranking(d));
    let table = d.isolability.as_ref().filter(|i| i.effects.len() > 1);
    ranking.into_iter().chain(table.map(isolability)).collect()
}

/// Whether two sets hold the same effects.
fn same(a: &[String], b: &[String]) -> bool {
    a.len() == b.len() && a.iter().all(|x| b.contains(x))
}

fn ranking(d: &DiagnosisResult) -> Figure {
    let row = |r: &RankedSet| {
        let value = r.fitted.or(r.screened).unwrap_or(f64::NAN);
        let note = match (r.fitted, r.screened) {
            (Some(_), Some(s)) => format!("fitted; {} in the screening", significant(s, 3)),
            (Some(_), None) => "fitted".to_owned(),
            _ => "screening only".to_owned(),
        };
        let row = Ranked::new(set(&r.effects), value, significant(value, 3)).note(note);
        if same(&r.effects, &d.verdict.effects) {
            row.colour(Colour::Blue).strong()
        } else if d.verdict.ambiguous_with.iter().any(|s| same(s, &r.effects)) {
            row.colour(Colour::Purple)
        } else if r.fitted.is_some() {
            row.colour(Colour::Ochre)
        } else {
            row
        }
    };
    let alike = if d.verdict.ambiguous_with.is_empty() {
        ""
    } else {
        " Purple: sets that these data cannot tell from the verdict."
    };
    let caption = format!(
        "Natural logarithm of the Bayes factor of each set of effects, against the model without effects, on the training logs. \
         It is a marginal likelihood: a parameter that the logs do not need lowers it. Blue: the verdict.{alike} Ochre: other sets that were fitted. Grey: sets that were \
         screened only, by a linear approximation. Among a hundred wrong candidates the best reaches 3 to 5 by chance."
    );
    let for_it = |r: &&RankedSet| r.fitted.or(r.screened).is_some_and(|e| e > LEAST);
    let shown = d.ranking.iter().filter(for_it).take(MOST);
    let plot = Ranking::new(
        "Evidence for each set",
        Axis::new("evidence, natural logarithm", ""),
    )
    .rows(shown.map(row))
    .description(caption.clone());
    Figure::new("How the explanations rank", plot, caption)
}

fn isolability(table: &Isolability) -> Figure {
    let cells = |f: &dyn Fn(f64) -> f64| -> Vec<Vec<f64>> {
        let rows = table.angles.iter();
        rows.map(|row| row.iter().map(|a| f(*a)).collect())
            .collect()
    };
    let degrees = cells(&f64::to_degrees);
    let texts = degrees.iter().map(|row| {
        let told = row.iter().map(|a| format!("{:.0}", a.abs()));
        told.collect()
    });
    let caption = "Angle in degrees between what two effects would add to the readings of these logs, once the study's own parameters \
                   have taken what they can. Near 0 (dark) these motions cannot tell the two effects apart, and only others can; at 90 degrees \
                   they tell them apart fully. The most evident effects of the first screening, best first.";
    let plot = Heat::new(
        "Principal angles between effects",
        table.effects.clone(),
        cells(&|angle| 1.0 - angle / std::f64::consts::FRAC_PI_2),
        texts.collect(),
    )
    .description(caption);
    Figure::new("Which effects these logs tell apart", plot, caption)
}
