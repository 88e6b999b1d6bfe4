//! Formats the tables of a comparison.

mod paper;

use std::fmt::Write as _;

use crate::cell::CellKey;
use crate::grid::{Entry, Grid};
use crate::plan::Plan;
use crate::rows::{ComparisonResult, Omitted, Row, Summary};

/// Explanation of the main table's columns.
const MAIN: &str = "Lower is better. IQM: interquartile mean of the metric over seeds with its 95 % bootstrap interval; \
    success with its 95 % Wilson interval; in bold the best of a condition where its interval is apart from every other method's (of the metric: from six runs of each on). \
    P(better): probability that a run is better than one of the method named, ties counting half. The oracle is told the truth \
    and is ranked with nobody. ";

/// All tables, the most important first.
#[must_use]
pub fn grids(plan: &Plan, result: &ComparisonResult) -> Vec<Grid> {
    let mut grids = Vec::new();
    if let Some(table) = result.table {
        grids.extend(paper::as_in_the_paper(plan, result, table));
    }
    grids.push(main(plan, result));
    grids.extend(pooled(result));
    grids.extend(identification(result));
    grids.push(methods(result));
    grids
}

/// Sentences that accompany every form of a result: what is missing, failed or shortened.
#[must_use]
pub fn notes(plan: &Plan, result: &ComparisonResult) -> Vec<String> {
    let mut notes = Vec::new();
    if result.quick {
        notes.push("A quick look: searches were cut to half and seeds are few.".to_owned());
    }
    for o in &result.omitted {
        notes.push(format!(
            "Left out: {} on {}, {}, {}: {}",
            o.method, o.task, o.world, o.backend, o.reason
        ));
    }
    for f in &result.failures {
        notes.push(format!("Failed: {}: {}", f.key.words(), f.reason));
    }
    let gone = gone(plan, result);
    if gone > 0 {
        notes.push(format!(
            "{gone} of {} runs are not there.",
            result.cells.planned
        ));
    }
    notes
}

/// Number of planned runs that are neither done, nor failed, nor of a method that was left out.
fn gone(plan: &Plan, result: &ComparisonResult) -> usize {
    let left_out = |key: &CellKey| {
        let of = |o: &Omitted| {
            (&o.task, &o.method, &o.world, &o.backend)
                == (&key.task, &key.method, &key.world, &key.backend)
        };
        result.omitted.iter().any(of)
    };
    let cells = plan.cells();
    let planned = cells.iter().filter(|key| !left_out(key)).count();
    let failures = result.failures.iter();
    let failed = failures.filter(|f| !left_out(&f.key)).count();
    planned.saturating_sub(result.cells.done + failed)
}

/// Formats the tables and notes as Markdown.
#[must_use]
pub fn markdown(plan: &Plan, result: &ComparisonResult) -> String {
    let mut text = String::new();
    for note in notes(plan, result) {
        let _ = writeln!(text, "> {note}");
    }
    if !text.is_empty() {
        text.push('\n');
    }
    let tables: Vec<String> = grids(plan, result).iter().map(Grid::markdown).collect();
    text + &tables.join("\n")
}

/// A metric value with its interval; small values (metres, radians) get three decimals.
fn valued(x: f64, [low, high]: [f64; 2]) -> String {
    let digits = if high.abs() < 1.0 { 3 } else { 1 };
    format!("{x:.digits$} ({low:.digits$} to {high:.digits$})")
}

fn share(x: f64, [low, high]: [f64; 2]) -> String {
    format!(
        "{:.0} % ({:.0} to {:.0})",
        100.0 * x,
        100.0 * low,
        100.0 * high
    )
}

fn iqm(s: &Summary) -> Entry {
    Entry {
        text: valued(s.iqm, s.iqm_interval95),
        best: s.best.iqm,
    }
}

fn success(s: &Summary) -> Entry {
    Entry {
        text: share(s.success_rate, s.success_interval95),
        best: s.best.success,
    }
}

fn better(s: &Summary) -> Entry {
    let text = s.improvement.as_ref().map_or(String::new(), |i| {
        let [low, high] = i.interval95;
        format!(
            "{:.2} ({low:.2} to {high:.2}) than {}",
            i.probability, i.over
        )
    });
    text.into()
}

