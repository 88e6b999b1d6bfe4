//! What a search found, told as a result: gaps, probabilities, places, pictures.

use asid_core::{Result, Streams};

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::{Candidate, LeftOut};
use crate::checks;
use crate::diagnose::{Diagnosis, Settings};
use crate::experiment;
use crate::forces::{self, Short};
use crate::judgement::Judgement;
use crate::localise::localise;
use crate::predict::{Point, State};
use crate::record::Record;
use crate::result::{
    DiagnosisResult, Gap, Kind, MissingForce, NextExperiment, NotTried, SignalGap,
};
use crate::search::{Findings, Found, trials};
use crate::study::Study;
use crate::trajectory::Trajectory;
use crate::whitening::Scattering;
use crate::windows;

mod answer;
mod remainder;
mod trace;
mod values;
mod view;

use answer::groups;
use remainder::shares;

/// Samples of the bootstrap.
const RESAMPLES: usize = 2000;
/// Identified gap up to which there is nothing to close.
const NO_GAP: f64 = 1.05;

/// All that a result is told from.
pub(crate) struct Telling<'a> {
    pub(crate) study: &'a Study,
    pub(crate) bench: &'a Bench,
    pub(crate) candidates: &'a [Candidate],
    pub(crate) left_out: &'a [LeftOut],
    pub(crate) findings: &'a Findings,
    pub(crate) judgement: &'a Judgement,
    pub(crate) nominal: &'a [f64],
    pub(crate) settings: Settings,
    /// Whether only what the answer needs is to be computed.
    pub(crate) stopped: bool,
}

/// Share of the force that the model lacks at a joint from which on it counts as unexplained.
const UNEXPLAINED: f64 = 0.7;

/// The joint at which most of the force that the model lacks is left, in words.
fn least_explained(before: &Short, after: &Short) -> Option<String> {
    let pairs = before.joints.iter().zip(&after.joints);
    let shares = pairs.map(|(a, b)| (b.force / a.force, a, b));
    let (share, a, b) = shares
        .filter(|(share, ..)| share.is_finite())
        .max_by(|x, y| x.0.total_cmp(&y.0))?;
    (share > UNEXPLAINED).then(|| {
        format!(
            "at {}, {:.2} of the {:.2} {} that the model lacks over short windows are left",
            a.joint, b.force, a.force, a.unit
        )
    })
}

/// The same where the force was estimated moment by moment.
fn least_made_up(missing: &[MissingForce]) -> Option<String> {
    let share = |m: &MissingForce| m.refined / m.identified;
    let worst = missing
        .iter()
        .filter(|m| share(m).is_finite())
        .max_by(|a, b| share(a).total_cmp(&share(b)))?;
    (share(worst) > UNEXPLAINED).then(|| {
        format!(
            "at {}, {:.2} of the {:.2} {} that the model lacks are left",
            worst.dof, worst.refined, worst.identified, worst.unit
        )
    })
}

