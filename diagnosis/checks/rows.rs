//! Rows: whether they are close enough to show a motion.

use super::check;
use crate::data::{Logs, row_time};
use crate::result::CheckResult;

/// Time between two rows from which on they hardly show how a machine moves, s.
///
/// A joint that swings at 0.5 Hz turns back within it. Stamps in ms that are taken for s give rows 1
/// to 100 s apart at the rates of machines.
const FAR_APART: f64 = 1.0;

/// Checks whether rows are close enough; `None` if those of all logs are.
#[must_use]
pub fn rows(train: &Logs, test: &Logs) -> Option<CheckResult> {
    let all = train.episodes.iter().chain(&test.episodes);
    let apart = all.map(|e| (row_time(&e.episode), &e.name));
    let (seconds, name) = apart.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (seconds >= FAR_APART).then(|| {
        check(
            "rows",
            false,
            format!(
                "the rows of `{name}` are {seconds:.1} s apart, too far to show how a machine moves between them: look whether its time is in ms \
                 (`[[column]] name = \"time\"` with `unit`), or log faster"
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::super::data::tests::{log, plant};
    use super::*;

    #[test]
    fn rows_a_second_apart_are_warned_of() {
        let plant = plant();
        let logs = |stretch: f64| {
            let (name, mut episode) = log("slow", &[0.0, 1.0, 2.0, 4.0]);
            episode.time.iter_mut().for_each(|t| *t *= stretch);
            Logs::new(&plant, &["place".to_owned()], vec![(name, episode)]).unwrap()
        };
        // The rows of the log are 0.1 s apart.
        assert_eq!(rows(&logs(1.0), &logs(9.0)), None);
        let found = rows(&logs(1.0), &logs(20.0)).unwrap();
        assert!(!found.ok && found.detail.contains("`slow` are 2.0 s apart"));
    }
}
