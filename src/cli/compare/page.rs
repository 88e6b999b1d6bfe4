//! The HTML page of a comparison.

use asid_report::page::{Cell, Column, Figure, Page, Section, Table};
use asid_report::plot::{Axis, Chart, Colour, Layer};

use super::table::{self, CompareResult, Run};

/// The page: a picture a task and engine, and the table.
pub fn html(result: &CompareResult, runs: &[Run], command: &str) -> String {
    let mut page = Page::new("Methods compared")
        .kicker("ASID compare")
        .lead(format!(
            "{} runs in {} rows; each row sums up the seeds of one method under one condition.",
            runs.len(),
            result.rows.len()
        ));
    let mut groups: Vec<(String, String)> = Vec::new();
    for row in &result.rows {
        let group = (row.task.clone(), row.backend.clone());
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for (task, backend) in groups {
        page = page.section(
            Section::new(&format!("{task} on {backend}"))
                .lead("Every dot is one run: one episode of exploration, one try at the task.")
                .figures(figures(result, runs, &task, &backend)),
        );
    }
    let columns = table::COLUMNS
        .iter()
        .enumerate()
        .map(|(i, title)| {
            if i < 4 || i == 5 {
                Column::text(title)
            } else {
                Column::number(title)
            }
        })
        .collect();
    let table = result.rows.iter().fold(Table::new(columns), |t, r| {
        t.row(table::cells(r).into_iter().map(Cell::from).collect())
    });
    page.section(Section::new("Table").table(table.caption(
        "The interval of the mean is a percentile bootstrap over seeds; error, coverage and width are those of the unknown.",
    )))
    .section(Section::new("Repeat it").command(command))
    .html()
}

/// The metric, and the error of each unknown, by condition and method.
fn figures(result: &CompareResult, runs: &[Run], task: &str, backend: &str) -> Vec<Figure> {
    let rows: Vec<_> = result
        .rows
        .iter()
        .filter(|r| r.task == task && r.backend == backend)
        .collect();
    let marks: Vec<(f64, String)> = rows
        .iter()
        .enumerate()
        .map(|(i, r)| (i as f64, format!("{} {}", r.condition, r.method)))
        .collect();
    let place = |run: &Run| {
        rows.iter()
            .position(|r| r.condition == run.condition && r.method == run.method)
    };
    let of: Vec<(&Run, f64)> = runs
        .iter()
        .filter(|r| r.task == task && r.backend == backend)
        // Seeds side by side, so that equal values do not hide each other.
        .filter_map(|r| {
            Some((
                r,
                place(r)? as f64 + 0.3 * ((r.seed % 10) as f64 / 9.0 - 0.5),
            ))
        })
        .collect();
    let metric = rows.first().map_or("", |r| &r.metric);
    let axis = || {
        Axis::new("", "")
            .marks(marks.clone())
            .domain([-0.6, rows.len() as f64 - 0.4])
    };
    let dots = |keep: &dyn Fn(&Run) -> Option<f64>| -> Vec<[f64; 2]> {
        of.iter()
            .filter_map(|(r, x)| Some([*x, keep(r)?]))
            .collect()
    };
    let outcome = Chart::new(metric, axis(), Axis::new(metric, "").zero())
        .layer(
            Layer::dots(dots(&|r| r.success.then_some(r.value)))
                .colour(Colour::Green)
                .label("success"),
        )
        .layer(
            Layer::dots(dots(&|r| (!r.success).then_some(r.value)))
                .colour(Colour::Vermillion)
                .label("failure"),
        );
    let mut all = vec![Figure::new(
        format!("{metric} by condition and method"),
        outcome,
        "Lower is better.",
    )];
    let unknowns = of.first().map_or(0, |(r, _)| r.parameters.len());
    for i in 0..unknowns {
        let Some(p) = of.iter().find_map(|(r, _)| r.parameters.get(i)) else {
            continue;
        };
        let error = Chart::new(
            &p.name,
            axis(),
            Axis::new("estimate - truth", &p.unit).zero(),
        )
        .layer(Layer::horizontal(0.0).colour(Colour::Muted).dashed())
        .layer(
            Layer::dots(dots(&|r| {
                r.residual
                    .map(|_| r.parameters[i].estimate - r.parameters[i].truth)
            }))
            .colour(Colour::Blue),
        );
        all.push(Figure::new(
            format!("Error of {} by condition and method", p.name),
            error,
            "Methods that do not identify have no dots.",
        ));
    }
    all
}
