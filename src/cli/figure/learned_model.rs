//! A learned model of the motion, trained on explorers' episodes, compared with the simulator: how
//! large are their errors outside the training data?
//!
//! There is one real world with one hidden truth. Ensembles of probabilistic networks learn its
//! motion from an explorer's episodes. The simulator is fitted to a single one of these. Both
//! predict episodes open loop, from the start and the actions alone. In these episodes the ball is
//! pushed from starts outside the training box, or left alone there.

mod motions;
mod shown;

use anyhow::Result;
use asid_core::{Streams, Task};
use asid_learned::max::EnsembleSettings;
use asid_learned::shipped;
use asid_nn::{Motion, MotionModel};
use asid_statistics as statistics;
use rand::Rng as _;

use super::episodes::{Played, open, play};
use super::wanted::{Wanted, by_explorer, of_each, playable};
use super::{Drawing, Request, task};
use motions::{Move, Path, fitted, motion, moved, path, simulated};
use shown::{claims, data, numbers, panels};

const TASK: &str = "sphere-striking";

/// Sensors that the models predict: the ball, and the hand that pushes it.
const BALL: &str = "ball_pos";
const HAND: &str = "ee_pos";

/// Episodes that a model learns from: with 20 control steps each, 1200 transitions.
const EPISODES: u64 = 60;

/// Training episodes for each test episode.
const TESTED: u64 = 3;

/// Passes over the transitions: ten times those of a round of MAX, which has as many rounds.
const EPOCHS: usize = 200;

/// How far beyond the training box a start may lie, m.
const BEYOND: f64 = 0.12;

/// Free space between a start and the bounds of the scene, m: one and a half balls.
const MARGIN: f64 = 0.09;

/// Test cases.
const CASES: [&str; 3] = [
    "as in training",
    "pushed from outside",
    "left alone outside",
];

/// A model with its predicted paths, by case and episode.
struct Model {
    label: String,
    learned: bool,
    paths: Vec<Vec<Path>>,
    /// Root-mean-square distance over control steps, m, by case and episode.
    errors: Vec<Vec<f64>>,
}

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let task = task(TASK)?;
    let fisher = ["fisher-ppo", "fisher-cem"]
        .into_iter()
        .find(|f| *f == "fisher-cem" || shipped::find(TASK, f).is_some());
    let own = ["max", fisher.unwrap_or("fisher-cem"), "random"];
    let (explorers, notes) = playable(request, TASK, &own)?;
    let count = request.episodes(12, EPISODES);
    let tested = count.div_ceil(TESTED);
    let set = truth(request)?;
    let set: Vec<&str> = set.iter().map(|s| &**s).collect();
    let seed = request.seed();
    let training = play(
        &request.common,
        of_each(TASK, &explorers, &set, seed, count),
    )?;
    let fisher = explorers.iter().find(|e| e.starts_with("fisher"));
    let fisher = fisher.unwrap_or(&explorers[0]);
    let held_out = of_each(
        TASK,
        std::slice::from_ref(fisher),
        &set,
        seed + count,
        tested,
    );
    let outside = outside(request, &*task, &set, seed + count, tested);
    let cases = [
        play(&request.common, held_out)?,
        moved(request, outside.clone(), Move::Push)?,
        moved(request, outside, Move::Still)?,
    ];
    let truths: Vec<Vec<Path>> = cases
        .iter()
        .map(|of| of.iter().map(|e| path(&*task, e)).collect())
        .collect::<Result<_>>()?;
    let first = training.iter().find(|p| &p.wanted.explorer == fisher);
    let mut models = simulators(request, first.unwrap_or(&training[0]), &cases)?;
    for (label, of) in by_explorer(&explorers, &training) {
        models.push(learned(&*task, &label, &of, &cases, seed)?);
    }
    for model in &mut models {
        model.errors = errors(&model.paths, &truths);
    }
    let floor = noise(&*task);
    let mut drawing = Drawing {
        notes,
        data: data(&models, &truths),
        numbers: numbers(&models, floor),
        panels: panels(&*task, &models, &truths),
        ..Drawing::new(
            "A learned model of the motion beside the simulator",
            format!(
                "Ball of {TASK}, predicted open loop from its start and the actions alone. Models learn from {count} \
                 episodes of an explorer without noise; the simulator is fitted to one with noise. {tested} episodes \
                 of each kind are predicted; outside: up to {BEYOND} m beyond the starts of training. In the ratio of \
                 errors that of the simulator is taken as at least the tracker's noise, {floor} m."
            ),
        )
    };
    drawing.claims = claims(&drawing.numbers);
    Ok(drawing)
}

