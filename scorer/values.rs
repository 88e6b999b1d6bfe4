//! Errors of fitted values, and whether their intervals contain the true values.

use serde::Serialize;

use crate::answer::Answer;
use crate::catalogue::parameters_of;
use crate::label::{Label, name_of};
use crate::sites::Sites;

/// An estimate and its true value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// `NAME@SITE.parameter`, or a parameter of the study.
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Estimate.
    pub estimate: f64,
    /// Error relative to the true value.
    ///
    /// For an effect it is relative to the distance between the true value and the value at which
    /// the effect is off.
    pub error: f64,
    /// Whether the 95 % interval contains the true value; null without an interval.
    pub covered: Option<bool>,
}

fn estimate(
    name: String,
    truth: f64,
    null: f64,
    said: f64,
    interval: Option<[f64; 2]>,
) -> Estimate {
    Estimate {
        name,
        truth,
        estimate: said,
        error: ((said - truth) / (truth - null)).abs(),
        covered: interval.map(|[low, high]| low <= truth && truth <= high),
    }
}

/// Values of the causes that the verdict names.
///
/// If the true value is the one at which the effect is off, there is no relative error. A cause
/// that is not named has no estimate.
#[must_use]
pub fn of_effects(label: &Label, answer: &Answer, sites: &Sites) -> Vec<Estimate> {
    let mut found = Vec::new();
    for named in &answer.verdict.effects {
        let Some(cause) = label.effects.iter().find(|e| sites.same(e, named)) else {
            continue;
        };
        let Some(fitted) = answer.values(named) else {
            continue;
        };
        let known = parameters_of(name_of(cause)).unwrap_or_default();
        for (name, &said) in &fitted.parameters {
            let null = known
                .iter()
                .find(|p| p.name == name)
                .map_or(0.0, |p| p.null);
            if let Some(truth) = label.value(cause, name).filter(|t| *t != null) {
                let interval = fitted.intervals95.get(name).copied();
                found.push(estimate(
                    format!("{cause}.{name}"),
                    truth,
                    null,
                    said,
                    interval,
                ));
            }
        }
    }
    found
}

/// Values of the study's own parameters.
#[must_use]
pub fn of_study(label: &Label, answer: &Answer) -> Vec<Estimate> {
    let known = answer.parameters.iter().filter_map(|p| {
        let truth = *label.parameters.get(&p.name)?;
        (truth != 0.0).then(|| estimate(p.name.clone(), truth, 0.0, p.estimate, p.interval95))
    });
    known.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::{EffectValues, ParameterEstimate, Verdict};

    #[test]
    fn the_error_of_a_gain_is_relative_to_its_departure_from_one() {
        let label = Label {
            effects: vec!["actuator-gain@drive".into()],
            effect_parameters: [("actuator-gain@drive.gain".to_owned(), 0.9)].into(),
            parameters: [("mass".to_owned(), 2.0)].into(),
            ..Label::default()
        };
        let answer = Answer {
            verdict: Verdict {
                kind: "effects".into(),
                effects: vec!["actuator-gain@drive".into()],
                ..Verdict::default()
            },
            effects: vec![EffectValues {
                effect: "actuator-gain".into(),
                site: "drive".into(),
                parameters: [("gain".to_owned(), 0.95)].into(),
                intervals95: [("gain".to_owned(), [0.94, 0.96])].into(),
            }],
            parameters: vec![ParameterEstimate {
                name: "mass".into(),
                estimate: 2.1,
                interval95: Some([1.9, 2.3]),
            }],
            ..Answer::default()
        };
        let effects = of_effects(&label, &answer, &Sites::default());
        assert!((effects[0].error - 0.5).abs() < 1e-12 && effects[0].covered == Some(false));
        let study = of_study(&label, &answer);
        assert!((study[0].error - 0.05).abs() < 1e-12 && study[0].covered == Some(true));
    }
}
