//! A model of the motion that is learned from explorers' episodes beside the simulator: how far off are they
//! where nothing was seen?
//!
//! One real world with one hidden truth. Ensembles of probabilistic networks learn its motion from an
//! explorer's episodes; the simulator is fitted to a single one of them. Both predict episodes open loop, from
//! the start and the actions alone: the ball pushed from starts outside of the training box, and left alone
//! there.

mod motions;

use anyhow::Result;
use asid_comparison::statistics;
use asid_core::{Streams, Task};
use asid_learned::max::EnsembleSettings;
use asid_learned::shipped;
use asid_nn::{Motion, MotionModel};
use asid_report::plot::{Axis, Chart, Colour, Layer, Outline, Plan, Spacing};
use rand::Rng as _;

use super::episodes::{Played, Wanted, by_explorer, of_each, open, play, playable};
use super::map::{frame, with_fixtures};
use super::{Claim, Data, Drawing, Number, Panel, Request, mean, task};
use motions::{Move, Path, fitted, motion, moved, path, simulated};

const TASK: &str = "sphere-striking";

/// Sensors of what the models predict: the ball, and the hand that pushes it.
const BALL: &str = "ball_pos";
const HAND: &str = "ee_pos";

/// Episodes that a model learns from: with 20 control steps each, 1200 transitions.
const EPISODES: u64 = 60;

/// Episodes of a test for each three that are learned from.
const TESTED: u64 = 3;

/// Passes over the transitions: ten times those of a round of MAX, which has as many rounds.
const EPOCHS: usize = 200;

/// How far beyond the training box a start may lie, m.
const BEYOND: f64 = 0.12;

/// Free space between a start and what bounds the scene, m: a ball and a half.
const MARGIN: f64 = 0.09;

/// Errors are drawn from here on, m.
const DRAWN: f64 = 1e-4;

/// How many times the simulator's the learned models' error has to be.
const WORSE: f64 = 5.0;

/// What learned models are judged by.
const RATIO: &str = "error over that of the fitted simulator";

/// The model whose data no explorer chose.
const AIMLESS: &str = "learned from random";

/// What is predicted.
const CASES: [&str; 3] = [
    "as in training",
    "pushed from outside",
    "left alone outside",
];

/// Colours of the models: two simulators, then learned ones.
const COLOURS: [Colour; 6] = [
    Colour::Blue,
    Colour::Green,
    Colour::Vermillion,
    Colour::Ochre,
    Colour::Purple,
    Colour::Muted,
];

/// A model with the paths that it predicts, by case and episode.
struct Model {
    label: String,
    learned: bool,
    paths: Vec<Vec<Path>>,
    /// Root of the mean squared distance over control steps, m, by case and episode.
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
                 of each kind are predicted; outside: up to {BEYOND} m beyond the starts of training. Errors of the \
                 simulator count as at least the tracker's noise, {floor} m."
            ),
        )
    };
    drawing.claims = claims(&drawing.numbers);
    Ok(drawing)
}

/// Settings that hold the hidden truth, drawn by the first seed, for all episodes.
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

/// Episodes whose starts lie beyond the box of training, where there is room.
fn outside(
    request: &Request<'_>,
    task: &dyn Task,
    set: &[&str],
    first: u64,
    count: u64,
) -> Vec<Wanted> {
    let start = &task.exploration().start;
    let bounds = task.top_view().bounds;
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

/// The simulator in the middle of the prior, and fitted to an episode.
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

/// A model that learned from an explorer's episodes.
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
        // The start is given.
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

fn data(models: &[Model], truths: &[Vec<Path>]) -> Vec<Data> {
    let mut errors = Data::new("errors.csv", &["case", "episode", "model", "error_m"]);
    let mut steps = Data::new("steps.csv", &["case", "model", "step", "median_error_m"]);
    for model in models {
        let label = model.label.replace(',', "");
        for (c, case) in CASES.iter().enumerate() {
            for (e, error) in model.errors[c].iter().enumerate() {
                let head = [(*case).to_owned(), e.to_string(), label.clone()];
                errors
                    .rows
                    .push([&head[..], &[format!("{error:.6}")]].concat());
            }
            for (step, error) in medians(model, truths, c).into_iter().enumerate() {
                let head = [(*case).to_owned(), label.clone(), step.to_string()];
                steps
                    .rows
                    .push([&head[..], &[format!("{error:.6}")]].concat());
            }
        }
    }
    vec![errors, steps]
}

/// Median distance over episodes after each control step, m.
fn medians(model: &Model, truths: &[Vec<Path>], case: usize) -> Vec<f64> {
    let pairs = model.paths[case].iter().zip(&truths[case]);
    let all: Vec<Vec<f64>> = pairs.map(|(p, t)| distances(p, t)).collect();
    let steps = all.iter().map(Vec::len).min().unwrap_or(0);
    (0..steps)
        .map(|k| statistics::median(all.iter().map(|d| d[k])))
        .collect()
}

/// Errors, and those of learned models over those of the fitted simulator, which is the first model.
fn numbers(models: &[Model], floor: f64) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (c, case) in CASES.iter().enumerate() {
        for model in models {
            let quantity = format!("{case}: error of the ball's place");
            numbers.push(mean(&model.label, &quantity, "m", &model.errors[c]));
        }
        let Some(fitted) = models.iter().find(|m| !m.learned) else {
            continue;
        };
        for over in models.iter().filter(|m| m.learned) {
            let errors = [&over.errors[c], &fitted.errors[c]];
            let quantity = format!("{case}: {RATIO}");
            numbers.push(ratio(&over.label, &quantity, errors, floor));
        }
    }
    numbers
}

