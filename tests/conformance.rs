//! Every registered engine against every conformance check, and proof that the checks detect a
//! faulty engine.
//!
//! `cargo test --features mujoco --test conformance -- --nocapture` prints the table.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "conformance/fault.rs"]
mod fault;
#[path = "conformance/mutant.rs"]
mod mutant;
#[path = "conformance/narrow.rs"]
mod narrow;

use asid::core::registry::{self, BackendEntry};
use asid::core::{Backend, Capabilities, Error, Model, Scene};
use asid_conformance::{Check, Outcome, Row, checks, run_checks, table};
use fault::Fault;
use mutant::Mutant;
use narrow::Narrow;

fn engines() -> Vec<Box<dyn Backend>> {
    let engines: Vec<_> = registry::all::<BackendEntry>()
        .into_iter()
        .filter_map(|entry| match (entry.make)() {
            Ok(backend) => Some(backend),
            Err(Error::Missing { what, message }) => {
                println!("{what} is left out: {message}");
                None
            }
            Err(error) => panic!("{}: {error}", entry.name),
        })
        .collect();
    assert!(!engines.is_empty(), "no engine is linked in");
    engines
}

/// An engine that refuses every scene.
struct Refusing<'a>(&'a dyn Backend);

impl Backend for Refusing<'_> {
    fn name(&self) -> &str {
        "refusing"
    }

    fn version(&self) -> String {
        self.0.version()
    }

    fn capabilities(&self) -> Capabilities {
        self.0.capabilities()
    }

    fn load(&self, scene: &Scene) -> asid::core::Result<std::sync::Arc<dyn Model>> {
        Err(Error::Scene {
            scene: scene.name().to_owned(),
            message: "too difficult".into(),
        })
    }
}

/// All rows of an engine, with two checks at a time.
fn rows(engine: &dyn Backend) -> Vec<Row> {
    let all: Vec<&Check> = checks().collect();
    run_checks(engine, &all, 2, &|_| {})
}

#[test]
fn every_engine_conforms() {
    let mut failures = Vec::new();
    for engine in engines() {
        let rows = rows(&*engine);
        println!("{}", table(&rows));
        failures.extend(rows.into_iter().filter(Row::is_failure));
    }
    assert!(failures.is_empty(), "\n{}", table(&failures));
}

/// Capabilities of small engines: mechanisms, driven mechanisms, free bodies.
const SMALL: [Capabilities; 3] = [
    Capabilities::ARTICULATION.union(Capabilities::EXACT_SNAPSHOT),
    Capabilities::ARTICULATION
        .union(Capabilities::ACTUATORS)
        .union(Capabilities::JOINT_IMPEDANCE)
        .union(Capabilities::EXACT_SNAPSHOT)
        .union(Capabilities::EXTERNAL_FORCES)
        .union(Capabilities::STEP_HOOKS),
    Capabilities::FREE_BODIES.union(Capabilities::EXACT_SNAPSHOT),
];

/// The claimed bits that some check tests without needing an unclaimed bit, or that no check needs.
fn checkable(claimed: Capabilities) -> Capabilities {
    let seen = |bit: &Capabilities| {
        let mut of = checks().filter(|c| c.needs.contains(*bit)).peekable();
        of.peek().is_none() || of.any(|check| claimed.contains(check.needs))
    };
    claimed.iter().filter(seen).collect()
}

#[test]
fn no_check_needs_more_than_it_names() {
    // An engine that refuses whatever it does not claim passes the remaining checks.
    let engine = engines().swap_remove(0);
    let all = engine.capabilities();
    let mut failures = Vec::new();
    // Precision cannot be removed, because tolerances depend on it.
    let bits = (all - Capabilities::DOUBLE_PRECISION).iter();
    let without = bits.map(|bit| checkable(all - bit));
    for bits in without.chain(SMALL) {
        let bits = bits | Capabilities::DOUBLE_PRECISION;
        let rows = rows(&Narrow::new(&*engine, bits));
        let passes = rows.iter().filter(|r| r.outcome == Outcome::Pass).count();
        println!(
            "{passes:3} of {} checks without {:?}",
            rows.len(),
            all - bits
        );
        assert!(passes > 30, "only {passes} checks with {bits:?}");
        failures.extend(rows.into_iter().filter(Row::is_failure).map(|mut row| {
            row.engine = format!("without {:?}", all - bits);
            row
        }));
    }
    assert!(failures.is_empty(), "\n{}", table(&failures));
}

/// Faults that no check detects in an otherwise correct engine.
fn missed(engine: &dyn Backend, faults: impl Iterator<Item = Fault>) -> Vec<Fault> {
    let sound: Vec<&Check> = (checks().zip(rows(engine)))
        .filter(|(_, row)| row.outcome == Outcome::Pass)
        .map(|(check, _)| check)
        .collect();
    let caught = |fault| {
        let rows = run_checks(&Mutant::new(engine, fault), &sound, 2, &|_| {});
        let failed = rows.into_iter().filter(Row::is_failure);
        failed.map(|row| row.check).collect::<Vec<_>>()
    };
    // The wrapper itself changes nothing.
    assert_eq!(caught(Fault::None), Vec::<String>::new());
    faults
        .filter(|fault| {
            let caught = caught(*fault);
            println!("{fault:?}: {}", caught.join(", "));
            caught.is_empty()
        })
        .collect()
}

