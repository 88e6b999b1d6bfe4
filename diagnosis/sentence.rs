//! The answer in one sentence.

use asid_results::naming::{grouped, joined};

use crate::findings::Repeats;
use crate::result::{DiagnosisResult, Kind};

/// Share of the gap from which on what is left beside a verdict is mentioned in the sentence.
const WORTH_A_WORD: f64 = 0.05;

/// Gap on the held-out logs up to which it counts as noise, whose standard deviation is estimated.
const OF_NOISE: f64 = 1.2;

/// Says that the study's parameters are fitted, as a part of a sentence; empty if it has none.
fn once_fitted(result: &DiagnosisResult) -> &'static str {
    if result.parameters.is_empty() {
        ""
    } else {
        ", once the study's parameters are fitted"
    }
}

/// The sentence for a verdict without a missing effect; `beyond` is the gap that no choice of the
/// held-out logs' initial states removes.
fn none(result: &DiagnosisResult, beyond: f64, repeats: Option<Repeats>) -> String {
    let (gap, fitted) = (result.gap.identified, once_fitted(result));
    if gap <= OF_NOISE {
        return format!(
            "No gap is left beyond the sensors' noise{fitted} (gap {gap:.2} on the logs held out)."
        );
    }
    if beyond <= OF_NOISE {
        return format!(
            "No effect is missing{fitted}: the gap of {gap:.2} on the logs held out is within what their initial states leave open, which are fitted on the first tenth."
        );
    }
    if repeats.is_some_and(|r| r.scatters) {
        return format!(
            "No effect is missing: short replays leave no more than the sensors' noise{fitted}. Whole replays leave a gap of {gap:.2} on the logs held out, by which contacts scatter: see the check `repeatability`."
        );
    }
    format!(
        "No effect is found{fitted}: the gap of {gap:.2} on the logs held out is within the differences between simulators of the same physics."
    )
}

/// Lists what was fitted within its tolerance, law by law; `None` if nothing was.
fn within_tolerance(result: &DiagnosisResult) -> Option<String> {
    let mut laws: Vec<&str> = result.tolerances.iter().map(|t| &*t.effect).collect();
    laws.sort_unstable();
    laws.dedup();
    match &laws[..] {
        [] => None,
        [one] => Some(format!("{one} within its tolerance")),
        several => Some(format!(
            "{} within their tolerances",
            joined(several, "and")
        )),
    }
}

/// A set of effects as the subject of a sentence, and the end of its verb.
fn subject(labels: &[String]) -> (String, &'static str) {
    let laws = grouped(labels);
    let end = if laws.len() == 1 { "s" } else { "" };
    (joined(&laws, "and"), end)
}

fn percent(x: f64) -> String {
    format!("{:.0} %", 100.0 * x)
}

/// Gaps of the training logs without effects and with the best explanation.
#[derive(Clone, Copy, Debug)]
pub struct Training {
    /// Without effects.
    pub none: f64,
    /// With the best explanation.
    pub best: f64,
    /// Whether the held-out logs have none.
    pub alone: bool,
}

/// The interval of a share, percent, in brackets; empty if its ends read the same.
fn in_brackets(interval: [f64; 2]) -> String {
    let [low, high] = interval.map(|x| format!("{:.0}", 100.0 * x));
    if low == high {
        String::new()
    } else {
        format!(" ({low} to {high})")
    }
}

/// Says how much of the gap is closed, with its interval if there is one.
fn part_closed(result: &DiagnosisResult, training: Training) -> String {
    if training.alone {
        let Training { none, best, .. } = training;
        return format!(
            "the gap of the training logs ({none:.2}, and {best:.2} with it); those held out never show it"
        );
    }
    match (result.gap.closed, result.gap.closed_interval95) {
        (Some(c), Some(interval)) => format!("{} of it{}", percent(c), in_brackets(interval)),
        (Some(c), None) => format!("{} of it", percent(c)),
        _ => "what there is of it".into(),
    }
}

/// Says what is left beside the named effects; empty if it is little.
fn beside(result: &DiagnosisResult) -> String {
    let remainder = result.verdict.remainder.as_ref();
    remainder
        .filter(|r| r.share > WORTH_A_WORD)
        .map_or_else(String::new, |r| {
            let with = match &*r.against {
                "" => String::new(),
                variable => format!(" and goes with the {variable}"),
            };
            format!(" Of the rest, most is at {}{with}.", r.place)
        })
}

/// Says that a named cause is less probable than not, if no rival says so already; empty if it is
/// not.
fn doubt(result: &DiagnosisResult) -> String {
    let p = result.verdict.probability;
    if p >= 0.5 || !result.verdict.ambiguous_with.is_empty() {
        return String::new();
    }
    format!(
        " That this is the cause is less probable than not ({:.0} %).",
        100.0 * p
    )
}

/// Says where most of the gap is, as the beginning of a sentence; empty if no place is known.
fn place(result: &DiagnosisResult) -> String {
    result.places.first().map_or_else(String::new, |w| {
        let condition = w
            .condition
            .as_ref()
            .map_or_else(String::new, |c| format!(", where {c}"));
        let regime = match w.regime.as_str() {
            "motion" => String::new(),
            "free" => " in free flight".into(),
            other => format!(" ({other})"),
        };
        format!("The gap is in {}{regime}{condition}; ", w.signal)
    })
}