/// Settings that fix the hidden truth, drawn by the first seed, for all episodes.
fn truth(request: &Request<'_>) -> Result<Vec<String>> {
    let any = Wanted {
        task: TASK.into(),
        explorer: "random".into(),
        seed: request.seed(),
        ..Wanted::default()
    };
    let session = open(&request.common, &any, false)?;
    let named = session.parameters.iter().zip(session.truth());
    Ok(named
        .map(|(p, value)| format!("real.truth.{}={value:?}", p.name))
        .collect())
}

/// Episodes whose starts lie beyond the training box, where there is room.
fn outside(
    request: &Request<'_>,
    task: &dyn Task,
    set: &[&str],
    first: u64,
    count: u64,
) -> Vec<Wanted> {
    let start = &task.exploration().start;
    let bounds = task.spec().top_view.bounds;
    let range = |i: usize| {
        let low = (start[i].range[0] - BEYOND).max(bounds[0][i] + MARGIN);
        let high = (start[i].range[1] + BEYOND).min(bounds[1][i] - MARGIN);
        low..high
    };
    let inside = |place: &[f64; 2]| {
        (0..2).all(|i| (start[i].range[0]..start[i].range[1]).contains(&place[i]))
    };
    let mut rng = Streams::new(request.seed()).stream("starts outside");
    (first..first + count)
        .map(|seed| {
            let place = loop {
                let place = [0, 1].map(|i| rng.random_range(range(i)));
                if !inside(&place) {
                    break place;
                }
            };
            let mut pose: Vec<f64> = start.iter().map(|c| c.center()).collect();
            pose[..2].copy_from_slice(&place);
            Wanted {
                task: TASK.into(),
                explorer: "random".into(),
                set: set.iter().map(|&s| s.to_owned()).collect(),
                seed,
                start: Some(pose),
                ..Wanted::default()
            }
        })
        .collect()
}

/// The simulator at the middle of the prior, and the simulator fitted to an episode.
fn simulators(
    request: &Request<'_>,
    episode: &Played,
    cases: &[Vec<Played>; 3],
) -> Result<Vec<Model>> {
    let [middle, found] = fitted(request, episode)?;
    [("simulator, fitted", found), ("simulator, prior", middle)]
        .into_iter()
        .map(|(label, theta)| {
            let paths = cases.iter().map(|of| simulated(request, of, &theta));
            Ok(Model {
                label: label.to_owned(),
                learned: false,
                paths: paths.collect::<Result<_>>()?,
                errors: Vec::new(),
            })
        })
        .collect()
}

/// A model learned from an explorer's episodes.
fn learned(
    task: &dyn Task,
    label: &str,
    of: &[&Played],
    cases: &[Vec<Played>; 3],
    seed: u64,
) -> Result<Model> {
    let settings = EnsembleSettings {
        epochs: EPOCHS,
        ..EnsembleSettings::default()
    };
    let episodes: Vec<Motion> = of.iter().map(|p| motion(task, p)).collect::<Result<_>>()?;
    let model = MotionModel::fit(&settings, &episodes, seed)?;
    let predicted = |episode: &Played| -> Result<Path> {
        let wanted = motion(task, episode)?;
        let rows = model.predict(&wanted.places[0], &wanted.actions)?;
        Ok(rows.iter().map(|r| [r[0], r[1]]).collect())
    };
    let paths = cases.iter().map(|of| of.iter().map(predicted).collect());
    Ok(Model {
        label: format!("learned from {label}"),
        learned: true,
        paths: paths.collect::<Result<_>>()?,
        errors: Vec::new(),
    })
}

/// Distances of a predicted path from the true one, m.
fn distances(predicted: &Path, truth: &Path) -> Vec<f64> {
    let pairs = predicted.iter().zip(truth);
    pairs
        .map(|(p, t)| (p[0] - t[0]).hypot(p[1] - t[1]))
        .collect()
}

fn errors(paths: &[Vec<Path>], truths: &[Vec<Path>]) -> Vec<Vec<f64>> {
    let one = |(predicted, truth): (&Path, &Path)| {
        // The start is given, so it has no error.
        let squares: Vec<f64> = distances(predicted, truth)[1..]
            .iter()
            .map(|d| d * d)
            .collect();
        statistics::mean(&squares).sqrt()
    };
    let cases = paths.iter().zip(truths);
    cases
        .map(|(of, truth)| of.iter().zip(truth).map(one).collect())
        .collect()
}

/// Noise of the ball's tracker, m.
fn noise(task: &dyn Task) -> f64 {
    let signals = task.exploration().signals.iter();
    signals
        .filter(|s| s.sensor == BALL)
        .fold(0.0, |most, s| s.noise.max(most))
}
