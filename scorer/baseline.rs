//! Baselines: answers that take no diagnosis. What a diagnosis is worth is what it is better than these.
//!
//! They get the same studies, catalogue and engine, and the same scorer. They are what one would write in an afternoon:
//! all effects at all sites are ranked by one linearisation each, the leading ones fitted by replays of the training
//! logs, residuals taken for white noise. None of them knows a label.

mod candidates;
mod noise;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use asid_core::replay::Replay;
use asid_core::{Backend, Result};
use asid_effects::EffectSpec;

use crate::answer::{
    Answer, EffectValues, Gap, Hypothesis, ParameterEstimate, SignalNoise, Verdict,
};
use crate::physics::Study;
use crate::physics::fit::Fit;
use crate::physics::logs::{Logs, within};
use crate::physics::model::{Engine, Point, World};
use crate::physics::start::{State, first_state, open_coordinates};
use candidates::{Shown, candidates};

/// A baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// Fits the study's parameters, and says that nothing is missing.
    IdentifyOnly,
    /// Names the single effect that leaves the smallest residual on the training logs.
    BestResidual,
    /// Adds effects, and drops those before, for as long as the Bayesian information criterion (Schwarz 1978) falls.
    Bic,
}

/// Physics steps of a replay of all logs while candidates are ranked: some hundred of them take a minute on one core.
const RANKING_STEPS: f64 = 4_000.0;
/// The same while they are fitted.
const FITTING_STEPS: f64 = 10_000.0;
/// Leading candidates that are fitted in each round.
const FITTED: usize = 4;
/// Effects that are added at most.
const MOST_EFFECTS: usize = 3;

impl Baseline {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::IdentifyOnly => "identify-only",
            Self::BestResidual => "best-residual",
            Self::Bic => "bic",
        }
    }
}

