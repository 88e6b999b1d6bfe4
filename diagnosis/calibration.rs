//! Calibration of the diagnosis on the user's own machine: it is repeated on simulated logs.
//!
//! The identified model, and that model with each of the leading explanations as fitted, simulates
//! the logs' own commands from their own initial states. Sensor noise is added, and readings that
//! the logs lack are left out. The simulated logs are then diagnosed as the real ones were. The
//! probability of an answer should be how often it is right there.

use asid_core::{Episode, Progress, Result, Streams};
use rand_distr::StandardNormal;

use crate::data::Logs;
use crate::findings::{Found, trials};
use crate::machine::Machine;
use crate::physics::diagnose_physics;
use crate::predict::Point;
use crate::result::{Calibration, CalibrationRow, Kind};
use crate::settings::Settings;
use crate::study::Study;
use crate::telling::Diagnosis;
use crate::work::Work;

/// Maximum number of simulated explanations, besides the one without effects: each needs several
/// runs.
const WORLDS: usize = 4;

/// Progress of a run within a calibration: silent, and stopped when the whole is.
struct Within<'a>(&'a dyn Progress);

impl Progress for Within<'_> {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _units: u64) {}
    fn end(&self) {}
    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}

/// An answer: its kind, with the effects that the verdict names.
type Answer = (Kind, Vec<String>);

fn answer(diagnosis: &Diagnosis) -> Answer {
    let verdict = &diagnosis.result.verdict;
    let mut effects = verdict.effects.clone();
    effects.sort();
    (verdict.kind, effects)
}

/// Rotates a unit quaternion by a small rotation vector in body axes.
fn turned(q: &mut [f64], by: [f64; 3]) {
    let [w, x, y, z] = [1.0, 0.5 * by[0], 0.5 * by[1], 0.5 * by[2]];
    let [a, b, c, d] = [q[0], q[1], q[2], q[3]];
    let product = [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ];
    let norm = product.iter().map(|p| p * p).sum::<f64>().sqrt();
    for (q, p) in q.iter_mut().zip(product) {
        *q = p / norm;
    }
}

/// Returns an episode with other readings plus noise; readings that are missing stay missing.
fn replaced(
    episode: &Episode,
    logs: &Logs,
    predicted: &[f64],
    random: &mut impl rand::Rng,
) -> Episode {
    let mut other = episode.clone();
    let (width, all) = (logs.width(), other.readings.len() / other.time.len().max(1));
    let mut column = 0;
    for sensor in &logs.sensors {
        let len = match other.channel(&sensor.name) {
            Some(range) => {
                for k in 0..predicted.len() / width {
                    let own = &mut other.readings[k * all + range.start..k * all + range.end];
                    let mut new = predicted[k * width + column..][..range.len()].to_vec();
                    let mut noise = || sensor.noise * random.sample::<f64, _>(StandardNormal);
                    if sensor.rotation {
                        turned(&mut new, [noise(), noise(), noise()]);
                    } else {
                        new.iter_mut().for_each(|x| *x += noise());
                    }
                    for (old, new) in own.iter_mut().zip(new) {
                        if old.is_finite() {
                            *old = new;
                        }
                    }
                }
                range.len()
            }
            None => logs
                .entries
                .iter()
                .filter(|e| logs.sensors[e.sensor].name == sensor.name)
                .count(),
        };
        column += len;
    }
    other
}

/// Returns the study with logs that an explanation has simulated; `None` if it diverges.
fn played(study: &Study, work: &Work, found: Option<&Found>, seed: u64) -> Result<Option<Study>> {
    let bench = &work.bench;
    let explanation = found.map_or(&work.findings.none, |f| &f.explanation);
    let members = found.map_or_else(Vec::new, |f| {
        trials(&work.candidates, &f.candidates, &f.explanation)
    });
    let mut random = Streams::new(seed).stream("calibration");
    let mut study = study.clone();
    let starts = [&explanation.fit.point.starts, &explanation.held_starts];
    for (held_out, starts) in [false, true].into_iter().zip(starts) {
        let (episodes, record) = if held_out {
            (&mut study.test, &bench.test)
        } else {
            (&mut study.train, &bench.train)
        };
        let mut predictor = bench.predictor(&members, record)?;
        let point = Point {
            theta: explanation.fit.point.theta.clone(),
            starts: starts[..record.logs.episodes.len()].to_vec(),
        };
        let predicted = predictor.readings(&[point])?.pop().unwrap_or_default();
        for ((_, episode), predicted) in episodes.iter_mut().zip(&predicted) {
            if predicted.iter().any(|x| !x.is_finite()) {
                return Ok(None);
            }
            *episode = replaced(episode, &record.logs, predicted, &mut random);
        }
    }
    // Simulated logs have no wiring errors.
    study.wired = true;
    Ok(Some(study))
}

