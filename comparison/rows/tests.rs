//! Rows of a few hand-made cells.

use super::*;
use crate::cell::tests::{cell, key};
use crate::plan::tests::plan;

/// Cells of a method under a condition with these values, seeds from 0; success below 5.
fn cells(condition: &str, method: &str, values: &[f64]) -> Vec<Cell> {
    let of = values.iter().zip(0..);
    of.map(|(&v, seed)| cell(key("t", condition, method, seed), v, v < 5.0))
        .collect()
}

fn summed(cells: &[Cell]) -> ComparisonResult {
    summarise(&plan(), cells, &[], &|_| None)
}

#[test]
fn the_best_is_marked_only_where_its_interval_is_apart() {
    let result = summed(
        &[
            cells("x", "asid", &[0.0; 10]),
            cells(
                "x",
                "random",
                &[8.0, 9.0, 30.0, 8.5, 9.5, 12.0, 11.0, 14.0, 20.0, 9.0],
            ),
            cells("x", "oracle", &[0.0; 10]),
        ]
        .concat(),
    );
    let [asid, random, oracle] = &*result.rows else {
        panic!("{}", result.rows.len());
    };
    assert!(asid.summary.best.iqm && asid.summary.best.success);
    assert!(!random.summary.best.iqm && !oracle.summary.best.iqm);
    let better = asid.summary.improvement.as_ref().unwrap();
    assert_eq!((&*better.over, better.probability), ("random", 1.0));
    assert!(random.summary.improvement.is_none() && oracle.summary.improvement.is_none());
    // Five runs are too few for a meaningful interval.
    let few = [cells("x", "asid", &[0.0; 5]), cells("x", "dr", &[9.0; 5])];
    assert!(!summed(&few.concat()).rows[0].summary.best.iqm);
    // Two equal methods: neither is best.
    let alike = summed(&[cells("x", "asid", &[0.0; 3]), cells("x", "dr", &[0.0; 3])].concat());
    assert!(alike.rows.iter().all(|r| r.summary.best == Best::default()));
}

/// Symptom: the best method was set in bold although the interval of the third held its value.
/// Cause: its interval was held against the next method's alone.
#[test]
fn the_best_is_apart_from_every_other_method_and_not_from_the_next_alone() {
    // Half of the last method's runs are better than those of the first, and its interval says so.
    let halves = [[0.0; 5], [9.0; 5]].concat();
    let all = [
        cells("x", "asid", &[1.0; 10]),
        cells("x", "random", &[2.0; 10]),
        cells("x", "dr", &halves),
    ];
    let best = |result: &ComparisonResult| result.rows[0].summary.best;
    assert!(!best(&summed(&all.concat())).iqm);
    assert!(best(&summed(&all[..2].concat())).iqm);
    // 10 of 10 is apart from 4 of 10 (17 to 69 %), and not from 1 of 3 (6 to 79 %).
    let some = [[1.0; 4].to_vec(), [9.0; 6].to_vec()].concat();
    let all = [
        cells("x", "asid", &[1.0; 10]),
        cells("x", "random", &some),
        cells("x", "dr", &[1.0, 9.0, 9.0]),
    ];
    assert!(!best(&summed(&all.concat())).success);
    assert!(best(&summed(&all[..2].concat())).success);
}

/// Symptom: three runs in each of two conditions made a method the best over all conditions, where
/// six in one are asked for. Cause: the runs of all conditions were counted together, though each
/// condition is resampled by itself.
#[test]
fn over_all_conditions_each_needs_the_fewest_runs() {
    let best = |n: usize| {
        let runs = |condition: &str, method: &str, value: f64| {
            let values = vec![value; n];
            cells(condition, method, &values)
        };
        let all = ["x", "y"].map(|c| [runs(c, "asid", 0.0), runs(c, "dr", 9.0)].concat());
        summed(&all.concat()).pooled[0].summary.best.iqm
    };
    assert!(!best(FEWEST / 2) && !best(FEWEST - 1) && best(FEWEST));
}

