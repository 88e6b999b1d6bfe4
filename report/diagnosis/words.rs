//! Texts for sets of effects, probabilities and shares.

use asid_results::diagnosis::{DiagnosisResult, EffectResult, HypothesisResult};
use asid_results::naming::grouped;
pub(super) use asid_results::naming::{count, joined};
use asid_results::trace::DiagnosisTrace;

use crate::number::{NOT_A_NUMBER, Precision, decimals, quantity, round, significant};

/// `a + b`, with the sites of one law grouped.
pub(super) fn set(effects: &[String]) -> String {
    grouped(effects).join(" + ")
}

/// A hypothesis by name, with an explanation where it is not an effect's name.
pub(super) fn hypothesis(hypothesis: &HypothesisResult) -> (String, &'static str) {
    match &hypothesis.effects[..] {
        [] => ("none".to_owned(), "no effect is missing"),
        [one] if one == "none" => ("none".to_owned(), "no effect is missing"),
        [one] if one == "unknown" => ("unknown".to_owned(), "an effect that no catalogue has"),
        several => (set(several), ""),
    }
}

/// The verdict's effects, without the words that stand for none.
pub(super) fn found(diagnosis: &DiagnosisResult) -> Vec<String> {
    let effects = diagnosis.verdict.effects.iter();
    effects
        .filter(|e| *e != "none" && *e != "unknown")
        .cloned()
        .collect()
}

/// A gap in units of the noise.
pub(super) fn gap(gap: f64) -> String {
    significant(gap, if gap.abs() < 99.5 { 2 } else { 3 })
}

/// A probability with two decimals, never rounded to certainty.
pub(super) fn probability(probability: f64) -> String {
    match probability {
        p if p > 0.0 && p < 0.005 => "under 0.01".to_owned(),
        p if (0.995..1.0).contains(&p) => "over 0.99".to_owned(),
        p => decimals(p, 2),
    }
}

/// A share as `12 %`.
pub(super) fn percent(share: f64) -> String {
    match share {
        s if !s.is_finite() => NOT_A_NUMBER.to_owned(),
        s if s > 0.0 && s < 0.005 => format!("under {}", quantity("1", "%")),
        s => quantity(&decimals(100.0 * s, 0), "%"),
    }
}

/// The catalogue's description of an effect; may be empty.
pub(super) fn about<'t>(trace: &'t DiagnosisTrace, effect: &EffectResult) -> &'t str {
    let known = trace.catalogue.get(&effect.effect);
    known.map_or("", |words| &*words.about)
}

/// Whether a unit is described in words.
fn is_in_words(unit: &str) -> bool {
    ["unit of", " or ", ","].iter().any(|w| unit.contains(w))
}

/// `place = 0.41 m`, or `place = 0.41 (0.38 to 0.44) m` with an interval.
fn value(name: &str, value: f64, unit: &str, interval: Option<[f64; 2]>) -> String {
    let number = match interval.filter(|i| i.iter().all(|x| x.is_finite())) {
        Some([low, high]) => {
            let precision = Precision::of(value, (high - low) / 4.0);
            let shown = precision.show(value);
            format!("{shown} ({})", precision.interval([low, high]))
        }
        None => round(value, 3),
    };
    let told = if is_in_words(unit) {
        format!("{number} ({unit})")
    } else {
        quantity(&number, unit)
    };
    format!("{name} = {told}")
}

/// The fitted values of an effect; values without influence are left out.
pub fn values(trace: &DiagnosisTrace, effect: &EffectResult) -> String {
    let words = trace.catalogue.get(&effect.effect);
    let acting = effect.parameters.iter().filter_map(|(name, x)| {
        let known = words.and_then(|w| w.parameters.get(name));
        let acts = known.is_none_or(|k| k.null != *x);
        let interval = effect.intervals95.get(name).copied();
        let unit = effect.units.get(name).or(known.map(|k| &k.unit));
        acts.then(|| value(name, *x, unit.map_or("", |u| u), interval))
    });
    let text = acting.collect::<Vec<_>>().join(", ");
    if effect.at_bound && !text.is_empty() {
        return format!("{text} (at an end of its range: the best value may lie beyond)");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_rounded_to_certain_or_to_impossible() {
        assert_eq!(probability(0.9999), "over 0.99");
        assert_eq!(probability(1e-9), "under 0.01");
        assert_eq!((&*probability(1.0), &*probability(0.0)), ("1.00", "0.00"));
        assert_eq!(percent(0.001), "under 1\u{a0}%");
        assert_eq!(percent(f64::NAN), NOT_A_NUMBER);
    }

    #[test]
    fn names_are_listed_as_in_a_sentence() {
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!(joined(&names, "and"), "a, b and c");
        assert_eq!(joined(&names[..1], "or"), "a");
    }
}
