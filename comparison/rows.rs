//! Rows: statistics of the runs of one method under one condition.

mod ranking;
mod types;

use asid_statistics::{bootstrap, deviation, interquartile_mean, mean, median, wilson};

use crate::cell::{Cell, CellKey, Failure};
use crate::paper::published;
use crate::plan::Plan;
use crate::settings::differences;
pub use ranking::FEWEST;
use ranking::{Entry, compare, rank};
pub use types::{
    Best, ComparisonResult, Count, Identification, Improvement, Omitted, Pooled, Row, Summary,
};

/// Summarises cells.
///
/// `cells` and `failures` are in the plan's order; `settings` returns the settings for a hash.
#[must_use]
pub fn summarise(
    plan: &Plan,
    cells: &[Cell],
    failures: &[Failure],
    settings: &dyn Fn(&str) -> Option<toml::Table>,
) -> ComparisonResult {
    let mut rows: Vec<(Row, Vec<&Cell>)> = Vec::new();
    for cell in cells {
        match rows
            .iter_mut()
            .find(|(_, of)| of[0].key.row_mate(&cell.key))
        {
            Some((_, of)) => of.push(cell),
            None => rows.push((row(cell), vec![cell])),
        }
    }
    for (row, of) in &mut rows {
        fill(row, of);
    }
    let pooled = pool(&rows);
    let mut rows: Vec<Row> = rows.into_iter().map(|(row, _)| row).collect();
    rank(&mut rows);
    tell_differences(&mut rows, settings);
    let (of_all, single): (Vec<&Failure>, Vec<&Failure>) = failures
        .iter()
        .partition(|f| f.of_all && !cells.iter().any(|c| c.key.arm_mate(&f.key)));
    let mut omitted: Vec<Omitted> = Vec::new();
    for failure in of_all {
        let key: &CellKey = &failure.key;
        let arm = Omitted {
            task: key.task.clone(),
            method: key.method.clone(),
            world: key.world.clone(),
            backend: key.backend.clone(),
            reason: failure.reason.clone(),
        };
        let same = |o: &Omitted| {
            (&o.task, &o.method, &o.world, &o.backend)
                == (&arm.task, &arm.method, &arm.world, &arm.backend)
        };
        if !omitted.iter().any(same) {
            omitted.push(arm);
        }
    }
    ComparisonResult {
        schema: 1,
        table: plan.table,
        quick: plan.quick,
        cells: Count {
            planned: plan.cells().len(),
            done: cells.len(),
        },
        rows,
        pooled,
        omitted,
        failures: single.into_iter().cloned().collect(),
        versions: versions(cells),
    }
}

/// Version of this program, engines and commit, which all cells share.
fn versions(cells: &[Cell]) -> serde_json::Value {
    let mut engines: Vec<&str> = Vec::new();
    for cell in cells {
        if !engines.contains(&&*cell.versions.engine) {
            engines.push(&cell.versions.engine);
        }
    }
    let first = cells.first().map(|c| &c.versions);
    serde_json::json!({
        "asid": first.map_or("", |v| &v.asid),
        "engine": engines.join(", "),
        "git": first.map_or("", |v| &v.git),
    })
}

/// A row without statistics.
fn row(cell: &Cell) -> Row {
    let key = &cell.key;
    let published = published(&key.task, &key.condition, &key.method, &key.world);
    Row {
        task: key.task.clone(),
        condition: key.condition.clone(),
        method: key.method.clone(),
        world: key.world.clone(),
        backend: key.backend.clone(),
        explorer: cell.explorer.clone(),
        identifier: cell.identifier.clone(),
        solver: cell.solver.clone(),
        settings: cell.settings.clone(),
        commit: cell.versions.git.clone(),
        metric: cell.metric.clone(),
        summary: summary(&[&[]]),
        seeds: Vec::new(),
        values: Vec::new(),
        paper: published.map(|p| p.value),
        published,
        differs: Vec::new(),
        identification: Vec::new(),
    }
}

fn fill(row: &mut Row, cells: &[&Cell]) {
    row.summary = summary(&[cells]);
    row.seeds = cells.iter().map(|c| c.key.seed).collect();
    row.values = cells.iter().map(|c| c.value).collect();
    // Without identification only the prior is known about the unknowns.
    if cells[0].identifies() {
        row.identification = (0..cells[0].parameters.len())
            .map(|i| identification(cells, i))
            .collect();
    }
}

fn identification(cells: &[&Cell], i: usize) -> Identification {
    let of = || cells.iter().filter_map(|c| c.parameters.get(i));
    let held = of().filter(|p| p.interval95[0] <= p.truth && p.truth <= p.interval95[1]);
    let expected = median(of().filter_map(|p| p.expected_std));
    let first = &cells[0].parameters[i];
    Identification {
        name: first.name.clone(),
        unit: first.unit.clone(),
        median_abs_error: median(of().map(|p| (p.estimate - p.truth).abs())),
        coverage95: held.count() as f64 / cells.len() as f64,
        median_width95: median(of().map(|p| p.interval95[1] - p.interval95[0])),
        median_expected_std: expected.is_finite().then_some(expected),
    }
}

