//! Calibration of the diagnosis on the user's own machine: it is repeated on simulated logs.
//!
//! The identified model, and that model with each of the leading explanations as fitted, simulates
//! the logs' own commands from their own initial states. Sensor noise is added, encoders then
//! round, and readings that the logs lack are left out. The simulated logs are then diagnosed as
//! the real ones were. The probability of an answer should be how often it is right there.

mod encoders;

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

use encoders::{Steps, unrounded};

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

/// Returns an episode with other readings plus noise, rounded to steps; readings that are missing
/// stay missing.
fn replaced(
    episode: &Episode,
    logs: &Logs,
    (predicted, steps): (&[f64], &Steps),
    random: &mut impl rand::Rng,
) -> Episode {
    let mut other = episode.clone();
    let (width, all) = (logs.width(), other.readings.len() / other.time.len().max(1));
    let mut column = 0;
    for sensor in &logs.sensors {
        let step = steps.get(&sensor.name).filter(|step| **step > 0.0);
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
                    if let Some(step) = step {
                        new.iter_mut().for_each(|x| *x = (*x / step).round() * step);
                    }
                    for (old, new) in own.iter_mut().zip(new) {
                        if old.is_finite() {
                            *old = new;
                        }
                    }
                }
                range.len()
            }
            // An orientation has four columns, and three entries.
            None if sensor.rotation => 4,
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
    let values = (&explanation.fit.point.theta[..], bench.parameters.len());
    let (theta, steps) = unrounded(&members, values);
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
            theta: theta.clone(),
            starts: starts[..record.logs.episodes.len()].to_vec(),
        };
        let predicted = predictor.readings(&[point])?.pop().unwrap_or_default();
        for ((_, episode), predicted) in episodes.iter_mut().zip(&predicted) {
            if predicted.iter().any(|x| !x.is_finite()) {
                return Ok(None);
            }
            let read = (&predicted[..], &steps);
            *episode = replaced(episode, &record.logs, read, &mut random);
        }
    }
    // Simulated logs have no wiring errors.
    study.wired = true;
    Ok(Some(study))
}

/// Returns the explanations to simulate, each with the answer that is right there: the one without
/// effects, then the first [`WORLDS`] of those `found`.
///
/// Tolerances are never named. An explanation that has nothing else takes the place of the model as
/// identified (`None`).
fn worlds<'f, F>(found: impl Iterator<Item = (&'f [String], F)>) -> Vec<(Answer, Option<F>)> {
    let (mut ordinary, mut named) = (None, Vec::new());
    for (labels, found) in found {
        if labels.is_empty() {
            ordinary = Some(found);
        } else if named.len() < WORLDS {
            named.push(((Kind::Effects, labels.to_vec()), Some(found)));
        }
    }
    let mut worlds = vec![((Kind::None, Vec::new()), ordinary)];
    worlds.extend(named);
    worlds
}

/// Returns the probability that the answer to the real logs is right, by Bayes' rule over the
/// simulated worlds; `None` if none gave it, and for `unknown`.
///
/// The weight of a world is its probability times how often it gave that answer.
fn probability(
    work: &Work,
    worlds: &[(Answer, Option<&Found>)],
    said: &Answer,
    alike: &[f64],
    rows: &[CalibrationRow],
) -> Option<f64> {
    // No simulated world has a cause that the catalogue lacks.
    if said.0 == Kind::Unknown {
        return None;
    }
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
        .filter_map(|h| h.found.map(|f| (&h.labels[..], &work.findings.found[f])));
    let worlds = worlds(found);
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
        let lacks_nothing = found.is_none();
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
        if lacks_nothing {
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
    use asid_core::Scene;
    use asid_mjcf::Plant;

    use super::*;
    use crate::data::tests::{log, plant};

    /// Symptom: the verdict `none` with tolerances got about half of its probability. Cause: the
    /// tolerances were simulated as a further explanation, whose effects no answer could name.
    #[test]
    fn tolerances_alone_are_simulated_in_place_of_the_model_as_identified() {
        let labels = [vec!["backlash@hip".to_owned()], Vec::new()];
        let named = ((Kind::Effects, labels[0].clone()), Some(1));
        let found = labels.iter().map(|l| &l[..]).zip([1, 2]);
        let none = |found| ((Kind::None, Vec::new()), found);
        assert_eq!(worlds(found.clone()), [none(Some(2)), named.clone()]);
        assert_eq!(worlds(found.take(1)), [none(None), named]);
    }

    /// Symptom: a log without the orientation that other logs have was given parts of this
    /// orientation as readings. Cause: three columns of the prediction were skipped instead of
    /// four.
    #[test]
    fn a_log_without_an_orientation_gets_the_predictions_of_its_own_sensors() {
        let scene = r#"<mujoco><worldbody>
            <body name="free"><freejoint name="free"/><geom size="0.1" mass="1"/></body>
            <body><joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <sensor><framequat name="turn" objtype="body" objname="free"/>
            <jointpos name="place" joint="slide"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("scene", scene, &[]).unwrap()).unwrap();
        let (name, episode) = log("a", &[5.0, 6.0, 7.0]);
        let sensors = ["turn".to_owned(), "place".to_owned()];
        let mut logs = Logs::new(&plant, &sensors, vec![(name, episode.clone())]).unwrap();
        logs.set_noise(&[0.0, 0.0]);
        let row = |place: f64| [1.0, 0.0, 0.0, 0.0, place];
        let predicted = [row(1.0), row(2.0), row(3.0)].concat();
        let mut random = Streams::new(0).stream("calibration");
        let read = (&predicted[..], &Steps::new());
        let other = replaced(&episode, &logs, read, &mut random);
        assert_eq!(other.readings, [1.0, 2.0, 3.0]);
    }

    /// Symptom: with a coarse encoder the verdict was said to be right in none of the simulated
    /// diagnoses. Cause: noise was added after the rounding, so that no simulated log showed steps.
    #[test]
    fn a_simulated_encoder_rounds_its_noise() {
        let (name, episode) = log("a", &[0.0; 400]);
        let prepared = |episode: &Episode| {
            let logs = vec![(name.clone(), episode.clone())];
            Logs::new(&plant(), &["place".to_owned()], logs).unwrap()
        };
        let mut logs = prepared(&episode);
        logs.set_noise(&[0.001]);
        let predicted: Vec<f64> = (0..400).map(|k| 2.5e-4 * f64::from(k)).collect();
        let mut random = Streams::new(0).stream("calibration");
        let read = (&predicted[..], &Steps::from([("place".to_owned(), 0.01)]));
        let other = replaced(&episode, &logs, read, &mut random);
        let step = crate::noise::step(&prepared(&other), 0);
        assert!((step - 0.01).abs() < 1e-9, "{step}");
    }

    #[test]
    fn a_turn_keeps_the_length_and_is_by_half_of_the_vector() {
        let mut q = [1.0, 0.0, 0.0, 0.0];
        turned(&mut q, [0.02, 0.0, -0.01]);
        assert!((q.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((2.0 * q[1] - 0.02).abs() < 1e-5 && (2.0 * q[3] + 0.01).abs() < 1e-5);
    }
}
