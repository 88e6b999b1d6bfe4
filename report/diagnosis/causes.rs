//! The causes: probabilities, the verdict in words, and the effects with their values.

use asid_results::diagnosis::{DiagnosisResult, EffectResult, HypothesisResult, Kind};
use asid_results::trace::DiagnosisTrace;

use super::evidence;
use super::head::refined;
use super::words::{
    about, count, found, gap, hypothesis, joined, percent, probability, set, values,
};
use crate::markup::capitalise;
use crate::number::NOT_A_NUMBER;
use crate::page::{Cell, Column, Figure, Section, Table};
use crate::plot::{Axis, Colour, Ranked, Ranking};

/// Number of hypotheses that are shown individually.
const MOST: usize = 10;

/// Probability below which an effect outside every verdict is folded away.
const LITTLE: f64 = 0.01;

pub(super) fn section(d: &DiagnosisResult, t: &DiagnosisTrace) -> Section {
    let lead = "An effect is written name@site, the site being the part of the scene that it acts on. A hypothesis is a set of effects of the catalogue, refitted together with the study's parameters. The probability of a verdict that \
                names effects comes from a logistic regression on training worlds with known causes: by the odds of its evidence (marginal likelihood), by whether a gap is left, and by whether the search was cut short. \
                Its rivals share the rest by their evidence, and a part goes to `unknown`. The probability of an effect is the sum over the hypotheses that contain it.";
    let mut section = Section::new("Which effect").lead(lead);
    section = explanation(d, t).into_iter().fold(section, Section::text);
    section = section.figures(vec![figure(d)]);
    section = evidence::figures(d)
        .into_iter()
        .fold(section, |section, figure| section.figures(vec![figure]));
    let (shown, folded): (Vec<&EffectResult>, Vec<&EffectResult>) =
        d.effects.iter().partition(|e| matters(d, e));
    if !shown.is_empty() {
        section = section
            .heading("Each effect by itself")
            .table(table(t, &shown));
    }
    if !folded.is_empty() {
        let summary = count(folded.len(), "less probable effect");
        section = section.folded(summary, Section::new("").table(table(t, &folded)));
    }
    section
}

/// Whether an effect is probable, part of the verdict, or indistinguishable from it.
fn matters(d: &DiagnosisResult, effect: &EffectResult) -> bool {
    let label = effect.label();
    let sets = d.verdict.ambiguous_with.iter().chain([&d.verdict.effects]);
    effect.probability >= LITTLE || sets.flatten().any(|e| *e == label)
}

/// The verdict in words: one paragraph each on what it is and on what it leaves open.
fn explanation(d: &DiagnosisResult, t: &DiagnosisTrace) -> Vec<String> {
    let found = found(d);
    let sure = probability(d.verdict.probability);
    let mut first = match d.verdict.kind {
        Kind::None if !d.tolerances.is_empty() => format!(
            "No effect stands out (probability {sure}): with what tolerances allow of masses, lengths, friction and delays, and with the \
             study's own parameters fitted, the model predicts the held-out episodes to {} times the noise instead of {}.",
            gap(d.gap.refined),
            gap(d.gap.identified)
        ),
        Kind::None => format!(
            "No effect is missing (probability {sure}): with the study's own parameters fitted, the model predicts the held-out \
             episodes to {} times the noise.",
            gap(d.gap.identified)
        ),
        Kind::Effects => {
            let lacks = match d.verdict.probability {
                p if p >= 0.95 => "lacks",
                p if p >= 0.5 => "probably lacks",
                _ => "may lack",
            };
            let mut text = format!(
                "The simulation {lacks} {} (probability {sure}).",
                joined(&found, "and")
            );
            for effect in d.effects.iter().filter(|e| found.contains(&e.label())) {
                text.push_str(&described(t, effect, found.len() > 1));
            }
            text
        }
        Kind::Unknown => format!(
            "The gap is {} times the noise, and no effect of the catalogue explains enough of it to be named. The probability of this verdict, `unknown`, is \
             {sure}.",
            gap(d.gap.identified)
        ),
    };
    if d.verdict.kind == Kind::Unknown && refined(d) && !found.is_empty() {
        first.push_str(&format!(
            " The best that was found, {}, brings it to {}.",
            set(&found),
            gap(d.gap.refined)
        ));
    }
    if d.verdict.kind != Kind::None && d.verdict.unexplained.is_finite() {
        first.push_str(&format!(
            " {} of the squared gap above the noise, relative to that of the identified model, remains unexplained.",
            percent(d.verdict.unexplained)
        ));
    }
    let rivals: Vec<String> = d.verdict.ambiguous_with.iter().map(|s| set(s)).collect();
    let mut paragraphs = vec![first];
    if !rivals.is_empty() {
        let each = if rivals.len() == 1 {
            "once refitted, it predicts the same readings to within what the noise lets one see, so that either may be the cause"
        } else {
            "once refitted, each predicts the same readings to within what the noise lets one see, so that any may be the cause"
        };
        paragraphs.push(format!(
            "These data cannot tell it from {}: {each}.",
            joined(&rivals, "or")
        ));
    } else if d.verdict.kind == Kind::Effects {
        paragraphs.push(
            "No other explanation that was tried fits these data as well; the probabilities say how sure that is.".to_owned(),
        );
    }
    paragraphs
}

