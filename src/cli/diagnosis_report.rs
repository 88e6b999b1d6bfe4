//! Fills the data that a diagnosis' report is made of.

use std::collections::HashSet;

use asid_core::registry::find;
use asid_diagnosis::result::{DiagnosisResult, DiagnosisTrace, EffectResult, Kind, SignalTrace};
use asid_effects::EffectEntry;
use asid_report::diagnosis as r;
use asid_report::run::NamedText;

use super::trace::files;

/// What the report tells besides the result. Whatever is left empty is left out.
#[derive(Clone, Debug, Default)]
pub struct Meta {
    /// The command line that repeats the diagnosis.
    pub command: String,
    /// The engine with its version.
    pub engine: String,
    /// The seed.
    pub seed: u64,
    /// The study's parameters: name, unit, and value in the model as given.
    pub parameters: Vec<(String, String, Option<f64>)>,
    /// Number of episodes held out; 0 for those of the trace.
    pub held_out: usize,
    /// Number of episodes fitted to; 0 where it is not known.
    pub fitted_to: usize,
    /// What else lies in the folder: name and what it holds.
    pub files: Vec<(&'static str, &'static str)>,
}

/// The report's data.
#[must_use]
pub fn diagnosis(result: &DiagnosisResult, trace: &DiagnosisTrace, meta: Meta) -> r::Diagnosis {
    let gap = &result.gap;
    let verdict = &result.verdict;
    let episodes: HashSet<&str> = trace.signals.iter().map(|s| &*s.episode).collect();
    let text = |name: &str, value: &str| NamedText {
        name: name.to_owned(),
        value: value.to_owned(),
    };
    r::Diagnosis {
        study: result.study.clone(),
        sentence: result.sentence.clone(),
        gap: r::Gap {
            nominal: gap.nominal,
            identified: gap.identified,
            refined: gap.refined,
            closed: gap.closed,
            closed_interval95: gap.closed_interval95,
        },
        signal_gaps: (gap.signals.iter())
            .map(|s| r::SignalGap {
                signal: s.signal.clone(),
                unit: s.unit.clone(),
                noise: s.noise,
                gaps: [s.nominal, s.identified, s.refined],
            })
            .collect(),
        places: (result.places.iter())
            .map(|p| r::Place {
                signal: p.signal.clone(),
                regime: p.regime.clone(),
                share: p.share,
                condition: p.condition.clone().unwrap_or_default(),
            })
            .collect(),
        hypotheses: (result.hypotheses.iter())
            .map(|h| r::Hypothesis {
                effects: h.effects.clone(),
                probability: h.probability,
            })
            .collect(),
        effects: result.effects.iter().map(effect).collect(),
        verdict: r::Verdict {
            kind: match verdict.kind {
                Kind::None => r::Kind::None,
                Kind::Effects => r::Kind::Effects,
                Kind::Unknown => r::Kind::Unknown,
            },
            effects: verdict.effects.clone(),
            probability: verdict.probability,
            ambiguous_with: verdict.ambiguous_with.clone(),
            unexplained: verdict.unexplained,
        },
        parameters: (result.parameters.iter())
            .map(|p| {
                let known = meta.parameters.iter().find(|k| k.0 == p.name);
                r::Parameter {
                    name: p.name.clone(),
                    unit: known.map_or_else(String::new, |k| k.1.clone()),
                    nominal: known.and_then(|k| k.2),
                    estimate: p.estimate,
                    std: p.std,
                    interval95: p.interval95,
                }
            })
            .collect(),
        checks: (result.checks.iter())
            .map(|c| r::Check {
                name: c.check.clone(),
                ok: c.ok,
                detail: c.detail.clone(),
            })
            .collect(),
        wiring: (result.wiring.iter())
            .map(|w| r::Wiring {
                fault: w.fault.clone(),
                columns: w.columns.clone(),
                probability: w.probability,
                mend: w.mend.clone(),
            })
            .collect(),
        separates: result.next_experiment.separates.clone(),
        next_experiment: result.next_experiment.how.clone(),
        held_out: if meta.held_out > 0 {
            meta.held_out
        } else {
            episodes.len()
        },
        fitted_to: meta.fitted_to,
        ladder: (trace.ladder.iter())
            .map(|(label, gap)| r::Rung {
                label: label.clone(),
                gap: *gap,
            })
            .collect(),
        signals: trace.signals.iter().map(signal).collect(),
        map: (!trace.map.is_empty()).then(|| r::Map {
            axes: trace.map_axes.clone(),
            unit: map_unit(trace),
            points: trace.map.clone(),
        }),
        left_out: (trace.left_out.iter())
            .map(|(name, why)| text(name, why))
            .collect(),
        versions: vec![
            text("seed", &meta.seed.to_string()),
            text("asid", env!("CARGO_PKG_VERSION")),
            text("engine", &meta.engine),
            text("git", env!("ASID_GIT")),
        ],
        real_world: None,
        engine: meta.engine,
        command: meta.command,
        files: files(&meta.files),
    }
}

