//! Studies of real machines: known properties of them are found in their logs.

#![allow(clippy::unwrap_used)]

mod diagnosis_support;

use std::path::Path;

use asid::core::progress::Silent;
use asid::diagnosis::diagnose::{Diagnosis, Settings, diagnose};
use asid::diagnosis::machine::Machine;
use asid::diagnosis::settings::Breadth;
use asid::diagnosis::study::Study;
use diagnosis_support::engine;

/// Diagnoses some episodes of a study with single effects.
fn singles(study: &str, train: &[&str], test: &[&str]) -> Diagnosis {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("studies")
        .join(study);
    let mut study = Study::read(&folder).unwrap();
    study.train.retain(|(name, _)| train.contains(&&**name));
    study.test.retain(|(name, _)| test.contains(&&**name));
    assert_eq!(
        study.train.len() + study.test.len(),
        train.len() + test.len()
    );
    let machine = Machine::new(engine(), &study.scene, &study.fixed, &study.effects, 0).unwrap();
    let settings = Settings {
        breadth: Breadth {
            depth: 1,
            ..Breadth::default()
        },
        ..Settings::default()
    };
    diagnose(&study, machine, settings, &Silent).unwrap().0
}

/// Asserts that, of all single effects, friction of a joint leaves the smallest gap.
///
/// It must be less than half of the root mean square without effects, on held-out episodes.
fn friction_comes_first(found: &Diagnosis, joint: &str) {
    let ladder = &found.trace.ladder;
    let best = &ladder[0];
    let identified = found.result.gap.identified;
    let friction = format!("friction@{joint}");
    assert!(best.label.contains(&friction), "{ladder:?}");
    assert!(best.gap < 0.5 * identified, "{identified}: {ladder:?}");
}

/// The authors of these logs find that friction which grows with the load is what a servo's model
/// lacks most (Duclusaud et al., Extended friction models, 2025).
#[test]
fn a_servo_lacks_friction_first_of_all() {
    let found = singles(
        "servo-pendulum",
        &[
            "train_sin-sin_0.csv",
            "train_sin-time-square_2.csv",
            "train_up-and-down_0.csv",
        ],
        &["test_sin-sin_1.csv", "test_up-and-down_1.csv"],
    );
    friction_comes_first(&found, "output");
}

/// The authors of these logs find dry friction of 0.09 to 0.19 N m at both joints (Wiebe et al.,
/// Open source dual-purpose acrobot and pendubot platform, 2023).
///
/// Long replays diverge with any model. The missing force from moment to moment does not.
#[test]
fn a_double_pendulum_lacks_dry_friction_at_both_joints() {
    let found = singles(
        "double-pendulum",
        &[
            "train_a_1s.csv",
            "train_b_4s.csv",
            "train_c_1s.csv",
            "train_d_7s.csv",
        ],
        &["test_e_4s.csv", "test_f_1s.csv"],
    );
    let result = &found.result;
    let named = &result.verdict.effects;
    for joint in ["elbow", "shoulder"] {
        let friction = format!("friction@{joint}");
        assert!(named.iter().any(|e| e.ends_with(&friction)), "{named:?}");
        let missing = result
            .missing_force
            .iter()
            .find(|m| m.dof == joint)
            .unwrap();
        assert!(missing.refined < missing.identified, "{missing:?}");
    }
    assert!(
        result.gap.refined < 0.5 * result.gap.identified,
        "{:?}",
        result.gap
    );
}
