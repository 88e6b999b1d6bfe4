//! Whether anything moves, in the logs or in the model: a machine that rests as its model does shows
//! no effect.

use super::check;
use crate::data::Logs;
use crate::findings::LEAST_GAP;
use crate::result::CheckResult;
use crate::skill::about_the_mean;

/// Returns a failed check if no reading of the logs changes by more than its noise, and replays of
/// the model agree, which leave a gap of `left` noises; `None` otherwise.
///
/// A machine that stands where its model moves is held by something, which is an effect.
#[must_use]
pub fn motion(logs: &Logs, left: f64) -> Option<CheckResult> {
    let moved = about_the_mean(logs).sqrt();
    (moved <= LEAST_GAP && left <= LEAST_GAP).then(|| {
        check(
            "motion",
            false,
            "nothing moves in the training logs: every reading stays within its noise of its mean, as those of the model do, which no effect would change; log motions of the machine".into(),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::tests::{log, plant};

    /// Symptom: logs of a machine at rest were answered with `none`, 98 %, and no check failed.
    #[test]
    fn a_machine_at_rest_tells_nothing() {
        let of = |readings: &[f64], left: f64| {
            let logs = vec![log("a", readings)];
            let mut logs = Logs::new(&plant(), &["place".to_owned()], logs).unwrap();
            logs.set_noise(&[0.5]);
            motion(&logs, left)
        };
        let still = of(&[1.0, 2.0, 1.0, 2.0], 1.0).unwrap();
        assert!(!still.ok && still.detail.contains("nothing moves"));
        assert!(of(&[1.0, 3.0, 5.0, 7.0], 1.0).is_none());
    }

    /// Symptom: of a lift that friction held, the check said that no effect would change it. Cause:
    /// the model moved, which the check did not look at.
    #[test]
    fn a_machine_that_is_held_tells_what_holds_it() {
        let logs = vec![log("a", &[1.0, 2.0, 1.0, 2.0])];
        let mut logs = Logs::new(&plant(), &["place".to_owned()], logs).unwrap();
        logs.set_noise(&[0.5]);
        assert!(motion(&logs, 9.0).is_none());
    }
}