/// The main table: one row per task, engine, condition and method, and columns for each world.
fn main(plan: &Plan, result: &ComparisonResult) -> Grid {
    let worlds: Vec<&String> = plan
        .worlds
        .iter()
        .filter(|w| result.rows.iter().any(|r| r.world == **w))
        .collect();
    let of = |world: &str, what: &str| {
        if worlds.len() > 1 {
            format!("{world}: {what}")
        } else {
            what.to_owned()
        }
    };
    let caption = match &*worlds {
        [one] => format!("{MAIN}World: {one}."),
        _ => MAIN.trim_end().to_owned(),
    };
    let mut grid = Grid::new("Outcome", &caption)
        .text("task")
        .text("engine")
        .text("condition")
        .text("method")
        .number("n")
        .text("metric");
    for world in &worlds {
        grid = grid
            .number(&of(world, "IQM (95 %)"))
            .number(&of(world, "success (95 %)"))
            .number(&of(world, "P(better)"));
    }
    grid = grid.number("paper").text("differs");
    let mut lines: Vec<Vec<&Row>> = Vec::new();
    for row in &result.rows {
        let mate = |l: &&mut Vec<&Row>| {
            let other = l[0];
            (&other.task, &other.backend, &other.condition, &other.method)
                == (&row.task, &row.backend, &row.condition, &row.method)
        };
        match lines.iter_mut().find(mate) {
            Some(line) => line.push(row),
            None => lines.push(vec![row]),
        }
    }
    for line in lines {
        let first = line[0];
        let mut ns: Vec<String> = line.iter().map(|r| r.summary.n.to_string()).collect();
        ns.dedup();
        let mut cells: Vec<Entry> = vec![
            first.task.as_str().into(),
            first.backend.as_str().into(),
            first.condition.as_str().into(),
            first.method.as_str().into(),
            ns.join(" / ").into(),
            first.metric.as_str().into(),
        ];
        for world in &worlds {
            match line.iter().find(|r| r.world == **world) {
                Some(r) => cells.extend([iqm(&r.summary), success(&r.summary), better(&r.summary)]),
                None => cells.extend([Entry::default(), Entry::default(), Entry::default()]),
            }
        }
        cells.push(published(&line).into());
        let mut differs: Vec<&str> = line.iter().flat_map(|r| &r.differs).map(|d| &**d).collect();
        differs.dedup();
        cells.push(differs.join("; ").into());
        grid.rows.push(cells);
    }
    grid.without_empty_columns();
    grid
}

/// The paper's values for the rows of a line, which may be of several worlds.
fn published(line: &[&Row]) -> String {
    let mut told: Vec<String> = Vec::new();
    for p in line.iter().filter_map(|r| r.published) {
        let value = format!("{} (Table {})", p.words(), p.table);
        if !told.contains(&value) {
            told.push(value);
        }
    }
    told.join("; ")
}

/// Table of the methods pooled over all conditions of a task.
fn pooled(result: &ComparisonResult) -> Option<Grid> {
    let mut grid = Grid::new(
        "Over all conditions",
        "Conditions pooled; bootstraps resample within each condition, and probabilities are averaged over conditions.",
    )
    .text("task")
    .text("engine")
    .text("world")
    .text("method")
    .number("n")
    .text("metric")
    .number("IQM (95 %)")
    .number("success (95 %)")
    .number("P(better)");
    for p in &result.pooled {
        grid.rows.push(vec![
            p.task.as_str().into(),
            p.backend.as_str().into(),
            p.world.as_str().into(),
            p.method.as_str().into(),
            p.summary.n.to_string().into(),
            p.metric.as_str().into(),
            iqm(&p.summary),
            success(&p.summary),
            better(&p.summary),
        ]);
    }
    grid.without_empty_columns();
    (!grid.rows.is_empty()).then_some(grid)
}

/// Table of how well the unknowns were identified.
fn identification(result: &ComparisonResult) -> Option<Grid> {
    let mut grid = Grid::new(
        "What was identified",
        "Coverage: share of 95 % intervals that hold the truth.",
    )
    .text("task")
    .text("engine")
    .text("condition")
    .text("world")
    .text("method")
    .text("unknown")
    .number("median error")
    .number("coverage of 95 %")
    .number("median width of 95 %");
    for r in &result.rows {
        for i in &r.identification {
            grid.rows.push(vec![
                r.task.as_str().into(),
                r.backend.as_str().into(),
                r.condition.as_str().into(),
                r.world.as_str().into(),
                r.method.as_str().into(),
                i.name.as_str().into(),
                with_unit(i.median_abs_error, &i.unit).into(),
                format!("{:.0} %", 100.0 * i.coverage95).into(),
                with_unit(i.median_width95, &i.unit).into(),
            ]);
        }
    }
    (!grid.rows.is_empty()).then_some(grid)
}

/// Formats with four decimals, or with two significant figures where the value would be lost.
fn with_unit(x: f64, unit: &str) -> String {
    let text = if x != 0.0 && x.abs() < 1e-3 {
        format!("{x:.1e} {unit}")
    } else {
        format!("{x:.4} {unit}")
    };
    text.trim_end().to_owned()
}