/// An effect with what the catalogue says of it and of its parameters.
fn effect(e: &EffectResult) -> r::Effect {
    let entry = find::<EffectEntry>(&e.effect).ok();
    let made = entry.map(|entry| (entry.make)());
    let parameters = made.as_ref().map_or(&[][..], |made| made.parameters());
    r::Effect {
        name: e.effect.clone(),
        site: e.site.clone(),
        about: entry.map_or("", |entry| entry.about).to_owned(),
        probability: e.probability,
        closes: e.gap_closed,
        values: (e.parameters.iter())
            .map(|(name, value)| {
                let known = parameters.iter().find(|p| p.name == name);
                r::EffectValue {
                    name: name.clone(),
                    value: *value,
                    unit: known.map_or("", |p| p.unit).to_owned(),
                    null: known.map(|p| p.null),
                }
            })
            .collect(),
    }
}

/// A signal; what is missing is NaN.
fn signal(s: &SignalTrace) -> r::SignalTrace {
    let numbers = |values: &[Option<f64>]| values.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
    r::SignalTrace {
        episode: s.episode.clone(),
        signal: s.signal.clone(),
        unit: s.unit.clone(),
        noise: s.noise,
        time: s.time.clone(),
        real: numbers(&s.real),
        nominal: numbers(&s.nominal),
        identified: numbers(&s.identified),
        refined: numbers(&s.refined),
    }
}

/// Unit of the signal that the map's first axis is named after; a position's otherwise.
fn map_unit(trace: &DiagnosisTrace) -> String {
    let named = (trace.signals.iter()).find(|s| s.signal == trace.map_axes[0]);
    named.map_or("m", |s| &s.unit).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_becomes_a_page_with_units_and_words_of_the_catalogue() {
        let text = r#"{"schema":1,"study":"arm","sentence":"The elbow answers late.",
            "gap":{"noise_floor":1.0,"nominal":9.0,"identified":4.0,"refined":1.1,"closed":0.98,"closed_interval95":[0.9,1.0],
                "signals":[{"signal":"elbow","noise":0.01,"unit":"rad","nominal":9.0,"identified":4.0,"refined":1.1}]},
            "where":[{"signal":"elbow","regime":"reversal","share":1.0,"condition":null}],
            "hypotheses":[{"effects":["actuator-delay@elbow"],"probability":0.9},{"effects":["none"],"probability":0.1}],
            "effects":[{"effect":"actuator-delay","site":"elbow","probability":0.9,"gap_closed":null,"parameters":{"delay":0.03}}],
            "verdict":{"kind":"effects","effects":["actuator-delay@elbow"],"probability":0.9,"ambiguous_with":[],"unexplained":0.02},
            "parameters":[{"name":"damping","estimate":0.2,"std":0.01,"interval95":[0.18,0.22]}],
            "checks":[],"next_experiment":{"separates":[],"how":""}}"#;
        let result: DiagnosisResult = serde_json::from_str(text).expect("it is of the contract");
        let trace = DiagnosisTrace {
            signals: vec![SignalTrace {
                episode: "a.csv".into(),
                signal: "elbow".into(),
                unit: "rad".into(),
                noise: 0.01,
                time: vec![0.0, 0.1, 0.2],
                real: vec![Some(0.0), None, Some(0.1)],
                nominal: vec![None; 3],
                identified: vec![Some(0.0); 3],
                refined: vec![Some(0.0), Some(0.05), Some(0.1)],
            }],
            ..DiagnosisTrace::default()
        };
        let meta = Meta {
            parameters: vec![("damping".into(), "N m s/rad".into(), Some(0.1))],
            ..Meta::default()
        };
        let html = r::page(&diagnosis(&result, &trace, meta));
        for told in [
            "The elbow answers late.",
            "delay = 0.03\u{a0}s",
            "The command arrives later",
            "N m s/rad",
            "1 episode",
        ] {
            assert!(html.contains(told), "{told}");
        }
        assert!(!html.contains("NaN"));
    }
}
