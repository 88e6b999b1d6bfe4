//! Baselines: answers without a diagnosis. A diagnosis is worth as much as it is better than these.
//!
//! They get the same studies, catalogue, engine and scorer. They are what one would write in an
//! afternoon. All effects at all sites are ranked by one linearisation each. The leading ones are
//! fitted by replays of the training logs, with residuals assumed white. None of them knows a
//! label.

mod candidates;
mod noise;
mod residual;
mod work;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use asid_core::{Backend, Result};
use asid_effects::EffectSpec;

use crate::answer::{
    Answer, EffectValues, Gap, Hypothesis, ParameterEstimate, SignalNoise, Verdict,
};
use crate::physics::Study;
use crate::physics::model::Engine;
use candidates::candidates;
use work::{Fitted, Work};

/// A baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// Fits the study's parameters and answers that nothing is missing.
    IdentifyOnly,
    /// Names the single effect that leaves the smallest residual on the training logs.
    BestResidual,
    /// Adds effects, and drops earlier ones, as long as the Bayesian information criterion falls
    /// (Schwarz 1978).
    Bic,
    /// Names nothing; a network learns the residuals.
    ResidualNetwork,
}

/// Maximum number of effects that are added.
const MOST_EFFECTS: usize = 3;

impl Baseline {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::IdentifyOnly => "identify-only",
            Self::BestResidual => "best-residual",
            Self::Bic => "bic",
            Self::ResidualNetwork => "residual-network",
        }
    }
}

/// Answer of a baseline to the study in a folder.
///
/// The catalogue lacks the effects `without`. The seed is for a baseline that learns.
///
/// # Errors
/// If the study cannot be read or an engine fails.
pub fn answer(
    baseline: Baseline,
    backend: Arc<dyn Backend>,
    folder: &Path,
    without: &[String],
    seed: u64,
) -> Result<Answer> {
    let study = Study::read(folder)?;
    let engine = Engine::new(backend, &study)?;
    let mut work = Work::new(&study, &engine)?;
    let none = work.fit(&[], &work.middle())?;
    if baseline == Baseline::IdentifyOnly {
        return Ok(said(&study, &none, vec![(Vec::new(), 1.0)]));
    }
    if baseline == Baseline::ResidualNetwork {
        let identified = said(&study, &none, vec![(Vec::new(), 1.0)]);
        return residual::add(&mut work, &none, seed, identified);
    }
    let shown = work.shown(&none)?;
    let all = candidates(&study, &shown, without);
    let mut tried = vec![none];
    let mut best = 0;
    for _ in 0..MOST_EFFECTS {
        let from = tried[best].clone();
        let round = work.round(&from, &all)?;
        let first = tried.len();
        tried.extend(round);
        let better = |a: &usize, b: &usize| match baseline {
            Baseline::BestResidual => tried[*a].squares.total_cmp(&tried[*b].squares),
            _ => tried[*a].bic().total_cmp(&tried[*b].bic()),
        };
        let Some(leader) = (first..tried.len()).min_by(better) else {
            break;
        };
        if baseline == Baseline::BestResidual {
            best = leader;
            break;
        }
        if tried[leader].bic() >= tried[best].bic() {
            break;
        }
        best = leader;
        // Effects that were added earlier may no longer be needed.
        while let Some(fewer) = work.fewer(&tried[best])? {
            tried.push(fewer);
            best = tried.len() - 1;
        }
    }
    let least = tried[best].bic();
    let weights = tried.iter().enumerate().map(|(i, f)| {
        let weight = match baseline {
            Baseline::Bic => (0.5 * (least - f.bic())).exp(),
            _ => f64::from(u8::from(i == best)),
        };
        (f.labels(), weight)
    });
    let weights = each_once(weights.collect());
    Ok(said(&study, &tried[best], weights))
}

/// Returns each set once, with its largest weight; a set may be reached in two ways.
fn each_once(weights: Vec<(Vec<String>, f64)>) -> Vec<(Vec<String>, f64)> {
    let mut sets: BTreeMap<Vec<String>, f64> = BTreeMap::new();
    for (set, weight) in weights {
        let own = sets.entry(set).or_default();
        *own = own.max(weight);
    }
    sets.into_iter().collect()
}

/// The answer with the set of `best` and the weights of all sets that were tried.
fn said(study: &Study, best: &Fitted, weights: Vec<(Vec<String>, f64)>) -> Answer {
    let total: f64 = weights.iter().map(|w| w.1).sum();
    let mut hypotheses: Vec<Hypothesis> = weights
        .into_iter()
        .map(|(effects, weight)| Hypothesis {
            effects: if effects.is_empty() {
                vec!["none".into()]
            } else {
                effects
            },
            probability: weight / total,
        })
        .collect();
    hypotheses.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let effects = best.labels();
    let own =
        |h: &&Hypothesis| h.effects == effects || (effects.is_empty() && h.effects == ["none"]);
    let probability = hypotheses.iter().find(own).map_or(0.0, |h| h.probability);
    let k = study.parameters.len();
    let parameters = study.parameters.iter().zip(&best.point.values);
    let value = |e: &EffectSpec| EffectValues {
        effect: e.name.clone(),
        site: e.site.clone(),
        parameters: e.values.iter().cloned().collect(),
        ..EffectValues::default()
    };
    Answer {
        verdict: Verdict {
            kind: if effects.is_empty() {
                "none"
            } else {
                "effects"
            }
            .into(),
            effects,
            probability,
            ..Verdict::default()
        },
        gap: Gap {
            signals: noise::signals(study)
                .into_iter()
                .map(|s| SignalNoise {
                    signal: s.sensor,
                    noise: s.noise,
                })
                .collect(),
            ..Gap::default()
        },
        effects: best.effects.iter().map(value).collect(),
        hypotheses,
        parameters: parameters
            .take(k)
            .map(|(p, v)| ParameterEstimate {
                name: p.name.clone(),
                estimate: *v,
                interval95: None,
            })
            .collect(),
        ..Answer::default()
    }
}
