//! Runs, and the rows that sum them up.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::super::result::figure;
use super::statistics::{bootstrap, interquartile_mean, median};

/// What one run found of one unknown.
#[derive(Clone, Serialize, Deserialize)]
pub struct RunParameter {
    pub name: String,
    pub unit: String,
    pub truth: f64,
    pub estimate: f64,
    pub std: f64,
    pub interval95: [f64; 2],
    pub expected_std: Option<f64>,
}

/// One run of a method.
#[derive(Clone, Serialize, Deserialize)]
pub struct Run {
    pub task: String,
    pub condition: String,
    pub method: String,
    pub backend: String,
    pub seed: u64,
    pub parameters: Vec<RunParameter>,
    pub residual: Option<f64>,
    pub contact_fraction: Option<f64>,
    pub metric: String,
    pub value: f64,
    pub success: bool,
    pub wall_s: f64,
}

impl Run {
    /// True where both are runs of one row.
    fn row_mate(&self, other: &Self) -> bool {
        (&self.task, &self.condition, &self.method, &self.backend)
            == (&other.task, &other.condition, &other.method, &other.backend)
    }

    /// True where both are the same run.
    pub fn same_as(&self, other: &Self) -> bool {
        self.row_mate(other) && self.seed == other.seed
    }
}

/// How well one unknown was identified over the runs of a row.
#[derive(Serialize)]
pub struct Identification {
    pub name: String,
    pub unit: String,
    pub median_abs_error: f64,
    pub coverage95: f64,
    pub median_width95: f64,
    pub median_expected_std: Option<f64>,
}

/// One row of the table.
#[derive(Serialize)]
pub struct Row {
    pub task: String,
    pub condition: String,
    pub method: String,
    pub backend: String,
    pub metric: String,
    pub n: usize,
    pub mean: f64,
    pub std: f64,
    pub iqm: f64,
    pub interval95: [f64; 2],
    pub success_rate: f64,
    pub values: Vec<f64>,
    pub paper: Option<f64>,
    pub identification: Vec<Identification>,
}

/// `result.json` of `compare`.
#[derive(Serialize)]
pub struct CompareResult {
    pub schema: u32,
    pub rows: Vec<Row>,
    pub versions: serde_json::Value,
}

/// One row a task, condition, method and engine, in the order of their first runs.
pub fn rows(runs: &[Run]) -> Vec<Row> {
    let mut groups: Vec<Vec<&Run>> = Vec::new();
    for run in runs {
        match groups.iter_mut().find(|g| g[0].row_mate(run)) {
            Some(group) => group.push(run),
            None => groups.push(vec![run]),
        }
    }
    groups.iter().map(|g| row(g)).collect()
}

fn row(runs: &[&Run]) -> Row {
    let first = runs[0];
    let values: Vec<f64> = runs.iter().map(|r| r.value).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    // Without identification there is nothing to say of the unknowns but the prior.
    let identified = first.residual.is_some();
    let identification = (0..if identified {
        first.parameters.len()
    } else {
        0
    })
        .map(|i| {
            let of = || runs.iter().map(|r| &r.parameters[i]);
            let held = of().filter(|p| p.interval95[0] <= p.truth && p.truth <= p.interval95[1]);
            let expected = median(of().filter_map(|p| p.expected_std));
            Identification {
                name: first.parameters[i].name.clone(),
                unit: first.parameters[i].unit.clone(),
                median_abs_error: median(of().map(|p| (p.estimate - p.truth).abs())),
                coverage95: held.count() as f64 / n,
                median_width95: median(of().map(|p| p.interval95[1] - p.interval95[0])),
                median_expected_std: expected.is_finite().then_some(expected),
            }
        })
        .collect();
    Row {
        task: first.task.clone(),
        condition: first.condition.clone(),
        method: first.method.clone(),
        backend: first.backend.clone(),
        metric: first.metric.clone(),
        n: values.len(),
        mean,
        std: variance.sqrt(),
        iqm: interquartile_mean(&values),
        interval95: bootstrap(&values),
        success_rate: runs.iter().filter(|r| r.success).count() as f64 / n,
        values,
        paper: None,
        identification,
    }
}

/// Titles of the table's columns.
pub const COLUMNS: [&str; 11] = [
    "task",
    "engine",
    "condition",
    "method",
    "n",
    "metric",
    "mean (95 %)",
    "success",
    "median error",
    "coverage of 95 %",
    "width of 95 %",
];

/// Cells of a row, in the order of [`COLUMNS`].
pub fn cells(r: &Row) -> [String; 11] {
    let list = |f: &dyn Fn(&Identification) -> String| {
        r.identification
            .iter()
            .map(f)
            .collect::<Vec<_>>()
            .join(", ")
    };
    // Metrics in metres or radians are small numbers.
    let digits = if r.interval95[1].abs() < 1.0 { 3 } else { 1 };
    [
        r.task.clone(),
        r.backend.clone(),
        r.condition.clone(),
        r.method.clone(),
        r.n.to_string(),
        r.metric.clone(),
        format!(
            "{:.digits$} ({:.digits$} to {:.digits$})",
            r.mean, r.interval95[0], r.interval95[1]
        ),
        format!("{:.0} %", 100.0 * r.success_rate),
        list(&|i| with_unit(i.median_abs_error, &i.unit)),
        list(&|i| format!("{:.0} %", 100.0 * i.coverage95)),
        list(&|i| with_unit(i.median_width95, &i.unit)),
    ]
}

fn with_unit(x: f64, unit: &str) -> String {
    format!("{} {unit}", figure(x)).trim_end().to_owned()
}

/// The table as Markdown.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = format!(
        "| {} |\n|{}\n",
        COLUMNS.join(" | "),
        "---|".repeat(COLUMNS.len())
    );
    for r in rows {
        let _ = writeln!(text, "| {} |", cells(r).join(" | "));
    }
    text
}
