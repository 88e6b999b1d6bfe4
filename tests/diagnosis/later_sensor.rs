//! A sensor that only the held-out logs read. No log shows its noise before the fit.

use std::path::Path;

use super::run_on;
use super::world::{Truth, write_study};

/// Takes the speed out of the training logs of a folder.
fn forget_speeds(folder: &Path) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.starts_with("train") {
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.contains(",dx,"), "{name}");
            std::fs::write(&path, text.replacen(",dx,", ",other,", 1)).unwrap();
        }
    }
}

/// Symptom: the gap of a right model was a billion, before any fit and after, and the check `log`
/// said of the sensor only that nothing is fitted to it.
///
/// Cause: the noise was estimated from the training logs. Without a reading there it was 1e-12, the
/// smallest that a sensor can have.
#[test]
fn a_sensor_without_a_reading_to_fit_to_is_not_in_the_gap() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::None);
    forget_speeds(folder.path());
    let result = run_on(folder.path(), &[]).0.result;
    let signals = result.gap.signals.iter().map(|s| &*s.signal);
    assert_eq!(signals.collect::<Vec<_>>(), ["x"]);
    // As with both sensors: the model's step of 2 ms puts it about 2 standard deviations off.
    assert!(result.gap.refined < 2.5, "{:?}", result.gap);
    let log = result.checks.iter().find(|c| c.check == "log").unwrap();
    let said = "no log to fit to reads it, so that its noise is not known and it is passed over";
    assert!(!log.ok && log.detail.contains(said), "{}", log.detail);
}