/// Table of the parts of each method.
fn methods(result: &ComparisonResult) -> Grid {
    let mut grid = Grid::new(
        "Methods",
        "Settings: hash of all that were resolved; `settings/HASH.toml` has them.",
    )
    .text("method")
    .text("explorer")
    .text("identifier")
    .text("solver")
    .text("task")
    .text("engine")
    .text("world")
    .text("settings")
    .text("commit");
    for r in &result.rows {
        let line: Vec<Entry> = [
            &r.method,
            &r.explorer,
            &r.identifier,
            &r.solver,
            &r.task,
            &r.backend,
            &r.world,
            &r.settings,
            &r.commit,
        ]
        .map(|t| t.as_str().into())
        .into();
        if !grid.rows.contains(&line) {
            grid.rows.push(line);
        }
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::tests::{cell, key};
    use crate::cell::{Cell, Failure};
    use crate::paper::STAND_IN;
    use crate::plan::tests::plan;
    use crate::plan::{PERTURBED, TaskPlan};
    use crate::rows::summarise;

    fn example() -> (Plan, ComparisonResult) {
        let mut plan = plan();
        plan.seeds = 6;
        plan.task = vec![TaskPlan {
            name: "rod-balancing".into(),
            conditions: vec!["left".into()],
        }];
        plan.check().unwrap();
        let mut cells = Vec::new();
        for wanted in plan.cells() {
            let off = if wanted.world == PERTURBED { 1.0 } else { 0.0 };
            let value = off + if wanted.method == "dr" { 40.0 } else { 0.5 };
            let mut of = key("rod-balancing", "left", &wanted.method, wanted.seed);
            of.world = wanted.world;
            cells.push(cell(of, value, value < 5.0));
        }
        let result = summarise(&plan, &cells, &[], &|_| None);
        (plan, result)
    }

    #[test]
    fn worlds_stand_side_by_side_the_perturbed_one_first_and_the_paper_beside() {
        let (plan, result) = example();
        let text = markdown(&plan, &result);
        let head = text.lines().nth(2).unwrap();
        let at = |what: &str| head.find(what).unwrap();
        assert!(at("perturbed: IQM") < at("matched: IQM") && at("matched: IQM") < at("paper"));
        let line = text.lines().find(|l| l.contains("| asid |")).unwrap();
        assert!(line.contains("**1.5 (1.5 to 1.5)**") && line.contains("0.00 ± 0.0 (Table 1)"));
        assert!(line.contains("100 % (61 to 100)"), "{line}");
        assert!(line.contains("1.00 (1.00 to 1.00) than dr"), "{line}");
        assert!(!head.contains("differs"));
    }

    /// Symptom: a merge without some shares said nothing of the runs that were not there. Cause: they
    /// were counted only where nothing was left out and nothing had failed.
    #[test]
    fn missing_runs_are_told_beside_methods_left_out_and_failed_runs() {
        let (plan, _) = example();
        let keys = plan.cells();
        let of = |method: &str| -> Vec<CellKey> {
            let all = keys.iter().filter(|k| k.method == method);
            all.cloned().collect()
        };
        let why = |key: &CellKey, of_all: bool| Failure {
            key: key.clone(),
            reason: "no policy".into(),
            of_all,
        };
        // Of `asid` the first two runs are there; `dr` is left out in the first world.
        let (asid, dr) = (of("asid"), of("dr"));
        let done = asid[..2].iter().map(|k| cell(k.clone(), 1.0, true));
        let done: Vec<Cell> = done.collect();
        let failures = [why(&dr[0], true), why(&asid[2], false)];
        let result = summarise(&plan, &done, &failures, &|_| None);
        assert_eq!((result.omitted.len(), result.failures.len()), (1, 1));
        let gone = keys.len() - plan.seeds as usize - 3;
        let told = notes(&plan, &result);
        let line = format!("{gone} of {} runs are not there.", keys.len());
        assert!(told.contains(&line), "{told:?}");

        // Nothing is missing.
        let (plan, all) = example();
        assert!(notes(&plan, &all).is_empty());
    }

    /// Symptom: the paper's value was missing beside a world that it has one for. Cause: only the
    /// first of the worlds side by side was asked.
    #[test]
    fn the_papers_values_of_all_worlds_side_by_side_are_told() {
        let mut plan = plan();
        plan.worlds = vec![PERTURBED.into(), STAND_IN.into()];
        plan.task = vec![TaskPlan {
            name: "shuffleboard".into(),
            conditions: vec!["near".into()],
        }];
        plan.check().unwrap();
        let cells = plan.cells().into_iter().map(|k| cell(k, 0.5, true));
        let result = summarise(&plan, &cells.collect::<Vec<_>>(), &[], &|_| None);
        let text = markdown(&plan, &result);
        let line = text.lines().find(|l| l.contains("| asid |")).unwrap();
        assert!(line.contains("4/5 (Table 3)"), "{line}");
    }

    #[test]
    fn a_table_of_the_paper_has_methods_as_rows_and_its_values_in_brackets() {
        let (mut plan, mut result) = example();
        plan.table = Some(1);
        result.table = Some(1);
        result.quick = true;
        let text = markdown(&plan, &result);
        assert!(text.starts_with("> A quick look"));
        assert!(text.contains("## Table 1 of the paper, in the perturbed world on rapier"));
        assert!(
            text.contains("| dr | 41.0 (41.0 to 41.0) [26.69 ± 7.0] |"),
            "{text}"
        );
    }
}
