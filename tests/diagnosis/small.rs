//! Small gaps, and what is part of an effect rather than another one.

use std::path::Path;

use super::world::{NOMINAL, Truth, write_study};
use super::{Kind, run_on};

/// The cart's study with a time step so fine that what is left of a gap is no integrator's.
fn write_finely(folder: &Path, truth: Truth) {
    write_study(folder, truth);
    let finer = NOMINAL.replace("0.002", "0.0002");
    std::fs::write(folder.join("nominal.xml"), finer).unwrap();
}

#[test]
fn a_gap_below_two_is_named_where_replays_of_logs_held_out_close_it() {
    let folder = tempfile::tempdir().unwrap();
    write_finely(folder.path(), Truth::Viscous(0.012));
    let r = run_on(folder.path(), &[]).0.result;
    let [before, after] = [r.gap.identified, r.gap.refined];
    assert!(1.2 < before && before < 2.2, "{before}");
    assert_eq!(r.verdict.kind, Kind::Effects, "{}", r.sentence);
    assert!(after < 1.05, "{after}");
    // Drag on the cart, friction on the rail and damping of the drive are one law here.
    let damping = r.effects[0].parameters.values().next().copied();
    assert!((damping.unwrap() - 0.012).abs() < 0.004, "{:?}", r.effects);
}

#[test]
fn friction_that_is_stronger_one_way_needs_no_second_effect() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::UnevenFriction([0.8, 0.3]));
    let r = run_on(folder.path(), &[]).0.result;
    assert_eq!(
        r.verdict.effects,
        ["coulomb-friction@rail"],
        "{}",
        r.sentence
    );
    let parameters = &r.effects[0].parameters;
    assert!((parameters["force"] - 0.8).abs() < 0.05, "{parameters:?}");
    assert!((parameters["offset"] - 0.3).abs() < 0.05, "{parameters:?}");
}