/// Statistics of cells by stratum, not yet compared with other methods.
fn summary(strata: &[&[&Cell]]) -> Summary {
    let values: Vec<Vec<f64>> = strata
        .iter()
        .map(|of| of.iter().map(|c| c.value).collect())
        .collect();
    let all = values.concat();
    let successes = strata.concat().iter().filter(|c| c.success).count();
    let interval = |statistic: fn(&[f64]) -> f64| {
        if all.is_empty() {
            [f64::NAN; 2]
        } else {
            bootstrap(&values, statistic)
        }
    };
    Summary {
        n: all.len(),
        mean: mean(&all),
        std: deviation(&all),
        median: median(all.iter().copied()),
        iqm: interquartile_mean(&all),
        interval95: interval(mean),
        iqm_interval95: interval(interquartile_mean),
        success_rate: successes as f64 / all.len() as f64,
        success_interval95: wilson(successes, all.len()),
        improvement: None,
        best: Best::default(),
    }
}

/// Methods pooled over all conditions of a task, where each method has all of them.
fn pool(rows: &[(Row, Vec<&Cell>)]) -> Vec<Pooled> {
    let mut arms: Vec<Vec<&(Row, Vec<&Cell>)>> = Vec::new();
    for row in rows {
        let mate = |arm: &&mut Vec<&(Row, Vec<&Cell>)>| arm[0].1[0].key.arm_mate(&row.1[0].key);
        match arms.iter_mut().find(mate) {
            Some(arm) => arm.push(row),
            None => arms.push(vec![row]),
        }
    }
    // Only methods with every condition of the task are comparable.
    let conditions = |task: &str| {
        let of = rows.iter().filter(|(r, _)| r.task == task);
        let names: std::collections::BTreeSet<&str> = of.map(|(r, _)| &*r.condition).collect();
        names.len()
    };
    arms.retain(|arm| arm.len() > 1 && arm.len() == conditions(&arm[0].0.task));
    let mut pooled: Vec<(Pooled, Vec<Vec<f64>>)> = arms
        .iter()
        .map(|arm| {
            let row = &arm[0].0;
            let strata: Vec<&[&Cell]> = arm.iter().map(|r| &*r.1).collect();
            let pooled = Pooled {
                task: row.task.clone(),
                conditions: arm.iter().map(|r| r.0.condition.clone()).collect(),
                method: row.method.clone(),
                world: row.world.clone(),
                backend: row.backend.clone(),
                metric: row.metric.clone(),
                summary: summary(&strata),
            };
            (pooled, arm.iter().map(|r| r.0.values.clone()).collect())
        })
        .collect();
    let group = |p: &Pooled| (p.task.clone(), p.world.clone(), p.backend.clone());
    let mut groups: Vec<(String, String, String)> = Vec::new();
    for (p, _) in &pooled {
        if !groups.contains(&group(p)) {
            groups.push(group(p));
        }
    }
    for wanted in groups {
        let members = pooled.iter_mut().filter(|(p, _)| group(p) == wanted);
        let entries = members.map(|(p, values)| Entry {
            method: &p.method,
            values: values.clone(),
            summary: &mut p.summary,
        });
        compare(entries.collect());
    }
    pooled.into_iter().map(|(p, _)| p).collect()
}

/// Notes for each row how it differs from the others of its task, condition, world and engine: in
/// its runs, and in the settings of shared algorithms.
fn tell_differences(rows: &mut [Row], settings: &dyn Fn(&str) -> Option<toml::Table>) {
    let tables: Vec<Option<toml::Table>> = rows.iter().map(|r| settings(&r.settings)).collect();
    let told: Vec<Vec<String>> = (0..rows.len())
        .map(|i| {
            let row = &rows[i];
            let mates: Vec<usize> = (0..rows.len())
                .filter(|&j| {
                    let other = &rows[j];
                    (&row.task, &row.condition, &row.world, &row.backend)
                        == (&other.task, &other.condition, &other.world, &other.backend)
                })
                .collect();
            let mut told = Vec::new();
            // The seeds of the most complete row.
            let full = mates
                .iter()
                .map(|&j| &rows[j].seeds)
                .max_by_key(|s| s.len());
            if let Some(full) = full.filter(|full| **full != row.seeds) {
                told.push(match (row.seeds.len(), full.len()) {
                    (n, most) if n < most => format!("{n} runs, others {most}"),
                    _ => "other seeds".to_owned(),
                });
            }
            let first = &rows[mates[0]];
            if row.commit != first.commit {
                told.push(format!(
                    "commit {}, of {} {}",
                    row.commit, first.method, first.commit
                ));
            }
            for section in ["explorer", "identifier", "solver"] {
                told.extend(other_settings(section, i, &mates, rows, &tables));
            }
            told
        })
        .collect();
    for (row, told) in rows.iter_mut().zip(told) {
        row.differs = told;
    }
}

/// Settings of an algorithm that differ from those of the first row that also uses it.
fn other_settings(
    section: &str,
    i: usize,
    mates: &[usize],
    rows: &[Row],
    tables: &[Option<toml::Table>],
) -> Vec<String> {
    let of = |j: usize| tables[j].as_ref()?.get(section)?.as_table();
    let Some(own) = of(i) else {
        return Vec::new();
    };
    // An algorithm trained on another explorer's episodes counts as another algorithm, since the
    // methods differ.
    let same = |t: &toml::Table| {
        ["name", "explorer"]
            .iter()
            .all(|key| t.get(*key) == own.get(*key))
    };
    let shares = |j: &&usize| of(**j).is_some_and(same);
    let Some(&first) = mates.iter().find(shares).filter(|&&j| j != i) else {
        return Vec::new();
    };
    let Some(theirs) = of(first) else {
        return Vec::new();
    };
    let method = &rows[first].method;
    differences(own, theirs)
        .into_iter()
        .map(|(key, x, y)| format!("{section}.{key} = {x}, of {method} {y}"))
        .collect()
}

#[cfg(test)]
mod tests;
