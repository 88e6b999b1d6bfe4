//! A machine that matches its model except for ordinary tolerances. No tolerance stands out, and a
//! larger effect is named alone.

use asid::diagnosis::result::Kind;

use super::world::Truth;
use super::{assert_names, run};

/// Laws that are fitted within their tolerances.
fn laws(result: &asid::diagnosis::result::DiagnosisResult) -> Vec<&str> {
    result.tolerances.iter().map(|t| &*t.effect).collect()
}

#[test]
fn a_little_friction_and_delay_are_no_effect_and_are_in_the_refined_model() {
    let (found, _) = run(Truth::Ordinary(0.0), &[]);
    let r = &found.result;
    assert_eq!(r.verdict.kind, Kind::None, "{}", r.sentence);
    assert!(r.verdict.effects.is_empty() && r.effects.iter().all(|e| e.probability < 0.5));
    assert!(r.gap.identified > 5.0 && r.gap.refined < 2.5, "{:?}", r.gap);
    assert!(laws(r).contains(&"viscous-friction"), "{:?}", r.tolerances);
    let written: Vec<&str> = found.effects.iter().map(|e| &*e.name).collect();
    assert_eq!(written, laws(r));
    assert!(
        r.sentence.starts_with("No effect stands out"),
        "{}",
        r.sentence
    );
}

#[test]
fn what_stands_out_beside_tolerances_is_named_alone() {
    let (found, _) = run(Truth::Ordinary(2.0), &[]);
    let r = &found.result;
    assert_names(r, &["joint-stiffness@rail"]);
    assert!(r.gap.refined < 2.5, "{:?}", r.gap);
    assert!(!laws(r).contains(&"joint-stiffness"));
}

#[test]
fn more_friction_than_an_ordinary_joint_has_is_named() {
    // 75 % more than the model has; three standard deviations of the tolerance are 30 %.
    let (found, _) = run(Truth::Viscous(1.5), &[]);
    assert_eq!(found.result.verdict.effects, ["viscous-friction@rail"]);
    assert!(found.result.tolerances.is_empty());
}