/// What an effect is and how strong, as a sentence with a space before it. It is named if there are
/// several.
fn described(t: &DiagnosisTrace, effect: &EffectResult, by_name: bool) -> String {
    let values = match &*values(t, effect) {
        "" => String::new(),
        values => format!("fitted: {values}"),
    };
    let parts = [capitalise(about(t, effect)), values];
    let told: Vec<String> = parts.into_iter().filter(|p| !p.is_empty()).collect();
    match (told.is_empty(), by_name) {
        (true, _) => String::new(),
        (false, true) => format!(" {}: {}.", effect.label(), told.join("; ")),
        (false, false) => format!(" {}.", capitalise(&told.join("; "))),
    }
}

fn figure(d: &DiagnosisResult) -> Figure {
    let special = |h: &HypothesisResult| matches!(&*hypothesis(h).0, "none" | "unknown");
    // `none` and `unknown` are always shown, however improbable.
    let shown = |(i, h): &(usize, &HypothesisResult)| *i < MOST || special(h);
    let all = || d.hypotheses.iter().enumerate();
    let mut rows: Vec<Ranked> = all().filter(shown).map(|(_, h)| row(d, h)).collect();
    let rest: Vec<&HypothesisResult> = all().filter(|h| !shown(h)).map(|h| h.1).collect();
    if !rest.is_empty() {
        let sum = rest
            .iter()
            .map(|h| h.probability)
            .filter(|p| p.is_finite())
            .sum();
        let name = match rest.len() {
            1 => "one other".to_owned(),
            n => format!("{n} others together"),
        };
        rows.push(Ranked::new(name, sum, probability(sum)));
    }
    let mut caption = "Together 1. Blue: the verdict".to_owned();
    if !d.verdict.ambiguous_with.is_empty() {
        caption.push_str("; purple: what these data cannot tell from it");
    }
    caption.push('.');
    let ranking = Ranking::new(
        "Probability of each hypothesis",
        Axis::new("probability", "").domain([0.0, 1.0]),
    )
    .rows(rows)
    .description(caption.clone());
    Figure::new("How probable each explanation is", ranking, caption)
}

fn row(d: &DiagnosisResult, h: &HypothesisResult) -> Ranked {
    let (name, note) = hypothesis(h);
    let verdict = match d.verdict.kind {
        Kind::None => name == "none",
        Kind::Unknown => name == "unknown",
        Kind::Effects => h.effects == d.verdict.effects,
    };
    let colour = if verdict {
        Colour::Blue
    } else if d.verdict.ambiguous_with.contains(&h.effects) {
        Colour::Purple
    } else {
        Colour::Muted
    };
    let row = Ranked::new(name, h.probability, probability(h.probability))
        .note(note)
        .colour(colour);
    if verdict { row.strong() } else { row }
}

fn table(t: &DiagnosisTrace, effects: &[&EffectResult]) -> Table {
    let columns = vec![
        Column::prose("effect"),
        Column::prose("fitted values"),
        Column::number("probability"),
        Column::number("closes alone"),
    ];
    effects.iter().fold(Table::new(columns), |table, e| {
        let values = match &*values(t, e) {
            "" => "–".to_owned(),
            values => values.to_owned(),
        };
        table.row(vec![
            Cell::from(e.label()).note(about(t, e)),
            values.into(),
            probability(e.probability).into(),
            e.gap_closed
                .map_or_else(|| NOT_A_NUMBER.to_owned(), percent)
                .into(),
        ])
    })
}
