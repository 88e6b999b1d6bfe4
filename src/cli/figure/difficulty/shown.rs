//! How methods are shown over the levels: pictures, table and claims.

use asid_comparison::grid::{Entry, Grid};
use asid_core::Task;
use asid_core::difficulty::Difficulty;
use asid_report::plot::{Axis, Chart, Colour, Layer};
use asid_statistics as statistics;

use super::super::{Claim, Panel};
use super::Point;

/// Colours of methods, in their order.
const COLOURS: [Colour; 7] = [
    Colour::Blue,
    Colour::Vermillion,
    Colour::Green,
    Colour::Purple,
    Colour::Ochre,
    Colour::Ink,
    Colour::Muted,
];

/// Distance between the whiskers of two methods, as a share of the axis.
const APART: f64 = 0.006;

/// Names of the methods, in their order.
fn methods(points: &[(f64, Vec<Point>)]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for point in points.iter().flat_map(|(_, of)| of) {
        if !names.contains(&&*point.method) {
            names.push(&point.method);
        }
    }
    names
}

/// A line with whiskers for each method; `value` gives the drawn value with its interval.
fn lines(chart: Chart, points: &[(f64, Vec<Point>)], value: impl Fn(&Point) -> [f64; 3]) -> Chart {
    let along = points.iter().map(|(level, _)| *level);
    let width =
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min);
    let names = methods(points);
    let middle = (names.len() as f64 - 1.0) / 2.0;
    names.iter().enumerate().fold(chart, |chart, (i, name)| {
        let shift = (i as f64 - middle) * APART * width;
        let of: Vec<[f64; 4]> = points
            .iter()
            .filter_map(|(level, all)| {
                let point = all.iter().find(|p| p.method == *name)?;
                let [mean, low, high] = value(point);
                Some([level + shift, mean, low, high])
            })
            .collect();
        let colour = COLOURS[i % COLOURS.len()];
        let middles: Vec<[f64; 2]> = of.iter().map(|p| [p[0], p[1]]).collect();
        let ends = of.iter().map(|p| [p[0], p[2], p[3]]).collect();
        chart
            .layer(Layer::whiskers(ends).colour(colour))
            .layer(Layer::line(middles.clone()).colour(colour).label(*name))
            .layer(Layer::dots(middles).colour(colour))
    })
}

/// Success over the levels.
pub fn success(setting: &Difficulty, points: &[(f64, Vec<Point>)]) -> Panel {
    let title = "Success";
    let y = Axis::new("success", "%").domain([-4.0, 104.0]);
    let chart = Chart::new(title, Axis::new(&setting.name, &setting.unit), y);
    let percent = |p: &Point| {
        let [low, high] = statistics::wilson(p.successes, p.n);
        [p.successes as f64 / p.n.max(1) as f64, low, high].map(|x| 100.0 * x)
    };
    let caption = "Whiskers: Wilson's 95 % intervals. Methods stand a little apart so that equal values show.";
    Panel::new(title, lines(chart, points, percent), caption)
}

/// The task's metric over the levels.
pub fn metric(task: &dyn Task, setting: &Difficulty, points: &[(f64, Vec<Point>)]) -> Panel {
    let protocol = task.downstream();
    let title = "Metric";
    let y = Axis::new(&protocol.metric, &protocol.unit).zero();
    let chart = Chart::new(title, Axis::new(&setting.name, &setting.unit), y);
    let caption = "Interquartile mean with its 95 % bootstrap interval; lower is better.";
    Panel::new(title, lines(chart, points, |p| p.metric), caption)
}

/// Success by level and method.
pub fn table(setting: &Difficulty, points: &[(f64, Vec<Point>)]) -> Grid {
    let caption = "Success over all conditions with Wilson's 95 % interval.";
    let names = methods(points);
    let head = format!("{} {}", setting.name, setting.unit);
    let grid = Grid::new("Success by level", caption).text(head.trim_end());
    let mut grid = names.iter().fold(grid, |grid, name| grid.number(name));
    for (level, of) in points {
        let mut row: Vec<Entry> = vec![level.to_string().into()];
        row.extend(names.iter().map(|name| {
            let point = of.iter().find(|p| p.method == *name);
            let text = point.map_or_else(String::new, |p| {
                let [low, high] = statistics::wilson(p.successes, p.n);
                let (low, high) = (100.0 * low, 100.0 * high);
                format!("{} of {} ({low:.0} to {high:.0} %)", p.successes, p.n)
            });
            Entry::from(text)
        }));
        grid.rows.push(row);
    }
    grid
}

/// Claim: at every level, no method but the oracle is better than `asid`.
pub fn claims(points: &[(f64, Vec<Point>)]) -> Vec<Claim> {
    let interval = |p: &Point| statistics::wilson(p.successes, p.n);
    let (mut first, mut apart, mut counted) = (0, 0, 0);
    let mut runs = Vec::new();
    for (_, of) in points {
        let Some(asid) = of.iter().find(|p| p.method == "asid") else {
            continue;
        };
        let others = of
            .iter()
            .filter(|p| !["asid", "oracle"].contains(&&*p.method));
        let others: Vec<&Point> = others.collect();
        if others.is_empty() {
            continue;
        }
        let rate = |p: &Point| p.successes as f64 / p.n.max(1) as f64;
        counted += 1;
        runs.push(asid.n);
        runs.extend(others.iter().map(|p| p.n));
        first += usize::from(others.iter().all(|p| rate(asid) >= rate(p)));
        apart += usize::from(others.iter().all(|p| interval(asid)[0] > interval(p)[1]));
    }
    if counted == 0 {
        return Vec::new();
    }
    vec![Claim::new(
        format!(
            "asid succeeds most often at {first} of {counted} levels, with its interval apart from all others' at \
             {apart}"
        ),
        "shows no such curve; ASID succeeds more often than every baseline (table 1)",
        runs,
        first == counted,
    )]
}
