//! The tables of the paper, with this comparison's numbers next to the published ones.

use super::{iqm, success};
use crate::grid::{Entry, Grid};
use crate::method::Method;
use crate::paper::{Measure, measure};
use crate::plan::Plan;
use crate::rows::{ComparisonResult, Omitted, Row};

/// One table for each world and engine in the paper's layout: one row per method, one column per
/// task and condition, the paper's value below ours.
pub fn as_in_the_paper(plan: &Plan, result: &ComparisonResult, table: u8) -> Vec<Grid> {
    let mut grids = Vec::new();
    for world in &plan.worlds {
        for backend in &plan.backends {
            let title = format!("Table {table} of the paper, in the {world} world on {backend}");
            let caption = "Metric: interquartile mean (95 %); success: share (95 %); in brackets the paper's value.";
            let mut grid = Grid::new(&title, caption).text("method");
            let mut columns = Vec::new();
            for task in &plan.task {
                for condition in &task.conditions {
                    let of = |r: &&Row| {
                        (&r.task, &r.condition, &r.world, &r.backend)
                            == (&task.name, condition, world, backend)
                    };
                    let Some(any) = result.rows.iter().find(of) else {
                        continue;
                    };
                    let what = match measure(table, &task.name) {
                        Measure::Metric => &*any.metric,
                        Measure::SuccessRate => "success",
                    };
                    grid = grid.number(&format!("{}, {condition}: {what}", task.name));
                    columns.push((task.name.clone(), condition.clone()));
                }
            }
            for method in &plan.methods {
                let mut line: Vec<Entry> = vec![method.name.as_str().into()];
                for (task, condition) in &columns {
                    let of = |r: &&Row| {
                        (&r.task, &r.condition, &r.method, &r.world, &r.backend)
                            == (task, condition, &method.name, world, backend)
                    };
                    line.push(paper_entry(
                        result,
                        table,
                        method,
                        task,
                        result.rows.iter().find(of),
                    ));
                }
                grid.rows.push(line);
            }
            if !columns.is_empty() {
                grids.push(grid);
            }
        }
    }
    grids
}

fn paper_entry(
    result: &ComparisonResult,
    table: u8,
    method: &Method,
    task: &str,
    row: Option<&Row>,
) -> Entry {
    let Some(row) = row else {
        let left_out = |o: &&Omitted| o.method == method.name && o.task == task;
        let is = result.omitted.iter().any(|o| left_out(&o));
        return if is { "left out" } else { "not run" }.into();
    };
    let mut entry = match measure(table, task) {
        Measure::Metric => iqm(&row.summary),
        Measure::SuccessRate => success(&row.summary),
    };
    if let Some(published) = row.published.filter(|p| p.table == table) {
        entry.text += &format!(" [{}]", published.words());
    }
    entry
}
