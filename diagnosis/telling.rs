//! Turns what a search found into a result: gaps, probabilities, places, pictures.

use asid_core::{Episode, Result};
use asid_effects::EffectSpec;
use asid_results::evidence::Evidence;

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::{Candidate, LeftOut};
use crate::checks;
use crate::decision::is_in_training_alone;
use crate::experiment::{self, Proposed};
use crate::findings::{Findings, Found, trials};
use crate::forces::Short;
use crate::judgement::Judgement;
use crate::localise::localise;
use crate::predict::{Point, State};
use crate::record::Record;
use crate::result::{DiagnosisResult, Kind, NotTried};
use crate::sentence::{Training, sentence};
use crate::settings::Settings;
use crate::study::Study;
use crate::trace::DiagnosisTrace;
use crate::trajectory::Trajectory;

mod answer;
mod gap;
mod remainder;
mod trace;
mod unexplained;
mod units;
mod values;
mod view;

use answer::{groups, tolerances};
use gap::NO_GAP;
use remainder::shares;
use unexplained::{least_explained, least_made_up};

/// A finished diagnosis.
pub struct Diagnosis {
    /// Contents of `result.json`.
    pub result: DiagnosisResult,
    /// What the report shows in addition.
    pub trace: DiagnosisTrace,
    /// The evidence on which the decision rests.
    pub evidence: Evidence,
    /// Effects of the verdict, with their values; empty for none.
    pub effects: Vec<EffectSpec>,
    /// Values of the study's parameters that belong to these effects.
    pub values: Vec<f64>,
    /// Commands of the next experiment; `None` if there is none to play.
    pub next_commands: Option<Episode>,
}

/// Everything from which a result is made.
pub(crate) struct Telling<'a> {
    pub(crate) study: &'a Study,
    pub(crate) bench: &'a Bench,
    pub(crate) candidates: &'a [Candidate],
    pub(crate) left_out: &'a [LeftOut],
    pub(crate) findings: &'a Findings,
    pub(crate) evidence: &'a Evidence,
    pub(crate) judgement: &'a Judgement,
    pub(crate) nominal: &'a [f64],
    pub(crate) settings: Settings,
    /// Whether the work was stopped, so that only what the answer needs is computed.
    pub(crate) stopped: bool,
}

/// Predictions of the held-out logs by one model: initial states, readings, and residuals in units
/// of the noise, without whitening.
#[derive(Clone)]
struct HeldOut {
    starts: Vec<State>,
    readings: Vec<Vec<f64>>,
    residuals: Vec<f64>,
}

