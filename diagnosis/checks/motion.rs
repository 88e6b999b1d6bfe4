//! Whether anything moves in the logs: logs of a machine at rest show no effect.

use super::check;
use crate::data::Logs;
use crate::findings::LEAST_GAP;
use crate::result::CheckResult;
use crate::skill::about_the_mean;

/// Returns a failed check if no reading of the logs changes by more than its noise; `None` if one
/// does.
#[must_use]
pub fn motion(logs: &Logs) -> Option<CheckResult> {
    let moved = about_the_mean(logs).sqrt();
    (moved <= LEAST_GAP).then(|| {
        check(
            "motion",
            false,
            "nothing moves in the training logs: every reading stays within its noise of its mean, which no effect would change; log motions of the machine".into(),
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
        let of = |readings: &[f64]| {
            let logs = vec![log("a", readings)];
            let mut logs = Logs::new(&plant(), &["place".to_owned()], logs).unwrap();
            logs.set_noise(&[0.5]);
            motion(&logs)
        };
        let still = of(&[1.0, 2.0, 1.0, 2.0]).unwrap();
        assert!(!still.ok && still.detail.contains("nothing moves"));
        assert!(of(&[1.0, 3.0, 5.0, 7.0]).is_none());
    }
}
