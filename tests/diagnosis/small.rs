//! Small gaps, and details of an effect that are no further effect.

use std::path::Path;

use super::world::{NOISE, NOMINAL, Truth, write_study};
use super::{Kind, assert_names, run_on};

/// Writes the cart's study with so small a time step that the remaining gap is not the integrator's
/// error.
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
    // Drag on the cart, friction on the rail and a weaker drive are nearly equivalent here.
    let friction = r.effects.iter().find(|e| e.effect == "viscous-friction");
    let friction = friction.expect("friction is among what is likely");
    let damping = friction.parameters["damping"];
    assert!((damping - 0.012).abs() < 0.003, "{:?}", r.effects);
    assert!(friction.probability > 0.1, "{:?}", r.effects);
}

#[test]
fn a_missing_first_reading_leaves_the_noise_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::Coulomb(1.2));
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "csv") {
            let text = std::fs::read_to_string(&path).unwrap();
            let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
            let mut cells: Vec<&str> = lines[1].split(',').collect();
            cells[2] = "";
            lines[1] = cells.join(",");
            std::fs::write(&path, lines.join("\n") + "\n").unwrap();
        }
    }
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["coulomb-friction@rail"]);
    let x = r.gap.signals.iter().find(|s| s.signal == "x").unwrap();
    assert!((x.noise / NOISE[0] - 1.0).abs() < 0.2, "{}", x.noise);
}

#[test]
fn friction_that_is_stronger_one_way_needs_no_second_effect() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::UnevenFriction([0.8, 0.3]));
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["coulomb-friction@rail"]);
    let parameters = &r.effects[0].parameters;
    assert!((parameters["force"] - 0.8).abs() < 0.05, "{parameters:?}");
    assert!((parameters["offset"] - 0.3).abs() < 0.05, "{parameters:?}");
}