/// What a baseline says of the study in a folder, with a catalogue that lacks some effects.
///
/// # Errors
/// When the study cannot be read or an engine fails.
pub fn answer(
    baseline: Baseline,
    backend: Arc<dyn Backend>,
    folder: &Path,
    without: &[String],
) -> Result<Answer> {
    let study = Study::read(folder)?;
    let engine = Engine::new(backend, &study)?;
    let mut work = Work::new(&study, &engine)?;
    let none = work.fit(&[], &work.middle())?;
    if baseline == Baseline::IdentifyOnly {
        return Ok(said(&study, &none, vec![(Vec::new(), 1.0)]));
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
        // What was added before may be needed no more.
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

/// Each set once, with the largest of its weights: a set may be reached by two ways.
fn each_once(weights: Vec<(Vec<String>, f64)>) -> Vec<(Vec<String>, f64)> {
    let mut sets: BTreeMap<Vec<String>, f64> = BTreeMap::new();
    for (set, weight) in weights {
        let own = sets.entry(set).or_default();
        *own = own.max(weight);
    }
    sets.into_iter().collect()
}

/// A set of effects, fitted.
#[derive(Clone)]
struct Fitted {
    effects: Vec<EffectSpec>,
    point: Point,
    squares: f64,
    readings: usize,
}

impl Fitted {
    fn labels(&self) -> Vec<String> {
        let mut labels: Vec<String> = self.effects.iter().map(EffectSpec::label).collect();
        labels.sort();
        labels
    }

    /// Schwarz's criterion for white normal residuals of unknown deviation.
    fn bic(&self) -> f64 {
        let n = self.readings as f64;
        n * (self.squares / n).ln() + self.point.values.len() as f64 * n.ln()
    }
}

/// The answer: the set of `best`, and weights of all sets that were tried.
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

/// A study, ready for fits.
struct Work<'a> {
    study: &'a Study,
    engine: &'a Engine,
    ranking: Logs,
    fitting: Logs,
    open: Vec<usize>,
}

impl<'a> Work<'a> {
    fn new(study: &'a Study, engine: &'a Engine) -> Result<Self> {
        let (layout, signals) = (&study.plant.layout, noise::signals(study));
        let logs = |steps: f64| {
            Logs::new(
                layout,
                &signals,
                within(&study.train, layout.timestep, steps),
            )
        };
        Ok(Self {
            ranking: logs(RANKING_STEPS)?,
            fitting: logs(FITTING_STEPS)?,
            open: open_coordinates(layout, &study.train),
            study,
            engine,
        })
    }

    fn starts(&self) -> Vec<State> {
        let logs = self.fitting.logs.iter();
        logs.map(|l| first_state(&self.study.plant, &l.episode))
            .collect()
    }

    /// The study's parameters in the middle of their ranges, the starts as the logs show them.
    fn middle(&self) -> Point {
        Point {
            values: self
                .study
                .parameters
                .iter()
                .map(|p| p.from_unit(0.5))
                .collect(),
            starts: self.starts(),
        }
    }

    /// The world of a set, and the values where its fit begins: the study's parameters as in `from`.
    fn world(&self, effects: &[EffectSpec], from: &Point) -> Result<(World, Vec<f64>)> {
        let of = |name: &str| {
            let at = self.study.parameters.iter().position(|p| p.name == name)?;
            from.values.get(at).copied()
        };
        let world = self.engine.world(self.study, effects, &of)?;
        let values = world.unknowns.iter().map(|u| u.start).collect();
        Ok((world, values))
    }

    fn fit(&mut self, effects: &[EffectSpec], from: &Point) -> Result<Fitted> {
        let (world, values) = self.world(effects, from)?;
        let mut fit = Fit::new(&self.study.plant.layout, &world, self.open.clone())?;
        let starts = from.starts.clone();
        let point = fit.run(&mut self.fitting, Point { values, starts })?;
        let (squares, readings) = fit.squares(&mut self.fitting, &point)?;
        let mut fitted = effects.to_vec();
        let unknowns = world.unknowns.iter().zip(&point.values);
        for (unknown, value) in unknowns.skip(self.study.parameters.len()) {
            unknown.set(&mut fitted, *value);
        }
        Ok(Fitted {
            effects: fitted,
            point,
            squares,
            readings,
        })
    }

    /// Fits the sets that lead, of those with one effect more than `from`.
    fn round(&mut self, from: &Fitted, all: &[Vec<EffectSpec>]) -> Result<Vec<Fitted>> {
        let mut ranked: Vec<(f64, Vec<EffectSpec>)> = Vec::new();
        let layout = &self.study.plant.layout;
        for starts in all {
            let known = |s: &EffectSpec| from.effects.iter().any(|e| e.label() == s.label());
            if starts.iter().any(known) {
                continue;
            }
            let mut own: Option<(f64, Vec<EffectSpec>)> = None;
            for start in starts {
                let effects = [&from.effects[..], std::slice::from_ref(start)].concat();
                // What the engine cannot give the scene is no candidate.
                let Ok((world, values)) = self.world(&effects, &from.point) else {
                    continue;
                };
                let mut fit = Fit::new(layout, &world, Vec::new())?;
                let starts = from.point.starts.clone();
                let promised = fit.promise(&mut self.ranking, &Point { values, starts });
                let Ok(Some([_, after])) = promised else {
                    continue;
                };
                if own.as_ref().is_none_or(|o| after < o.0) {
                    own = Some((after, effects));
                }
            }
            ranked.extend(own);
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let leading = ranked.into_iter().take(FITTED);
        leading
            .map(|(_, effects)| self.fit(&effects, &from.point))
            .collect()
    }

    /// The set with one effect less by which the criterion falls most; `None` where it falls by none.
    fn fewer(&mut self, from: &Fitted) -> Result<Option<Fitted>> {
        let mut best: Option<Fitted> = None;
        for left_out in 0..from.effects.len() {
            let mut effects = from.effects.clone();
            effects.remove(left_out);
            let fitted = self.fit(&effects, &from.point)?;
            let least = best.as_ref().map_or_else(|| from.bic(), Fitted::bic);
            if fitted.bic() < least {
                best = Some(fitted);
            }
        }
        Ok(best)
    }

    /// What the identified model does along the training logs.
    fn shown(&mut self, none: &Fitted) -> Result<Shown> {
        let layout = &self.study.plant.layout;
        let (world, values) = self.world(&[], &none.point)?;
        let mut fit = Fit::new(layout, &world, Vec::new())?;
        let joints = || layout.joints.iter().map(|j| &j.name);
        let names: Vec<String> = joints()
            .map(|j| format!("qpos.{j}"))
            .chain(joints().map(|j| format!("qvel.{j}")))
            .collect();
        let mut logs = self.fitting.like(layout)?;
        for log in &mut logs.logs {
            log.replay = Replay::new(layout, &log.episode, &names)?;
        }
        let starts = none.point.starts.clone();
        let rows = fit.predict(&mut logs, &Point { values, starts })?;
        let (nq, width) = (layout.nq, layout.nq + layout.nv);
        let states = || rows.iter().flat_map(|r| r.chunks_exact(width));
        Ok(Shown {
            ctrl: logs
                .logs
                .iter()
                .flat_map(|l| l.episode.ctrl.clone())
                .collect(),
            qpos: states().flat_map(|s| s[..nq].to_vec()).collect(),
            qvel: states().flat_map(|s| s[nq..].to_vec()).collect(),
        })
    }
}