/// Returns the probability that the answer to the real logs is right, by Bayes' rule over the
/// simulated worlds; `None` if none gave it.
///
/// The weight of a world is its probability times how often it gave that answer.
fn probability(
    work: &Work,
    worlds: &[(Answer, Option<&Found>)],
    said: &Answer,
    alike: &[f64],
    rows: &[CalibrationRow],
) -> Option<f64> {
    let prior = |effects: &[String]| -> f64 {
        let all = work.judgement.hypotheses.iter();
        all.filter(|h| h.labels == effects)
            .map(|h| h.probability)
            .sum()
    };
    let (mut right, mut all) = (0.0, 0.0);
    for (((truth, _), alike), row) in worlds.iter().zip(alike).zip(rows) {
        let weight = prior(&truth.1) * alike / row.runs.max(1) as f64;
        all += weight;
        if truth == said {
            right += weight;
        }
    }
    (all > 0.0).then(|| right / all)
}

/// Repeats a diagnosis on simulated logs until the work is stopped.
///
/// # Errors
/// When the engine fails.
pub fn calibrate(
    study: &Study,
    machine: &Machine,
    (diagnosis, work): (&Diagnosis, &Work),
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Calibration> {
    let hypotheses = work.judgement.hypotheses.iter();
    // Sets that contain the verdict and more are not simulated: the answer could not show what
    // there is beyond it.
    let verdict = &work.judgement.best_explanation().labels;
    let is_more = |labels: &[String]| {
        !verdict.is_empty()
            && labels.len() > verdict.len()
            && verdict.iter().all(|l| labels.contains(l))
    };
    let found = hypotheses
        .filter(|h| !is_more(&h.labels))
        .filter_map(|h| h.found.map(|f| (&h.labels, &work.findings.found[f])));
    let mut worlds: Vec<(Answer, Option<&Found>)> = vec![((Kind::None, Vec::new()), None)];
    worlds.extend(
        found
            .take(WORLDS)
            .map(|(l, f)| ((Kind::Effects, l.clone()), Some(f))),
    );
    let mut rows: Vec<CalibrationRow> = worlds
        .iter()
        .map(|((_, effects), _)| CalibrationRow {
            effects: effects.clone(),
            ..CalibrationRow::default()
        })
        .collect();
    let [mut as_large, mut of_none] = [0.0; 2];
    // Number of runs of each world that gave the real logs' answer.
    let mut alike = vec![0.0; worlds.len()];
    let said = answer(diagnosis);
    progress.begin("calibrating", 0);
    let mut idle = 0;
    for run in 0_u64.. {
        let place = run as usize % worlds.len();
        let (truth, found) = &worlds[place];
        if progress.is_stopped() || idle == worlds.len() {
            break;
        }
        let seed = settings
            .breadth
            .seed
            .wrapping_add(1 + run / worlds.len() as u64);
        let Some(other) = played(study, work, *found, seed)? else {
            idle += 1;
            continue;
        };
        let mut settings = settings.clone();
        settings.breadth.seed = seed;
        progress.note(&format!("run {}", run + 1));
        let (found, _) = diagnose_physics(&other, machine.clone(), settings, &Within(progress))?;
        // A run that was cut short gives no answer.
        if progress.is_stopped() {
            break;
        }
        idle = 0;
        let answered = answer(&found);
        let row = &mut rows[place];
        row.runs += 1;
        row.probability += found.result.verdict.probability;
        match &answered {
            a if a == truth => row.right += 1,
            (Kind::None, _) => row.none += 1,
            (Kind::Unknown, _) => row.unknown += 1,
            _ => row.other += 1,
        }
        if truth.0 == Kind::None {
            of_none += 1.0;
            if found.result.gap.identified >= diagnosis.result.gap.identified {
                as_large += 1.0;
            }
        }
        if answered == said {
            alike[place] += 1.0;
        }
    }
    progress.end();
    rows.iter_mut()
        .for_each(|r| r.probability /= r.runs.max(1) as f64);
    Ok(Calibration {
        runs: rows.iter().map(|r| r.runs).sum(),
        probability: probability(work, &worlds, &said, &alike, &rows),
        p_no_gap: (of_none > 0.0).then(|| (1.0 + as_large) / (1.0 + of_none)),
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_keeps_the_length_and_is_by_half_of_the_vector() {
        let mut q = [1.0, 0.0, 0.0, 0.0];
        turned(&mut q, [0.02, 0.0, -0.01]);
        assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((2.0 * q[1] - 0.02).abs() < 1e-5 && (2.0 * q[3] + 0.01).abs() < 1e-5);
    }
}