/// Ratio of mean errors over the same episodes, which are resampled together; the lower one counts as at
/// least `floor`.
fn ratio(label: &str, quantity: &str, [over, under]: [&Vec<f64>; 2], floor: f64) -> Number {
    let of = |episodes: &[f64]| {
        let sum = |errors: &[f64], least: f64| -> f64 {
            episodes
                .iter()
                .map(|&e| errors[e as usize].max(least))
                .sum()
        };
        sum(over, 0.0) / sum(under, floor)
    };
    let all: Vec<f64> = (0..over.len()).map(|e| e as f64).collect();
    Number {
        explorer: label.to_owned(),
        quantity: quantity.to_owned(),
        unit: String::new(),
        value: of(&all),
        interval95: statistics::bootstrap(std::slice::from_ref(&all), of),
        n: all.len(),
    }
}

fn panels(task: &dyn Task, models: &[Model], truths: &[Vec<Path>]) -> Vec<Panel> {
    let protocol = task.exploration();
    let step = protocol.frames_per_step as f64 * protocol.frame_period;
    let mut panels = Vec::new();
    for (c, case) in CASES.iter().enumerate() {
        let y = Axis::new("error of the ball's place", "m").spacing(Spacing::Log);
        let chart = Chart::new(case, Axis::new("time", "s"), y.domain([DRAWN, 1.0]));
        let chart = models.iter().enumerate().fold(chart, |chart, (i, model)| {
            let errors = medians(model, truths, c).into_iter().enumerate().skip(1);
            let points = errors.map(|(k, e)| [k as f64 * step, e.max(DRAWN)]);
            let line = Layer::line(points.collect()).colour(COLOURS[i % COLOURS.len()]);
            chart.layer(line.label(&*model.label))
        });
        let caption = "Median over episodes; what is smaller is drawn at the lower edge.";
        panels.push(Panel::new(case, chart, caption));
    }
    panels.push(example(task, models, truths));
    panels
}

/// The pushed episode in which the ball went furthest, as it was and as it was predicted.
fn example(task: &dyn Task, models: &[Model], truths: &[Vec<Path>]) -> Panel {
    let case = 1;
    let way = |path: &Path| {
        let [first, last] = [path[0], path[path.len() - 1]];
        (last[0] - first[0]).hypot(last[1] - first[1])
    };
    let furthest = |best: usize, e: usize| {
        if way(&truths[case][e]) > way(&truths[case][best]) {
            e
        } else {
            best
        }
    };
    let episode = (0..truths[case].len()).fold(0, furthest);
    let start = &task.exploration().start;
    let corners = [0, 1].map(|end| [start[0].range[end], start[1].range[end]]);
    let title = "A push from outside";
    let plan = Plan::new(title, Axis::new("x", "m"), Axis::new("y", "m"));
    let plan =
        with_fixtures(plan, task).outline(frame(corners, "starts of training", Colour::Muted));
    let plan = models.iter().enumerate().fold(plan, |plan, (i, model)| {
        let path = model.paths[case][episode].clone();
        let line = Outline::path(path).colour(COLOURS[i % COLOURS.len()]);
        plan.outline(line.strength(0.0, 0.9).series_label(&*model.label))
    });
    let truth = Outline::path(truths[case][episode].clone()).colour(Colour::Ink);
    let plan = plan.outline(truth.strength(0.0, 1.0).dashed().series_label("as it was"));
    Panel::new(title, plan, "The episode in which the ball went furthest.")
}

/// Where nothing was seen, learned models err at least [`WORSE`] times as much as the fitted simulator. What
/// random actions show is there for comparison: a ball that hardly ever moved is rightly left where it is.
fn claims(numbers: &[Number]) -> Vec<Claim> {
    let all = || numbers.iter().filter(|n| n.quantity.ends_with(RATIO));
    let aimless = |n: &&Number| n.explorer == AIMLESS;
    let only_aimless = all().all(|n| aimless(&n));
    let ratios = |holds: fn(&str) -> bool| {
        let counted = all().filter(|n| holds(&n.quantity) && (only_aimless || !aimless(n)));
        let of = statistics::sorted(counted.map(|n| n.value));
        [of.first(), of.last()].map(|x| x.copied().unwrap_or(f64::NAN))
    };
    let [low, high] = ratios(|q| q.contains("outside"));
    let [near, far] = ratios(|q| q.starts_with(CASES[0]));
    vec![Claim {
        statement: format!(
            "outside of their data, learned models err {low:.1} to {high:.1} times as much as the simulator that was \
             fitted to one episode; as in training {near:.1} to {far:.1} times"
        ),
        paper: format!(
            "models learned from either data fail on motions that they were not trained on, the simulator does not; \
             {WORSE} times is asked for here"
        ),
        holds: low >= WORSE,
    }]
}