/// Predictions of the held-out logs by one model: readings and plain residuals in units of
/// the noise.
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

    /// Replays the held-out logs without whitening.
    fn held(&self, trials: &[Trial<'_>], theta: &[f64]) -> Result<HeldOut> {
        let bench = self.bench;
        let starts = bench.head_starts(trials, theta, &bench.test.starts)?;
        let mut predictor = bench.predictor(trials, &bench.test)?;
        predictor.set_scattering(Scattering::default());
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

    pub(crate) fn tell(&self) -> Result<Diagnosis> {
        let j = self.judgement;
        let best = self.found(j.best);
        let (members, explanation) = (self.trials(best), self.explanation(best));
        let none = &self.findings.none;
        let nominal = self.held(&[], self.nominal)?;
        let identified = self.held(&[], &none.fit.point.theta)?;
        let refined = self.held(&members, &explanation.fit.point.theta)?;
        let mut gap = self.gap(&nominal, &identified, &refined);
        let kind = if j.is_unknown {
            Kind::Unknown
        } else if best.is_none() {
            Kind::None
        } else {
            Kind::Effects
        };
        let effects = self.effects(gap.identified)?;
        let hypotheses = self.hypotheses();
        let labels = explanation.labels();
        let left = self.left(&members, &explanation)?;
        let verdict = self.verdict(kind, &labels, &gap, &left);
        gap.p_value = self.findings.p_value;
        gap.shares = shares(&gap, kind, &left);
        let places = self.places(none)?;
        let short = self.short(none, (&members, &explanation))?;
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
            parameters: self.parameters(&explanation),
            checks: self.checks(none, &explanation, short.as_ref())?,
            next_experiment: if self.stopped {
                NextExperiment::default()
            } else {
                self.next(best)?
            },
            missing_force: self.findings.missing.clone(),
            ranking: self.findings.ranking.clone(),
            isolability: self.findings.isolability.clone(),
            detection_limits: self.findings.detection_limits.clone(),
            not_tried: self.findings.not_tried.clone(),
            ..DiagnosisResult::default()
        };
        if self.stopped {
            result.not_tried.push(NotTried {
                stage: "check of the time step, and the next experiment".into(),
                effects: Vec::new(),
            });
        }
        let rest = short
            .and_then(|(before, after, _)| least_explained(&before, &after))
            .or_else(|| least_made_up(&result.missing_force));
        result.sentence = crate::sentence::sentence(&result, &labels, rest.as_deref());
        let mut trace = self.trace(&nominal, &identified, &refined, &result.effects)?;
        trace.view = Some(self.view([&nominal, &identified, &refined], &explanation)?);
        let study = self.bench.parameters.len();
        Ok(Diagnosis {
            result,
            trace,
            evidence: None,
            effects: explanation.effects.clone(),
            values: explanation.fit.point.theta[..study].to_vec(),
        })
    }

    /// Root mean square of some of the residuals that have a reading, capped where a
    /// simulation diverged.
    fn rms(&self, residuals: &[f64], sensor: Option<usize>, episode: Option<usize>) -> (f64, f64) {
        let logs = &self.bench.test.logs;
        let n = logs.entries.len();
        let present = logs.present();
        let (mut square, mut count) = (0.0, 0.0);
        for e in 0..logs.episodes.len() {
            if episode.is_some_and(|x| x != e) {
                continue;
            }
            let head = if self.bench.open.is_empty() {
                0
            } else {
                self.bench.head.logs.episodes[e].plan.rows() * n
            };
            for k in logs.offset(e) + head..logs.offset(e + 1) {
                if present[k] && sensor.is_none_or(|s| logs.entries[k % n].sensor == s) {
                    let r = residuals[k];
                    square += if r.is_finite() { r * r } else { 1e12 };
                    count += 1.0;
                }
            }
        }
        (square, count)
    }

    fn gap(&self, nominal: &HeldOut, identified: &HeldOut, refined: &HeldOut) -> Gap {
        let logs = &self.bench.test.logs;
        let root = |(square, count): (f64, f64)| (square / f64::max(count, 1.0)).sqrt();
        let of = |h: &HeldOut, sensor| root(self.rms(&h.residuals, sensor, None));
        let (i, r) = (of(identified, None), of(refined, None));
        let closed = |i2: f64, r2: f64| (1.0 - (r2 - 1.0) / (i2 - 1.0)).min(1.0);
        let has_gap = i > NO_GAP;
        let interval = has_gap.then(|| {
            let episodes: Vec<_> = (0..logs.episodes.len())
                .map(|e| {
                    let part = |h: &HeldOut| self.rms(&h.residuals, None, Some(e));
                    (part(identified), part(refined))
                })
                .collect();
            let mut rng = Streams::new(self.settings.seed).stream("bootstrap");
            let mut all: Vec<f64> = (0..RESAMPLES)
                .map(|_| {
                    let (mut a, mut b, mut n) = (0.0, 0.0, 0.0);
                    for _ in 0..episodes.len() {
                        use rand::Rng as _;
                        let ((x, count), (y, _)) = episodes[rng.random_range(0..episodes.len())];
                        a += x;
                        b += y;
                        n += count;
                    }
                    let (a, b) = (a / f64::max(n, 1.0), b / f64::max(n, 1.0));
                    if a > 1.0 { closed(a, b) } else { 0.0 }
                })
                .collect();
            all.sort_by(f64::total_cmp);
            let pick = |q: f64| all[(q * (RESAMPLES - 1) as f64).round() as usize];
            [pick(0.025), pick(0.975)]
        });
        Gap {
            noise_floor: 1.0,
            nominal: of(nominal, None),
            identified: i,
            refined: r,
            closed: has_gap.then(|| closed(i * i, r * r)),
            closed_interval95: interval,
            shares: None,
            p_value: None,
            signals: logs
                .sensors
                .iter()
                .enumerate()
                .map(|(s, sensor)| SignalGap {
                    signal: sensor.name.clone(),
                    noise: sensor.noise,
                    unit: sensor.unit.clone(),
                    nominal: of(nominal, Some(s)),
                    identified: of(identified, Some(s)),
                    refined: of(refined, Some(s)),
                })
                .collect(),
        }
    }

    /// Where the gap of the identified model lies, in the training logs.
    fn places(&self, none: &Explanation) -> Result<Vec<crate::result::Where>> {
        let record = &self.bench.train;
        let mut predictor = self.bench.predictor(&[], record)?;
        predictor.set_scattering(Scattering::default());
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

    /// What short replays tell, where the logs allow them: without any effect, with those of the
    /// best explanation, and how long they are, s.
    fn short(
        &self,
        none: &Explanation,
        (members, best): (&[Trial<'_>], &Explanation),
    ) -> Result<Option<(Short, Short, f64)>> {
        let bench = self.bench;
        let plant = &bench.machine.plant;
        if !self.findings.missing.is_empty() {
            return Ok(None);
        }
        let Some(rows) = windows::rows(plant, &bench.train.logs, &bench.open) else {
            return Ok(None);
        };
        let record = windows::cut(plant, &bench.train, rows);
        let study = bench.parameters.len();
        let of = |trials: &[Trial<'_>], e: &Explanation| {
            forces::missing(bench, &record, trials, &e.fit.point.theta[..study])
        };
        let seconds = record.logs.longest();
        Ok(Some((of(&[], none)?, of(members, best)?, seconds)))
    }

    fn checks(
        &self,
        none: &Explanation,
        best: &Explanation,
        short: Option<&(Short, Short, f64)>,
    ) -> Result<Vec<crate::result::CheckResult>> {
        let bench = self.bench;
        let mut all = vec![
            checks::data(&bench.train.logs, &bench.test.logs),
            checks::units(bench, self.nominal)?,
        ];
        all.extend(checks::identifiability(&bench.parameters, none, best));
        if self.findings.missing.is_empty() {
            all.push(checks::repeatability(bench));
        }
        if let Ok(halved) = bench.machine.halved()
            && !self.stopped
        {
            all.push(checks::time_step(bench, none, &halved)?);
        }
        if let Some((before, after, seconds)) = short {
            all.extend(checks::windows(before, after, *seconds));
        }
        all.extend(checks::missing_force(&self.findings.missing));
        Ok(all)
    }

    /// What would tell the verdict from its nearest rival.
    fn next(&self, best: Option<&Found>) -> Result<NextExperiment> {
        let j = self.judgement;
        let rival = j.ambiguous.first().copied().or_else(|| {
            let rivals = || (0..j.hypotheses.len()).filter(|&i| i != j.best);
            let none = |i: &usize| j.hypotheses[*i].labels.is_empty();
            rivals()
                .find(|&i| j.hypotheses[i].found.is_some())
                .or_else(|| rivals().find(none))
        });
        let Some(rival) = rival else {
            return Ok(NextExperiment::default());
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
