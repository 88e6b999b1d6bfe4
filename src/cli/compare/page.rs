//! The HTML page of a comparison.

use asid_comparison::cell::Cell as Run;
use asid_comparison::grid::Grid;
use asid_comparison::plan::Plan;
use asid_comparison::rows::ComparisonResult;
use asid_comparison::table::{grids, notes};
use asid_report::page::{Cell, Column, Figure, Page, Section, Table, Tone};
use asid_report::plot::{Axis, Chart, Colour, Layer};

/// Number of columns over which the dots of a row's seeds are spread.
const ABREAST: u64 = 10;

/// Width of a row's band of dots, in row distances.
const BAND: f64 = 0.3;

/// The page: tables, and pictures for each task, engine and world.
pub fn html(plan: &Plan, result: &ComparisonResult, runs: &[Run], repeat: &str) -> String {
    let title = match result.table {
        Some(table) => format!("Methods compared: Table {table}"),
        None => "Methods compared".to_owned(),
    };
    let mut page = Page::new(&title).kicker("ASID compare").lead(format!(
        "{} runs in {} rows; each row sums up the seeds of one method in one task, condition, world and engine.",
        runs.len(),
        result.rows.len()
    ));
    if result.quick {
        page = page.badge("quick look", Tone::Fair);
    }
    let notes = notes(plan, result);
    if !notes.is_empty() {
        let section = Section::new("What to know");
        page = page.section(notes.into_iter().fold(section, Section::note));
    }
    for grid in grids(plan, result) {
        page = page.section(Section::new(&grid.title).table(table(&grid)));
    }
    let mut groups: Vec<[&str; 3]> = Vec::new();
    for row in &result.rows {
        let group = [&*row.task, &*row.backend, &*row.world];
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for group in groups {
        let [task, backend, world] = group;
        let title = format!("{task} on {backend}, {world} world");
        page = page.section(
            Section::new(&title)
                .lead("Every dot is one run: one episode of exploration, one try at the task.")
                .figures(figures(result, runs, group)),
        );
    }
    page.section(Section::new("Repeat it").command(repeat))
        .html()
}

/// A table in the page's format.
pub fn table(grid: &Grid) -> Table {
    let columns = grid.head.iter().map(|h| {
        if h.number {
            Column::number(&h.title)
        } else {
            Column::text(&h.title)
        }
    });
    let table = Table::new(columns.collect()).caption(&*grid.caption);
    grid.rows.iter().fold(table, |table, row| {
        let cells = row.iter().map(|e| {
            let tone = if e.best { Tone::Good } else { Tone::Plain };
            Cell::toned(&*e.text, tone)
        });
        table.row(cells.collect())
    })
}

/// The metric, and the error of each unknown, by condition and method.
fn figures(result: &ComparisonResult, runs: &[Run], group: [&str; 3]) -> Vec<Figure> {
    let rows: Vec<_> = result
        .rows
        .iter()
        .filter(|r| [&*r.task, &*r.backend, &*r.world] == group)
        .collect();
    let marks: Vec<(f64, String)> = rows
        .iter()
        .enumerate()
        .map(|(i, r)| (i as f64, format!("{} {}", r.condition, r.method)))
        .collect();
    let place = |run: &Run| {
        rows.iter()
            .position(|r| r.condition == run.key.condition && r.method == run.key.method)
    };
    let of: Vec<(&Run, f64)> = runs
        .iter()
        .filter(|r| [&*r.key.task, &*r.key.backend, &*r.key.world] == group)
        // Seeds lie side by side, so that equal values do not hide each other.
        .filter_map(|r| {
            let abreast = (r.key.seed % ABREAST) as f64 / (ABREAST - 1) as f64;
            Some((r, place(r)? as f64 + BAND * (abreast - 0.5)))
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
                let found = r.parameters.get(i)?;
                r.identifies().then_some(found.estimate - found.truth)
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
