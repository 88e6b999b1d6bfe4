//! Diagnoses of machines whose fault only the test knows, and how they fail when they should.

#![allow(clippy::unwrap_used)]

mod arm;
mod ball;
mod between_steps;
mod beyond;
mod coupled_finger;
#[path = "../diagnosis_support/mod.rs"]
mod diagnosis_support;
mod drift;
mod estimates;
mod far;
mod few_rows;
mod filtered_at_a_stop;
mod finer_law;
mod first_row;
mod held_joint;
mod homed_servo;
mod islands;
mod late_drive;
mod later_sensor;
mod next;
mod next_number;
mod no_wiring;
mod one_joint;
mod ordinary;
#[cfg(feature = "mujoco")]
mod own_memory;
mod played;
mod raised_tracker;
mod roll;
mod row_slopes;
mod rows;
mod scatter;
mod segment_slopes;
mod seldom;
mod series_spring;
mod servo;
mod several_causes;
mod slow_noise;
mod small;
mod soft_belt;
mod standing;
mod step_error;
mod steps;
mod sticking;
mod stopped;
mod stopped_knee;
mod together;
mod tray;
mod two_values;
mod unmoved;
mod unread;
mod wiring;
mod world;

use std::path::Path;

use asid::core::Capabilities;
use asid::core::progress::Silent;
use asid::diagnosis::diagnose::{Diagnosis, Settings, Work, diagnose};
use asid::diagnosis::forces;
use asid::diagnosis::machine::Machine;
use asid::diagnosis::result::{DiagnosisResult, Kind};
use asid::diagnosis::study::Study;
use asid::diagnosis::windows;
use diagnosis_support::engine;
use world::{MASS, Truth, write_study};

/// Whether the engine has contacts that are exact enough for these tests.
fn has_contacts() -> bool {
    let needed = Capabilities::CONTACT | Capabilities::DOUBLE_PRECISION;
    engine().capabilities().contains(needed)
}

/// Asserts that the verdict names exactly these effects.
#[track_caller]
fn assert_names(result: &DiagnosisResult, effects: &[&str]) {
    assert_eq!(result.verdict.effects, effects, "{}", result.sentence);
}

fn run(truth: Truth, without: &[&str]) -> (Diagnosis, Work) {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), truth);
    run_on(folder.path(), without)
}

fn run_on(folder: &Path, without: &[&str]) -> (Diagnosis, Work) {
    let study = Study::read(folder).unwrap();
    let (fixed, effects) = (&study.fixed, &study.effects);
    let machine = Machine::new(engine(), &study.scene, fixed, effects, 0).unwrap();
    let settings = Settings {
        without: without.iter().map(|s| (*s).to_owned()).collect(),
        ..Settings::default()
    };
    diagnose(&study, machine, settings, &Silent).unwrap()
}

/// Cases with the labels of a scorer.
const CASES: [(Truth, &[&str]); 5] = [
    (Truth::None, &[]),
    (Truth::Coulomb(1.2), &["coulomb-friction@rail"]),
    // Drag on the cart has the same effect, but is the less usual explanation.
    (Truth::Viscous(1.5), &["viscous-friction@rail"]),
    (Truth::Delay(0.03), &["actuator-delay@belt"]),
    (Truth::SensorBias(0.02), &["sensor-bias@x"]),
];

#[test]
fn faults_are_named_and_closed() {
    let done: Vec<_> = CASES.iter().map(|(truth, _)| run(*truth, &[]).0).collect();
    for (diagnosis, (truth, effects)) in done.iter().zip(CASES) {
        let r = &diagnosis.result;
        let said = r.verdict.effects.iter().map(String::as_str);
        assert!(
            said.eq(effects.iter().copied()),
            "{truth:?}: {}",
            r.sentence
        );
        // The model's step of 2 ms puts it about 2 standard deviations off the real cart.
        assert!(r.gap.refined < 2.5, "{truth:?}: {:?}", r.gap);
        if !effects.is_empty() {
            assert!(r.gap.closed.unwrap() > 0.95, "{truth:?}: {:?}", r.gap);
        }
        let error = (r.parameters[0].estimate / MASS - 1.0).abs();
        assert!(error < 0.05, "{truth:?}: mass off by {error}");
        let sum: f64 = r.hypotheses.iter().map(|h| h.probability).sum();
        assert!((sum - 1.0).abs() < 1e-9, "probabilities sum to {sum}");
        let shares: f64 = r.places.iter().map(|w| w.share).sum();
        assert!((shares - 1.0).abs() < 1e-9 || r.places.is_empty());
    }
}

/// Removes the initial states from the logs of a folder.
fn forget_starts(folder: &Path) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "csv") {
            let text = std::fs::read_to_string(&path).unwrap();
            let rows = text.lines().map(|line| {
                let cells: Vec<&str> = line.split(',').collect();
                cells[..cells.len() - 2].join(",") + "\n"
            });
            std::fs::write(&path, rows.collect::<String>()).unwrap();
        }
    }
}