/// Says that a check failed; empty if none did.
fn caution(result: &DiagnosisResult) -> String {
    let failed = result.checks.iter().filter(|c| !c.ok);
    let failed: Vec<&str> = failed.map(|c| &*c.check).collect();
    if failed.is_empty() {
        return String::new();
    }
    let failed = failed.join(", ");
    format!(" But a check failed ({failed}): see there first.")
}

/// The sentence for tolerances that make up for the gap.
fn tolerances(result: &DiagnosisResult) -> String {
    format!(
        "No effect stands out{}: {} take the gap from {:.2} to {:.2} on the logs held out. One of them may still be its cause ({} that none is).",
        once_fitted(result),
        within_tolerance(result).unwrap_or_default(),
        result.gap.identified,
        result.gap.refined,
        percent(result.verdict.probability)
    )
}

/// The sentence for a verdict that names effects.
fn effects(result: &DiagnosisResult, training: Training) -> String {
    let sets = result.verdict.ambiguous_with.iter();
    let rivals: Vec<String> = sets.map(|s| grouped(s).join(" + ")).collect();
    let ambiguous = if rivals.is_empty() {
        String::new()
    } else {
        let rivals = rivals.join(", nor from ");
        format!(" These data cannot tell it from {rivals}.")
    };
    let (named, end) = subject(&result.verdict.effects);
    format!(
        "{}{named}{} explain{end} {}.{}{ambiguous}{}",
        place(result),
        within_tolerance(result).map_or_else(String::new, |t| format!(", beside {t},")),
        part_closed(result, training),
        beside(result),
        doubt(result)
    )
}

/// The sentence for a gap that nothing in the catalogue explains; `labels` come closest and leave
/// `rest`.
fn unknown(
    result: &DiagnosisResult,
    (labels, rest): (&[String], Option<&str>),
    training: Training,
) -> String {
    let (place, closed) = (place(result), part_closed(result, training));
    let closes_most = result.gap.closed.is_some_and(|c| c > 0.5);
    let rest = rest.map_or_else(String::new, |r| format!(": {r}"));
    let (names, end) = subject(labels);
    match (closes_most, labels.is_empty()) {
        (true, true) => format!(
            "{place}{} close {closed}, but too much of the missing force and of the gap is left to be theirs: something else is missing{rest}.",
            within_tolerance(result).unwrap_or_else(|| "the study's parameters".into()),
        ),
        (true, false) => format!(
            "{place}{names} explain{end} {closed}, but too much of the missing force and of the gap is left to name it as the cause: something else is missing{rest}."
        ),
        (false, true) => {
            let check = if result.missing_force.is_empty() {
                "repeatability"
            } else {
                "forces"
            };
            format!(
                "{place}nothing in the catalogue explains it, nor a part of it that would count (see the check `{check}`)."
            )
        }
        (false, false) => format!(
            "{place}nothing in the catalogue explains it: {names} come{end} nearest, with {closed}."
        ),
    }
}

/// Says what a result means, in one sentence.
///
/// `labels` are the effects of the best explanation, whether or not it is the verdict, and `rest`
/// is what they leave, if known. `repeats` is how well contacts can be repeated. `beyond` is the
/// gap without effects that no choice of the held-out logs' initial states removes. `training` are
/// the gaps of the training logs.
#[must_use]
pub fn sentence(
    result: &DiagnosisResult,
    best: (&[String], Option<&str>),
    (repeats, beyond, training): (Option<Repeats>, f64, Training),
) -> String {
    let within_tolerances = !result.tolerances.is_empty() && result.gap.identified > OF_NOISE;
    let body = match result.verdict.kind {
        Kind::None if within_tolerances => tolerances(result),
        Kind::None => none(result, beyond, repeats),
        Kind::Effects => effects(result, training),
        Kind::Unknown => unknown(result, best, training),
    };
    let early = if result.not_tried.is_empty() {
        ""
    } else {
        " The search was stopped early; what it left out may change the answer."
    };
    body + &caution(result) + early
}

#[cfg(test)]
mod tests {
    use super::{in_brackets, subject};

    /// Symptom: "explains 100 % of it (100 to 100)". Cause: the interval was written whatever its
    /// rounded ends were.
    #[test]
    fn an_interval_without_width_is_not_written() {
        assert_eq!(in_brackets([0.997, 1.0]), "");
        assert_eq!(in_brackets([0.961, 0.993]), " (96 to 99)");
    }

    /// Symptom: "payload@hand with gravity-tilt with drag@ball explains". Cause: the names of a set
    /// were joined by one word.
    #[test]
    fn several_effects_are_a_list_and_explain() {
        let labels = ["payload@hand", "gravity-tilt", "drag@ball"].map(str::to_owned);
        let (named, end) = subject(&labels);
        let expected = "payload@hand, gravity-tilt and drag@ball explain";
        assert_eq!(format!("{named} explain{end}"), expected);
        assert_eq!(subject(&labels[..1]), ("payload@hand".into(), "s"));
    }
}
