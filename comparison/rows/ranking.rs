//! Ranks methods, with the certainty of the ranking.

use asid_statistics::{improvement, improvement_interval};

use super::types::{Improvement, Row, Summary};
use crate::method::ORACLE;

/// One method in a ranking.
pub struct Entry<'a> {
    /// Its name.
    pub method: &'a str,
    /// Values of the metric by stratum.
    pub values: Vec<Vec<f64>>,
    /// Its statistics, which the ranking completes.
    pub summary: &'a mut Summary,
}

/// Fewest runs of each condition with which a bootstrap interval may set a method apart. The
/// interval cannot reach beyond the observed values, and only from six runs on do these enclose the
/// median with 95 % (1 - 2 / 2^6 = 97 %).
pub const FEWEST: usize = 6;

/// Whether there are enough runs in each stratum. A stratum is resampled by itself, so runs of
/// others do not make up for too few in one.
fn measured(entry: &Entry<'_>) -> bool {
    entry.values.iter().all(|of| of.len() >= FEWEST)
}

/// Compares methods with each other. The oracle is left out: it shows what the task allows.
///
/// A method is the best if its interval is apart from that of every other one. Apart from the next
/// one's is not enough, since the interval of a method further down may be wider.
pub fn compare(mut entries: Vec<Entry<'_>>) {
    entries.retain(|e| e.method != ORACLE);
    // Lower is better; among equals the method that succeeds more often.
    entries.sort_by(|a, b| {
        let by_metric = a.summary.iqm.total_cmp(&b.summary.iqm);
        by_metric.then(b.summary.success_rate.total_cmp(&a.summary.success_rate))
    });
    for i in 1..entries.len() {
        let (better, next) = entries.split_at_mut(i);
        let (better, next) = (&mut better[i - 1], &next[0]);
        better.summary.improvement = Some(Improvement {
            over: next.method.to_owned(),
            probability: improvement(&better.values, &next.values),
            interval95: improvement_interval(&better.values, &next.values),
        });
    }
    if let [first, others @ ..] = &mut *entries
        && !others.is_empty()
    {
        let high = first.summary.iqm_interval95[1];
        let behind = |other: &Entry<'_>| high < other.summary.iqm_interval95[0];
        let best = measured(first) && others.iter().all(|o| measured(o) && behind(o));
        first.summary.best.iqm = best;
    }
    entries.sort_by(|a, b| b.summary.success_rate.total_cmp(&a.summary.success_rate));
    if let [first, others @ ..] = &mut *entries
        && !others.is_empty()
    {
        let low = first.summary.success_interval95[0];
        let behind = |other: &Entry<'_>| low > other.summary.success_interval95[1];
        first.summary.best.success = others.iter().all(behind);
    }
}

/// Ranks the methods of each task, condition, world and engine.
pub fn rank(rows: &mut [Row]) {
    let group = |r: &Row| {
        let names = [&r.task, &r.condition, &r.world, &r.backend];
        names.map(String::clone)
    };
    let mut groups: Vec<[String; 4]> = Vec::new();
    for row in rows.iter() {
        if !groups.contains(&group(row)) {
            groups.push(group(row));
        }
    }
    for wanted in groups {
        let members = rows.iter_mut().filter(|r| group(r) == wanted);
        let entries = members.map(|r| Entry {
            method: &r.method,
            values: vec![r.values.clone()],
            summary: &mut r.summary,
        });
        compare(entries.collect());
    }
}
