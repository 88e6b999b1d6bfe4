//! The answer of somebody who knows the label: a check of the scorer itself.
//!
//! This answer is right by construction. If it is not scored as right, the fault is in the scorer,
//! the generator or the catalogue. The same holds if the true effects do not fit the logs of a
//! clean world.

use crate::answer::{
    Answer, EffectValues, Hypothesis, ParameterEstimate, Place, Verdict, WiringFound,
};
use crate::label::{Label, name_of, site_of};

/// Answers with the content of a label, with certainty.
#[must_use]
pub fn oracle(label: &Label) -> Answer {
    let kind = match label.kind() {
        kind @ ("none" | "unknown") => kind,
        _ => "effects",
    };
    let named: Vec<String> = match kind {
        "effects" => label.effects.clone(),
        _ => Vec::new(),
    };
    let set = if named.is_empty() {
        vec![kind.to_owned()]
    } else {
        named.clone()
    };
    let values = |effect: &String| {
        let prefix = format!("{effect}.");
        let own =
            |(key, value): (&String, &f64)| Some((key.strip_prefix(&prefix)?.to_owned(), *value));
        EffectValues {
            effect: name_of(effect).to_owned(),
            site: site_of(effect).to_owned(),
            parameters: label.effect_parameters.iter().filter_map(own).collect(),
            ..EffectValues::default()
        }
    };
    Answer {
        effects: named.iter().map(values).collect(),
        verdict: Verdict {
            kind: kind.to_owned(),
            effects: named,
            probability: 1.0,
            ..Verdict::default()
        },
        hypotheses: vec![Hypothesis {
            effects: set,
            probability: 1.0,
        }],
        places: label
            .signals
            .iter()
            .map(|(signal, share)| Place {
                signal: signal.clone(),
                share: *share,
                ..Place::default()
            })
            .collect(),
        parameters: label
            .parameters
            .iter()
            .map(|(name, value)| ParameterEstimate {
                name: name.clone(),
                estimate: *value,
                interval95: None,
            })
            .collect(),
        wiring: label
            .wiring
            .iter()
            .map(|w| WiringFound {
                fault: w.fault.clone(),
                columns: w.columns.clone(),
                probability: Some(1.0),
            })
            .collect(),
        ..Answer::default()
    }
}
