//! Success of methods as a task gets harder: a comparison for each level of one difficulty, kept in the
//! figure's folder, so that a figure that was stopped goes on.

use std::path::Path;

use anyhow::Result;
use asid_comparison::grid::{Entry, Grid};
use asid_comparison::rows::Row;
use asid_comparison::statistics;
use asid_core::difficulty::Difficulty;
use asid_core::{Error, Task};
use asid_report::plot::{Axis, Chart, Colour, Layer};

use super::{Claim, Data, Drawing, Panel, Request, share, task};

/// The task that is shown where none is named.
const TASK: &str = "rod-balancing";

/// Difficulty and levels of a task where none are given, the easiest first: its own value, what is easier
/// once, and what is harder until the rod's ledge is an eighth as wide, or a goal a fifth as large.
const LEVELS: [(&str, &str, [f64; 5]); 4] = [
    (
        "rod-balancing",
        "ledge_width",
        [0.06, 0.04, 0.02, 0.01, 0.005],
    ),
    (
        "sphere-striking",
        "goal_radius",
        [0.1, 0.05, 0.03, 0.02, 0.01],
    ),
    (
        "sphere-patches",
        "goal_radius",
        [0.1, 0.05, 0.03, 0.02, 0.01],
    ),
    ("shuffleboard", "zone_length", [0.25, 0.15, 0.1, 0.06, 0.03]),
];

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

/// How far apart the whiskers of two methods stand, as a share of the axis.
const APART: f64 = 0.006;

/// Runs of a method at a level, over all conditions.
struct Point {
    method: String,
    successes: usize,
    n: usize,
    /// Interquartile mean of the metric and its interval.
    metric: [f64; 3],
}

pub fn draw(request: &Request<'_>, kept: &Path) -> Result<Drawing> {
    let name = match &request.tasks[..] {
        [] => TASK,
        [one] => one,
        _ => return Err(wrong("difficulty", "is shown of one task at a time")),
    };
    let task = task(name)?;
    let (setting, levels) = levels(request, &*task)?;
    let mut data = Data::new(
        "difficulty.csv",
        &[
            "level",
            "method",
            "world",
            "engine",
            "condition",
            "n",
            "success_rate",
            "iqm",
            "iqm_low",
            "iqm_high",
        ],
    );
    let mut points: Vec<(f64, Vec<Point>)> = Vec::new();
    for level in levels {
        let assigned = format!("{}={level}", setting.name);
        let folder = kept.join(&assigned);
        let result = (request.compare)(name, &format!("difficulty.{assigned}"), &folder)?;
        data.rows.extend(result.rows.iter().map(|r| csv(level, r)));
        points.push((level, pooled(&result.rows)));
    }
    let unit = &setting.unit;
    let mut drawing = Drawing {
        data: vec![data],
        panels: vec![
            success(&setting, &points),
            metric(&*task, &setting, &points),
        ],
        tables: vec![table(&setting, &points)],
        claims: claims(&points),
        ..Drawing::new(
            &format!("{name} as it gets harder"),
            format!(
                "Success of methods on {name} over {}, {}, all conditions together. Each level is a comparison of \
                 its own in levels/, with the same seeds.",
                setting.name, setting.about
            ),
        )
    };
    for (level, of) in &points {
        drawing.numbers.extend(of.iter().map(|p| {
            let quantity = format!("success at {} = {level} {unit}", setting.name);
            share(&p.method, quantity.trim_end(), p.successes, p.n)
        }));
    }
    Ok(drawing)
}

fn wrong(key: &str, message: impl Into<String>) -> anyhow::Error {
    Error::Config {
        key: key.to_owned(),
        message: message.into(),
    }
    .into()
}

/// The difficulty and its levels: as asked for, else the task's own. A quick look has the first, the middle
/// and the last.
fn levels(request: &Request<'_>, task: &dyn Task) -> Result<(Difficulty, Vec<f64>)> {
    let (name, mut levels) = match &request.levels {
        Some(text) => read(text)?,
        None => {
            let own = LEVELS.iter().find(|(name, ..)| *name == task.name());
            let (_, name, levels) = own.ok_or_else(|| {
                let known: Vec<String> = task.difficulty().into_iter().map(|d| d.name).collect();
                let message = format!(
                    "`{}` has no levels of its own: give NAME=VALUE,VALUE with one of {}",
                    task.name(),
                    known.join(", ")
                );
                wrong("--levels", message)
            })?;
            ((*name).to_owned(), levels.to_vec())
        }
    };
    let all = task.difficulty();
    let known = || all.iter().map(|d| &*d.name);
    let found = all.iter().find(|d| d.name == name);
    let found = found.ok_or_else(|| Error::unknown("difficulty", &name, known()))?;
    for level in &levels {
        found.check(*level)?;
    }
    if request.quick && request.levels.is_none() {
        levels = vec![
            levels[0],
            levels[levels.len() / 2],
            levels[levels.len() - 1],
        ];
    }
    Ok((found.clone(), levels))
}