impl Telling<'_> {
    fn found(&self, hypothesis: usize) -> Option<&Found> {
        let place = self.judgement.hypotheses[hypothesis].found?;
        Some(&self.findings.found[place])
    }

    fn trials(&self, found: Option<&Found>) -> Vec<Trial<'_>> {
        found.map_or_else(Vec::new, |f| {
            trials(self.candidates, &f.candidates, &f.explanation)
        })
    }

    fn explanation(&self, found: Option<&Found>) -> Explanation {
        found.map_or_else(|| self.findings.none.clone(), |f| f.explanation.clone())
    }

    /// Replays the held-out logs by three models: as given, as identified, and as refined by an
    /// explanation with its trials.
    ///
    /// Equal models are replayed once.
    fn all_held(&self, (trials, refined): (&[Trial<'_>], &Explanation)) -> Result<[HeldOut; 3]> {
        let bench = self.bench;
        let none = &self.findings.none;
        let identified = self.held(&[], &none.fit.point.theta, none.held_starts.clone())?;
        let nominal = if self.nominal == none.fit.point.theta {
            identified.clone()
        } else {
            let starts = bench
                .head_point(&[], self.nominal, &bench.test.starts)?
                .starts;
            self.held(&[], self.nominal, starts)?
        };
        let theta = &refined.fit.point.theta;
        let refined = if trials.is_empty() && *theta == none.fit.point.theta {
            identified.clone()
        } else {
            self.held(trials, theta, refined.held_starts.clone())?
        };
        Ok([nominal, identified, refined])
    }

    /// Replays the held-out logs from some initial states, without whitening.
    fn held(&self, trials: &[Trial<'_>], theta: &[f64], starts: Vec<State>) -> Result<HeldOut> {
        let bench = self.bench;
        let mut predictor = bench.predictor(trials, &bench.test)?;
        let point = Point {
            theta: theta.to_vec(),
            starts: starts.clone(),
        };
        let readings = predictor.readings(std::slice::from_ref(&point))?.pop();
        let mut residuals = predictor.residuals(&[point])?.pop().unwrap_or_default();
        bench.mask_head(&mut residuals);
        Ok(HeldOut {
            starts,
            readings: readings.unwrap_or_default(),
            residuals,
        })
    }

    /// Makes the whole result.
    pub(crate) fn tell(&self) -> Result<Diagnosis> {
        let j = self.judgement;
        let best = self.found(j.best);
        let (members, explanation) = (self.trials(best), self.explanation(best));
        let none = &self.findings.none;
        let [nominal, identified, refined] = self.all_held((&members, &explanation))?;
        let mut gap = self.gap(&nominal, &identified, &refined);
        let kind = if j.is_unknown {
            Kind::Unknown
        } else if explanation.labels().is_empty() {
            Kind::None
        } else {
            Kind::Effects
        };
        let moved = self.moved_by_step(&explanation)?;
        let effects = self.effects(gap.identified, &moved)?;
        let hypotheses = self.hypotheses();
        let labels = explanation.labels();
        let left = self.left(&members, &explanation)?;
        let verdict = self.verdict(kind, &labels, &gap, &left);
        gap.p_value = self.findings.p_value;
        gap.shares = shares(&gap, kind, &left);
        let places = self.places(none)?;
        let short = self.short(none, (&members, &explanation))?;
        let proposed = if self.stopped {
            Proposed::default()
        } else {
            self.next(best)?
        };
        let mut result = DiagnosisResult {
            schema: 1,
            study: self.study.name.clone(),
            sentence: String::new(),
            gap,
            places,
            hypotheses,
            effects,
            groups: groups(&verdict.effects),
            verdict,
            tolerances: tolerances(&explanation),
            parameters: self.parameters(&explanation, &moved),
            checks: self.checks(none, &explanation, short.as_ref())?,
            next_experiment: proposed.told,
            missing_force: self.findings.missing.clone(),
            ranking: self.findings.ranking.clone(),
            isolability: self.findings.isolability.clone(),
            detection_limits: self.findings.detection_limits.clone(),
            not_tried: self.findings.not_tried.clone(),
            ..DiagnosisResult::default()
        };
        if self.stopped {
            result.not_tried.push(NotTried {
                stage: "check of the time step, short replays, and the next experiment".into(),
                effects: Vec::new(),
            });
        }
        let rest = short
            .and_then(|(before, after, _)| least_explained(&before, &after))
            .or_else(|| least_made_up(&result.missing_force, &self.findings.left));
        let beyond = self.evidence.none.held_out.sqrt();
        let of_best = j.best_explanation().found.map(|i| &self.evidence.tried[i]);
        let of_best = of_best.map_or(self.evidence.none, |t| t.replayed);
        let training = Training {
            none: self.evidence.none.train.sqrt(),
            best: of_best.train.sqrt(),
            alone: is_in_training_alone(self.evidence.none),
        };
        let best = (&labels[..], rest.as_deref());
        let gaps = (self.findings.repeats, beyond, training);
        result.sentence = sentence(&result, best, gaps);
        let mut trace = self.trace(&nominal, &identified, &refined, &result.effects)?;
        trace.view = Some(self.view([&nominal, &identified, &refined], &explanation)?);
        let study = self.bench.parameters.len();
        Ok(Diagnosis {
            result,
            trace,
            evidence: self.evidence.clone(),
            effects: explanation.effects.clone(),
            values: explanation.fit.point.theta[..study].to_vec(),
            next_commands: proposed.commands,
        })
    }

    /// Returns where the gap of the identified model lies, in the training logs.
    fn places(&self, none: &Explanation) -> Result<Vec<crate::result::Where>> {
        let record = &self.bench.train;
        let mut predictor = self.bench.predictor(&[], record)?;
        let residuals = predictor.residuals(std::slice::from_ref(&none.fit.point))?;
        let shown = self.shown(record, none)?;
        let plant = &self.bench.machine.plant;
        Ok(localise(plant, &record.logs, &shown, &residuals[0]))
    }

    fn shown(&self, record: &Record, none: &Explanation) -> Result<Trajectory> {
        Trajectory::of(
            &*self.bench.machine.with(&[])?,
            &self.bench.machine.plant,
            &self.bench.parameters,
            &record.logs,
            &none.fit.point,
            self.bench.machine.threads,
        )
    }

    fn checks(
        &self,
        none: &Explanation,
        best: &Explanation,
        short: Option<&(Short, Short, f64)>,
    ) -> Result<Vec<crate::result::CheckResult>> {
        let bench = self.bench;
        let mut all = vec![
            checks::data(&bench.train.logs, &bench.test.logs, bench.open.len()),
            checks::units(bench, self.nominal)?,
        ];
        let left = none.fit.cost / bench.train.readings.max(1) as f64;
        all.extend(checks::motion(&bench.train.logs, left.sqrt()));
        all.extend(checks::rows(&bench.train.logs, &bench.test.logs));
        all.extend(checks::memory(&bench.machine));
        all.extend(checks::identifiability(&bench.parameters, none, best));
        let repeats = self.findings.repeats;
        all.extend(repeats.map(checks::repeatability));
        // Replays that do not repeat change with the time step as well.
        let scatters = repeats.is_some_and(|r| r.scatters);
        if let Ok(halved) = bench.machine.halved()
            && !self.stopped
            && !scatters
        {
            all.push(checks::time_step(bench, none, &halved)?);
        }
        if let Some((before, after, seconds)) = short {
            all.extend(checks::windows(before, after, *seconds));
        }
        all.extend(checks::missing_force(&self.findings.missing));
        Ok(all)
    }

    /// Proposes an experiment that distinguishes the verdict from its nearest rival.
    fn next(&self, best: Option<&Found>) -> Result<Proposed> {
        let j = self.judgement;
        let is_replayed = |i: &usize| j.hypotheses[*i].found.is_some();
        let rival = j.ambiguous.iter().copied().find(is_replayed).or_else(|| {
            let rivals = || (0..j.hypotheses.len()).filter(|&i| i != j.best);
            let none = |i: &usize| j.hypotheses[*i].labels.is_empty();
            rivals().find(is_replayed).or_else(|| rivals().find(none))
        });
        let Some(rival) = rival else {
            return Ok(Proposed::default());
        };
        let rival = self.found(rival);
        let (one, other) = (self.explanation(best), self.explanation(rival));
        experiment::next(
            self.bench,
            (&self.trials(best), &one),
            (&self.trials(rival), &other),
        )
    }
}