#[test]
fn faults_of_a_whole_engine_are_caught() {
    // Any engine serves for this test, and one correct engine is enough.
    let engine = engines().swap_remove(0);
    let faults = Fault::ALL.into_iter().filter(|f| f.of_a_whole_engine());
    let missed = missed(&*engine, faults);
    assert!(missed.is_empty(), "no check sees {missed:?}");
}

#[test]
fn faults_of_a_mechanism_are_caught() {
    // A small engine gets the same checks of what it supports.
    let engine = engines().swap_remove(0);
    let bits = Capabilities::all()
        - Capabilities::CONTACT
        - Capabilities::FREE_BODIES
        - Capabilities::EQUALITY
        - Capabilities::MESHES
        - Capabilities::CONTACT_FORCES;
    let faults = Fault::ALL.into_iter().filter(|f| f.of_a_mechanism());
    let missed = missed(&Narrow::new(&*engine, bits), faults);
    assert!(missed.is_empty(), "no check sees {missed:?}");
}

#[test]
fn faults_of_free_bodies_are_caught() {
    let engine = engines().swap_remove(0);
    let bits = Capabilities::FREE_BODIES
        | Capabilities::EXTERNAL_FORCES
        | Capabilities::STEP_HOOKS
        | Capabilities::MASS_PARAMETERS
        | Capabilities::EXACT_SNAPSHOT
        | Capabilities::DOUBLE_PRECISION;
    let engine = Narrow::new(&*engine, bits);
    let missed = missed(&engine, Fault::OF_FREE_BODIES.into_iter());
    assert!(missed.is_empty(), "no check sees {missed:?}");
}

#[test]
fn a_more_accurate_integrator_conforms() {
    let engine = engines().swap_remove(0);
    // Contact is of first order in any engine.
    let bits = engine.capabilities() - Capabilities::CONTACT;
    let engine = Narrow::new(&*engine, checkable(bits));
    let rows = rows(&Mutant::new(&engine, Fault::FourthOrder));
    println!("{}", table(&rows));
    let failures: Vec<Row> = rows.into_iter().filter(Row::is_failure).collect();
    assert!(failures.is_empty(), "\n{}", table(&failures));
}

/// A row of an engine that claims `bits` and no others.
fn row(bits: Capabilities, check: &str) -> Row {
    let engine = engines().swap_remove(0);
    let check = checks().find(|c| c.name == check).unwrap();
    check.run(&Narrow::new(&*engine, bits))
}

#[test]
fn an_engine_that_claims_no_motion_fails() {
    let nothing = Capabilities::EXACT_SNAPSHOT;
    let engine = engines().swap_remove(0);
    let rows = rows(&Narrow::new(&*engine, nothing));
    let failed: Vec<&Row> = rows.iter().filter(|row| row.is_failure()).collect();
    assert_eq!(failed.len(), 1, "{}", table(&rows));
    assert_eq!(failed[0].check, "claims/something-moves");
    assert!(failed[0].note.starts_with("claims neither FREE_BODIES"));
    // Checks without required capabilities still run.
    let faults = rows.iter().filter(|row| row.family() == "faults");
    assert!(faults.filter(|r| r.outcome == Outcome::Pass).count() >= 6);
}

#[test]
fn a_bit_without_a_check_fails_by_name() {
    let bits = Capabilities::FREE_BODIES | Capabilities::ACTUATORS;
    let found = row(bits, "claims/every-bit-is-checked");
    assert_eq!(
        found.note,
        "ACTUATORS is claimed, but every check of it also needs ARTICULATION"
    );
    let sound = bits | Capabilities::ARTICULATION;
    let found = row(sound, "claims/every-bit-is-checked");
    assert_eq!(found.outcome, Outcome::Pass, "{}", found.note);
}

#[test]
fn a_refused_scene_is_named_by_its_check() {
    let engine = engines().swap_remove(0);
    let check = checks().find(|c| c.name == "dynamics/pendulum-energy");
    let check = check.unwrap();
    let scenes = check.scenes(&*engine);
    assert_eq!(scenes.len(), 1);
    assert!(scenes[0].contains("<joint name=\"j\""), "{}", scenes[0]);
    let note = check.run(&Refusing(&*engine)).note;
    assert_eq!(note, "scene of dynamics/pendulum-energy: too difficult");
}

#[test]
fn rows_survive_json_and_threads() {
    let engine = engines().swap_remove(0);
    // With as many at a time as there may be, the rows and their order are the same.
    let all: Vec<&Check> = checks().take(20).collect();
    let one = run_checks(&*engine, &all, 1, &|_| {});
    assert_eq!(one, run_checks(&*engine, &all, 8, &|_| {}));
    let rows: Vec<Row> = checks().take(3).map(|check| check.run(&*engine)).collect();
    let text = serde_json::to_string(&rows).unwrap();
    assert!(text.contains(r#""outcome":"pass""#), "{text}");
    assert_eq!(serde_json::from_str::<Vec<Row>>(&text).unwrap(), rows);
}
