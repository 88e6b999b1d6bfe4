//! Every registered engine against every conformance check, and the proof that
//! the checks see a wrong engine.
//!
//! `cargo test --features mujoco --test conformance -- --nocapture` prints the table.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "conformance/mutant.rs"]
mod mutant;
#[path = "conformance/narrow.rs"]
mod narrow;

use asid::core::registry::{self, BackendEntry};
use asid::core::{Backend, Capabilities, Error};
use asid_conformance::{Outcome, Row, checks, run, table};
use mutant::{Fault, Mutant};
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

#[test]
fn every_engine_conforms() {
    let mut failures = Vec::new();
    for engine in engines() {
        let rows = run(&*engine);
        println!("{}", table(&rows));
        failures.extend(rows.into_iter().filter(Row::is_failure));
    }
    assert!(failures.is_empty(), "\n{}", table(&failures));
}

/// What small engines claim: mechanisms, driven mechanisms, free bodies.
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

#[test]
fn no_check_needs_more_than_it_names() {
    // An engine that refuses whatever it does not claim passes what is left.
    let engine = engines().swap_remove(0);
    let all = engine.capabilities();
    let mut failures = Vec::new();
    let without = all.iter().map(|bit| all - bit);
    for bits in without.chain(SMALL) {
        // Precision is not for the taking: tolerances follow from it.
        let bits = bits | Capabilities::DOUBLE_PRECISION;
        let rows = run(&Narrow::new(&*engine, bits));
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

#[test]
fn every_fault_is_caught() {
    // Which engine is spoilt does not matter; one that is right is enough.
    let engine = engines().swap_remove(0);
    let sound: Vec<bool> = checks()
        .map(|check| check.run(&*engine).outcome == Outcome::Pass)
        .collect();
    let mutant = |fault| Mutant::new(&*engine, fault);
    let mut missed = Vec::new();
    for fault in Fault::ALL {
        let caught: Vec<&str> = checks()
            .zip(&sound)
            .filter(|(check, sound)| **sound && check.run(&mutant(fault)).is_failure())
            .map(|(check, _)| check.name)
            .collect();
        println!("{fault:?}: {}", caught.join(", "));
        if caught.is_empty() {
            missed.push(fault);
        }
    }
    assert!(missed.is_empty(), "no check sees {missed:?}");
    // The wrapper itself changes nothing.
    for (check, sound) in checks().zip(&sound) {
        let row = check.run(&mutant(Fault::None));
        assert_eq!(row.outcome == Outcome::Pass, *sound, "{row:?}");
    }
}

#[test]
fn rows_survive_json() {
    let engine = engines().swap_remove(0);
    let rows: Vec<Row> = checks().take(3).map(|check| check.run(&*engine)).collect();
    let text = serde_json::to_string(&rows).unwrap();
    assert!(text.contains(r#""outcome":"pass""#), "{text}");
    assert_eq!(serde_json::from_str::<Vec<Row>>(&text).unwrap(), rows);
}
