//! Whether an estimator that ships is for the trackers of a problem.
//!
//! It learned from readings of the task's own trackers. Its standard deviations, and the change
//! that it expects over a control step, are those of their noise and rate.

use asid_core::Problem;
use asid_core::registry::{TaskEntry, find};

/// Noise over that of the task's own trackers above which what ships is not used. Its standard
/// deviations are too small by at most this factor: an interval of 95 % then holds 90 %.
const NOISIER: f64 = 1.2;

/// Why what ships is not for the trackers of this problem, if it is not.
pub(super) fn other_readings(problem: &Problem<'_>) -> Option<String> {
    let own = (find::<TaskEntry>(problem.task.name()).ok()?.make)().ok()?;
    if own.spec().tracker_rate != problem.task.spec().tracker_rate {
        return Some("learned from readings at another rate".into());
    }
    let learned = &own.exploration().signals;
    problem.signals.iter().find_map(|ours| {
        let theirs = learned.iter().find(|s| s.sensor == ours.sensor)?;
        (ours.noise > NOISIER * theirs.noise).then(|| {
            format!(
                "learned from readings of `{}` with a noise of {}, not {}",
                ours.sensor, theirs.noise, ours.noise
            )
        })
    })
}

#[cfg(test)]
mod tests {
    use asid_core::Problem;

    use super::super::Estimator;
    use crate::testing::with_problem;

    /// The message where the estimator has no network for a problem; empty where it has one.
    fn refusal(problem: &Problem<'_>) -> String {
        let estimator = Estimator {
            explorer: "maxmi".into(),
            ..Estimator::default()
        };
        let found = estimator.obtain(problem);
        found.err().map(|e| e.to_string()).unwrap_or_default()
    }

    /// Symptom: with trackers of five times the noise or a fifth of the rate, the estimator that
    /// ships answered with intervals as narrow as for the task's own. Cause: only unknowns and
    /// priors were compared.
    #[test]
    fn what_ships_is_for_the_tasks_own_trackers() {
        with_problem("rod-balancing", |problem| {
            assert_eq!(refusal(problem), "");
            let with_noise = |factor: f64| {
                let mut signals = problem.signals.to_vec();
                signals[1].noise *= factor;
                refusal(&Problem {
                    signals: &signals,
                    ..*problem
                })
            };
            // Quieter trackers only make its intervals too wide.
            assert_eq!(with_noise(0.5), "");
            let noisy = with_noise(5.0);
            assert!(noisy.contains("a noise of 0.01, not 0.05"), "{noisy}");
            let levels = [("tracker_rate".to_owned(), 10.0)].into();
            let slow = problem.task.adjusted(&levels).unwrap().unwrap();
            let slow = refusal(&Problem {
                task: &*slow,
                ..*problem
            });
            assert!(slow.contains("at another rate"), "{slow}");
        });
    }
}
