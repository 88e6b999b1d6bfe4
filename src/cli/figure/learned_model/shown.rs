//! How the models are shown side by side: data, numbers, pictures and claims.

use asid_core::Task;
use asid_report::plot::{Axis, Chart, Colour, Layer, Outline, Plan, Spacing};
use asid_statistics as statistics;

use super::super::map::{frame, with_fixtures};
use super::super::{Claim, Data, Number, Panel, mean};
use super::motions::Path;
use super::{CASES, Model, distances};

/// Smallest error on the axis, m.
const DRAWN: f64 = 1e-4;

/// How many times larger than the simulator's error the learned models' error must be.
const WORSE: f64 = 5.0;

/// The quantity by which learned models are judged.
const RATIO: &str = "error over that of the fitted simulator";

/// The model whose data no explorer chose.
const AIMLESS: &str = "learned from random";

/// Colours of the models: two simulators, then learned ones.
const COLOURS: [Colour; 6] = [
    Colour::Blue,
    Colour::Green,
    Colour::Vermillion,
    Colour::Ochre,
    Colour::Purple,
    Colour::Muted,
];

/// Errors by episode, and their medians by control step.
pub fn data(models: &[Model], truths: &[Vec<Path>]) -> Vec<Data> {
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

/// Errors, and the ratio of learned models' errors to those of the fitted simulator, which is the
/// first model.
pub fn numbers(models: &[Model], floor: f64) -> Vec<Number> {
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

/// Ratio of mean errors over the same episodes, which are resampled together. The denominator
/// counts as at least `floor`.
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

/// Errors over time, and an example.
pub fn panels(task: &dyn Task, models: &[Model], truths: &[Vec<Path>]) -> Vec<Panel> {
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

/// The pushed episode in which the ball went furthest, as recorded and as predicted.
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

/// Claim: outside the training data, learned models err at least [`WORSE`] times as much as the
/// fitted simulator.
///
/// The model of random actions is there for comparison: it rightly leaves a ball where it is if it
/// hardly ever saw the ball move.
pub fn claims(numbers: &[Number]) -> Vec<Claim> {
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
    vec![Claim::new(
        format!(
            "outside of their data, learned models err {low:.1} to {high:.1} times as much as the simulator that was \
             fitted to one episode; as in training {near:.1} to {far:.1} times"
        ),
        format!(
            "models learned from either data fail on motions that they were not trained on, the simulator does not; \
             {WORSE} times is asked for here"
        ),
        all().map(|n| n.n),
        low >= WORSE,
    )]
}