/// `NAME=VALUE,VALUE`.
fn read(text: &str) -> Result<(String, Vec<f64>)> {
    let shape = || wrong("--levels", format!("`{text}` is not NAME=VALUE,VALUE"));
    let (name, values) = text.split_once('=').ok_or_else(shape)?;
    let values: Result<Vec<f64>> = values
        .split(',')
        .map(|v| v.trim().parse().map_err(|_| shape()))
        .collect();
    Ok((name.trim().to_owned(), values?))
}

fn csv(level: f64, row: &Row) -> Vec<String> {
    let s = &row.summary;
    let names = [&row.method, &row.world, &row.backend, &row.condition];
    let numbers = [
        s.success_rate,
        s.iqm,
        s.iqm_interval95[0],
        s.iqm_interval95[1],
    ];
    let mut cells = vec![level.to_string()];
    cells.extend(names.map(String::clone));
    cells.push(s.n.to_string());
    cells.extend(numbers.map(|x| format!("{x:.5}")));
    cells
}

/// Methods over all conditions; named with world and engine where there are several of these.
fn pooled(rows: &[Row]) -> Vec<Point> {
    let several = |pick: fn(&Row) -> &String| rows.iter().any(|r| pick(r) != pick(&rows[0]));
    let (worlds, engines) = (several(|r| &r.world), several(|r| &r.backend));
    let label = |row: &Row| {
        let parts = [
            (true, &row.method),
            (worlds, &row.world),
            (engines, &row.backend),
        ];
        let shown = parts.iter().filter(|(shown, _)| *shown);
        let words: Vec<&str> = shown.map(|(_, name)| name.as_str()).collect();
        words.join(", ")
    };
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        if !names.contains(&label(row)) {
            names.push(label(row));
        }
    }
    names
        .into_iter()
        .map(|method| {
            let of: Vec<&Row> = rows.iter().filter(|r| label(r) == method).collect();
            let successes = of
                .iter()
                .map(|r| (r.summary.success_rate * r.summary.n as f64).round() as usize);
            let values: Vec<Vec<f64>> = of.iter().map(|r| r.values.clone()).collect();
            let [low, high] = statistics::bootstrap(&values, statistics::interquartile_mean);
            Point {
                successes: successes.sum(),
                n: of.iter().map(|r| r.summary.n).sum(),
                metric: [statistics::interquartile_mean(&values.concat()), low, high],
                method,
            }
        })
        .collect()
}

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

/// A line with whiskers for each method; `value` gives what is drawn with its interval.
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

fn success(setting: &Difficulty, points: &[(f64, Vec<Point>)]) -> Panel {
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

fn metric(task: &dyn Task, setting: &Difficulty, points: &[(f64, Vec<Point>)]) -> Panel {
    let protocol = task.downstream();
    let title = "Metric";
    let y = Axis::new(&protocol.metric, &protocol.unit).zero();
    let chart = Chart::new(title, Axis::new(&setting.name, &setting.unit), y);
    let caption = "Interquartile mean with its 95 % bootstrap interval; lower is better.";
    Panel::new(title, lines(chart, points, |p| p.metric), caption)
}

fn table(setting: &Difficulty, points: &[(f64, Vec<Point>)]) -> Grid {
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

/// The method `asid` is behind no other one but the oracle, at any level.
fn claims(points: &[(f64, Vec<Point>)]) -> Vec<Claim> {
    let interval = |p: &Point| statistics::wilson(p.successes, p.n);
    let (mut first, mut apart, mut counted) = (0, 0, 0);
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
        first += usize::from(others.iter().all(|p| rate(asid) >= rate(p)));
        apart += usize::from(others.iter().all(|p| interval(asid)[0] > interval(p)[1]));
    }
    if counted == 0 {
        return Vec::new();
    }
    vec![Claim {
        statement: format!(
            "asid succeeds most often at {first} of {counted} levels, with its interval apart from all others' at \
             {apart}"
        ),
        paper: "shows no such curve; ASID succeeds more often than every baseline (table 1)".into(),
        holds: first == counted,
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_read_and_the_own_ones_fit_their_tasks() {
        let (name, values) = read("ledge_width=0.04,0.02").unwrap();
        assert_eq!((&*name, &values[..]), ("ledge_width", &[0.04, 0.02][..]));
        assert!(read("ledge_width").is_err() && read("ledge_width=a").is_err());
        for (name, setting, levels) in LEVELS {
            let task = task(name).unwrap();
            let all = task.difficulty();
            let found = all.iter().find(|d| d.name == setting).unwrap();
            for level in levels {
                found.check(level).unwrap();
            }
            assert!(levels.contains(&found.default), "{name}");
        }
    }
}
