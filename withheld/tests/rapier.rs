//! Worlds that rapier moves: closed forms of free flight, and agreement with MuJoCo.

use asid_withheld::anatomy::Anatomy;
use asid_withheld::case;
use asid_withheld::engine::RAPIER;
use asid_withheld::gap::Bench;
use asid_withheld::machine::Half;
use asid_withheld::motion::{Motion, Style};
use asid_withheld::plan::{Kind, Plan};
use asid_withheld::random::stream;
use asid_withheld::simulate::{Record, simulate};
use asid_withheld::world::World;
use asid_withheld::{causes, machines};

/// Gravity, m/s².
const G: f64 = 9.81;
/// Time step, s.
const STEP: f64 = 2.5e-4;
/// Rows of an episode, 10 ms apart.
const ROWS: usize = 81;

fn club() -> Anatomy {
    let mut all = machines::of(Half::Test);
    let machine = all.find(|m| m.name == "free-flight").expect("a machine");
    Anatomy::of(machine).expect("a model")
}

fn fly(anatomy: &Anatomy, world: &mut World, qpos: [f64; 7], qvel: [f64; 6]) -> Record {
    let motion = Motion {
        qpos: qpos.to_vec(),
        qvel: qvel.to_vec(),
        commands: Vec::new(),
        rows: ROWS,
        period: 0.01,
    };
    simulate(anatomy, world, &[motion]).expect("a run")
}

fn world(anatomy: &Anatomy) -> World {
    World::new(anatomy, &[0.2], STEP, RAPIER).expect("a world")
}

#[test]
fn a_body_without_spin_falls_along_a_parabola() {
    let anatomy = club();
    let (v, z) = ([1.5, -0.5, 3.0], 1.0);
    let start = [0.0, 0.0, z, 1.0, 0.0, 0.0, 0.0];
    let record = fly(
        &anatomy,
        &mut world(&anatomy),
        start,
        [v[0], v[1], v[2], 0.0, 0.0, 0.0],
    );
    for row in 0..ROWS {
        let t = row as f64 * 0.01;
        // Semi-implicit Euler falls by `g t h / 2` more. Single precision adds at most a tenth of a
        // millimetre.
        let expected = [v[0] * t, v[1] * t, z + v[2] * t - G * t * (t + STEP) / 2.0];
        for (axis, expected) in expected.into_iter().enumerate() {
            let found = record.at(0, t, axis);
            assert!(
                (found - expected).abs() < 2e-4,
                "{t} s: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn drag_brings_a_body_to_rest_exponentially() {
    let anatomy = club();
    let (mass, drag, speed) = (0.32, 0.8, 2.0);
    let mut world = world(&anatomy);
    if let Some(option) = world.document.find_mut("option", None) {
        option.set_numbers("gravity", &[0.0; 3]);
    }
    let bench = Bench::new(&anatomy, &[0.2], &[], STEP, RAPIER).expect("a bench");
    let place = asid_withheld::cause::Place {
        machine: &anatomy,
        typical: &bench.typical,
        site: "club",
        draw: [0.9; 4],
    };
    let cause = causes::named("linear-drag").expect("a cause");
    cause.act(&place, drag, &mut world);
    let start = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let record = fly(
        &anatomy,
        &mut world,
        start,
        [speed, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
    for row in 0..ROWS {
        let t = row as f64 * 0.01;
        let rate = drag / mass;
        let expected = speed / rate * (1.0 - (-rate * t).exp());
        let found = record.at(0, t, 0);
        assert!(
            (found - expected).abs() < 5e-4,
            "{t} s: {found}, not {expected}"
        );
    }
}

#[test]
fn both_engines_move_a_tumbling_body_alike() {
    let anatomy = club();
    let style = Style {
        seconds: anatomy.machine.seconds,
        rate: anatomy.machine.rate,
        vigour: 1.0,
        rest: 0.0,
    };
    let random = &mut stream(5, &["engines"]);
    let motions: Vec<Motion> = (0..6)
        .map(|_| Motion::draw(&anatomy, style, random))
        .collect();
    let bench = Bench::new(&anatomy, &[0.2], &motions, STEP, "implicitfast").expect("a bench");
    let by_rapier = bench.run(&mut world(&anatomy)).expect("a run");
    // In units of the noise; a case may have a gap of 0.5.
    let gap = bench.distance(&by_rapier, &bench.clean);
    assert!(gap > 0.0 && gap < 0.15, "{gap}");
}

#[test]
fn cases_of_both_engines_are_made_and_are_the_same_bytes_again() {
    let plan = Plan::draw(Half::Test, 2, 200, &[]).expect("a plan");
    // Cases without causes take one run each.
    let flights: Vec<usize> = (0..plan.slots.len())
        .filter(|&i| plan.machines[plan.slots[i].machine].machine.name == "free-flight")
        .filter(|&i| plan.slots[i].kind == Kind::None && !plan.slots[i].dirty)
        .take(6)
        .collect();
    let mut engines: Vec<String> = Vec::new();
    for number in flights {
        let one = case::make(&plan, 2, number).expect("a case");
        if one.label.world != "free-flight" {
            continue;
        }
        assert!(one.label.integration_gap <= 0.5);
        if one.label.engine == RAPIER && !engines.contains(&one.label.engine) {
            let again = case::make(&plan, 2, number).expect("a case");
            assert_eq!((&one.study, &one.label), (&again.study, &again.label));
        }
        engines.push(one.label.engine);
    }
    assert!(engines.iter().any(|e| e == RAPIER) && engines.iter().any(|e| e == "mujoco"));
}

#[test]
fn rapier_moves_what_flies_freely_and_nothing_else() {
    let flying = machines::ALL.iter().filter(|m| {
        let anatomy = Anatomy::of(m).expect("a model");
        anatomy.is_free_flight()
    });
    let names: Vec<&str> = flying.map(|m| m.name).collect();
    assert_eq!(names, ["free-flight"]);
}
