//! An encoder with steps far wider than the sensor's noise. Rounding has no derivative, but the log
//! shows it directly.

use super::world::{NOISE, Truth, write_study};
use super::{MASS, run_on};

/// Sixty standard deviations of the noise, m/s.
const STEP: f64 = 0.3;

#[test]
fn steps_wider_than_the_noise_are_named_with_their_width_and_hide_nothing() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::SpeedSteps(STEP));
    let path = folder.path().join("study.toml");
    let study = std::fs::read_to_string(&path).unwrap();
    let noise = format!("[noise]\nx = {}\ndx = {}\n", NOISE[0], NOISE[1]);
    std::fs::write(&path, study + &noise).unwrap();
    let r = run_on(folder.path(), &[]).0.result;
    assert_eq!(r.verdict.effects, ["sensor-quantization@dx"]);
    assert!(r.verdict.probability > 0.8, "{}", r.verdict.probability);
    let step = r.effects[0].parameters["step"];
    assert!((step - STEP).abs() < 0.01 * STEP, "{step}");
    let mass = r.parameters.iter().find(|p| p.name == "mass").unwrap();
    assert!(
        (mass.estimate - MASS).abs() < 0.02 * MASS,
        "{}",
        mass.estimate
    );
    // The rounding's standard deviation is seventeen times the noise. What is left: near an edge,
    // noise puts a reading on either side, sixty times the noise apart, in about one of a hundred
    // rows.
    let [before, after] = [r.gap.identified, r.gap.refined];
    assert!(before > 8.0 && after < 0.6 * before, "{before} {after}");
}