#[test]
fn where_starts_are_open_friction_is_named_and_its_force_is_read_off_short_windows() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::Coulomb(1.2));
    forget_starts(folder.path());
    let (diagnosis, work) = run_on(folder.path(), &[]);
    let r = &diagnosis.result;
    // Without initial states the logs do not show whether friction also falls from a breakaway
    // value.
    let dry = ["coulomb-friction@rail", "stribeck-friction@rail"];
    let [named] = &r.verdict.effects[..] else {
        panic!("{}", r.sentence)
    };
    assert!(dry.contains(&&**named), "{}", r.sentence);
    let bench = &work.bench;
    let rows = windows::rows(&bench.machine.plant, &bench.train.logs, &bench.open).unwrap();
    let record = windows::cut(&bench.machine.plant, &bench.train, rows);
    // The mass and the friction can only be identified together.
    let theta = [diagnosis.values[0]];
    let lacks = forces::missing(bench, &record, &[], &theta).unwrap();
    let [rail] = &lacks.joints[..] else {
        panic!("{lacks:?}")
    };
    // A window with a reversal has friction of both signs.
    let [against, error] = rail.against;
    assert!((0.7..1.3).contains(&against), "{rail:?}");
    assert!(error < 0.15 * against, "{rail:?}");
    assert!(!rail.touching && rail.unit == "N");
    let singles = work.findings.found.iter().map(|f| &f.explanation.effects);
    let mut singles = singles.filter(|e| e.len() == 1 && e[0].label() == *named);
    let found = &singles.next().unwrap()[0];
    let values: Vec<f64> = found.values.iter().map(|(_, v)| *v).collect();
    let candidate = work.candidates.iter().find(|c| c.label() == found.label());
    let trials = [(candidate.unwrap(), values)];
    let left = forces::missing(bench, &record, &trials, &theta).unwrap();
    assert!(left.joints[0].force < 0.2 * rail.force, "{left:?}");
    let [Some(before), Some(after)] = [lacks.gaps[0], left.gaps[0]] else {
        panic!("{lacks:?} {left:?}")
    };
    assert!(after < 2.0 && before > 2.0 * after, "{before} {after}");
    assert!(lacks.gaps[1].is_none(), "nothing can be touched: {lacks:?}");
}

#[test]
fn with_the_right_effect_out_of_the_catalogue_its_name_is_not_given() {
    // No other effect of the catalogue is a spring, and the closest one leaves a gap.
    let (diagnosis, _) = run(Truth::Spring(15.0), &["joint-stiffness"]);
    let r = &diagnosis.result;
    assert!(
        !r.verdict
            .effects
            .contains(&"joint-stiffness@rail".to_owned())
    );
    assert!(r.gap.refined > 2.0, "{:?}", r.gap);
    let (with, _) = run(Truth::Spring(15.0), &[]);
    assert_eq!(with.result.verdict.effects, ["joint-stiffness@rail"]);
}

#[test]
fn an_effect_of_no_catalogue_is_unknown() {
    let (diagnosis, _) = run(Truth::Magnet(3.0), &[]);
    assert_eq!(
        diagnosis.result.verdict.kind,
        Kind::Unknown,
        "{}",
        diagnosis.result.sentence
    );
}

#[test]
fn noise_in_place_of_logs_is_no_effect() {
    // The commands and readings are those of a machine that does not move. Nothing can be found,
    // and the check of the excitation says why.
    let (diagnosis, _) = run(Truth::Noise, &[]);
    let r = &diagnosis.result;
    assert_eq!(r.verdict.kind, Kind::None, "{}", r.sentence);
    let excitation = r.checks.iter().find(|c| c.check == "excitation").unwrap();
    assert!(!excitation.ok, "{}", excitation.detail);
}

#[test]
fn the_same_study_gives_the_same_result_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::Coulomb(0.8));
    let study = Study::read(folder.path()).unwrap();
    let results = [1, 2].map(|threads| {
        let (fixed, effects) = (&study.fixed, &study.effects);
        let machine = Machine::new(engine(), &study.scene, fixed, effects, threads).unwrap();
        let settings = Settings::default();
        let (diagnosis, _) = diagnose(&study, machine, settings, &Silent).unwrap();
        // As JSON: a limit beyond the range of an effect is not a number there.
        serde_json::to_value(diagnosis.result).unwrap()
    });
    assert_eq!(results[0], results[1]);
}

#[test]
fn a_chaotic_arm_is_fitted_up_to_its_horizon_and_its_integrator_is_no_second_effect() {
    let folder = tempfile::tempdir().unwrap();
    arm::write_study(folder.path());
    let (diagnosis, _) = run_on(folder.path(), &[]);
    let r = &diagnosis.result;
    assert_names(r, &["actuator-gain@m_shoulder"]);
    assert!(r.verdict.probability > 0.8, "{}", r.sentence);
    let gain = diagnosis.effects[0].values[0].1;
    assert!((gain / arm::GAIN - 1.0).abs() < 1e-3, "gain {gain}");
    let mass = diagnosis.values[0];
    assert!((mass / arm::FORE - 1.0).abs() < 1e-3, "mass {mass}");
}