/// Symptom: a row of ten runs said nothing of what was identified. Cause: the residual of its first
/// run was not finite, which its file writes as it writes none.
#[test]
fn a_row_whose_first_residual_is_lost_says_what_was_identified() {
    let mut all = cells("x", "asid", &[0.0; 3]);
    all[0].residual = None;
    all.extend(cells("x", "dr", &[0.0; 3]));
    let result = summed(&all);
    let found = result.rows.iter().map(|r| r.identification.len());
    assert_eq!(found.collect::<Vec<_>>(), [1, 0]);
}

#[test]
fn fewer_runs_and_other_budgets_are_said_of_a_row() {
    let mut all = [
        cells("x", "asid", &[0.0; 3]),
        cells("x", "random", &[1.0; 3]),
        cells("x", "dr", &[9.0; 2]),
    ]
    .concat();
    all[3..6].iter_mut().for_each(|c| c.settings = "1".into());
    let settings = |hash: &str| {
        let iterations = if hash == "1" { 3 } else { 4 };
        let text = format!("[solver]\nname = 'cem'\niterations = {iterations}");
        text.parse().ok()
    };
    let result = summarise(&plan(), &all, &[], &settings);
    assert!(result.rows[0].differs.is_empty());
    assert_eq!(result.rows[1].differs, ["solver.iterations = 3, of asid 4"]);
    assert_eq!(result.rows[2].differs, ["2 runs, others 3"]);
}

/// Estimators for two explorers' episodes are two algorithms; another commit is a difference.
#[test]
fn an_estimator_of_another_explorer_is_no_other_setting_and_another_commit_is_one() {
    let mut all = [
        cells("x", "asid-estimator", &[0.0; 3]),
        cells("x", "maxmi", &[1.0; 3]),
    ]
    .concat();
    for cell in &mut all[3..6] {
        cell.settings = "maxmi".into();
        cell.versions.git = "d".into();
    }
    let settings = |hash: &str| {
        let explorer = if hash == "maxmi" { hash } else { "fisher-ppo" };
        let text = format!(
            "[identifier]\nname = 'estimator'\nexplorer = '{explorer}'\nnetwork = 'of {explorer}'"
        );
        text.parse().ok()
    };
    let result = summarise(&plan(), &all, &[], &settings);
    assert!(result.rows[0].differs.is_empty());
    assert_eq!(result.rows[1].differs, ["commit d, of asid-estimator c"]);
}

#[test]
fn conditions_are_pooled_as_strata_where_a_method_has_them_all() {
    let all = [
        cells("x", "asid", &[0.0, 0.1]),
        cells("y", "asid", &[100.0, 100.1]),
        cells("x", "dr", &[1.0, 1.1]),
    ]
    .concat();
    let result = summed(&all);
    let [pooled] = &*result.pooled else {
        panic!("{}", result.pooled.len());
    };
    assert_eq!((pooled.summary.n, pooled.conditions.len()), (4, 2));
    let [low, high] = pooled.summary.interval95;
    assert!(high - low < 0.2, "{low} {high}");
}

#[test]
fn a_method_that_cannot_be_run_is_told_once_with_the_reason() {
    let why = |seed, of_all| Failure {
        key: key("t", "x", "maxmi", seed),
        reason: "no policy".into(),
        of_all,
    };
    let run = cells("x", "dr", &[1.0]);
    let result = summarise(&plan(), &run, &[why(0, true), why(1, true)], &|_| None);
    assert_eq!(result.omitted.len(), 1);
    assert_eq!(result.omitted[0].reason, "no policy");
    assert!(result.failures.is_empty());
    let result = summarise(&plan(), &run, &[why(0, false)], &|_| None);
    assert!(result.omitted.is_empty() && result.failures.len() == 1);
}
