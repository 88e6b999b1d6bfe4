//! Kinds of real worlds: what is drawn, how a scene gets it, and the command line.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;
#[allow(dead_code)] // not every test needs all of it
mod task_support;

use asid::core::registry::{BackendEntry, all};
use asid::core::{Capabilities, Policy, Problem, RealWorld as _, Result, Streams};
use asid::worlds::SimulatedWorld;
use asid::worlds::{Perturbation, PerturbationRanges, perturb};
use cli_support::{Workplace, tiny};
use rand::Rng as _;
use serde_json::Value;
use task_support::{on_engine, task};

fn draw(ranges: &PerturbationRanges, seed: u64) -> Perturbation {
    let task = task("rod-balancing");
    let plant = asid::mjcf::Plant::of(task.scene()).unwrap();
    let tracked = ["rod_pos".to_owned(), "rod_quat".to_owned()];
    let streams = Streams::new(seed).sealed("world");
    Perturbation::draw(ranges, &plant, &plant.layout, &tracked, streams).unwrap()
}

#[test]
fn draws_repeat_and_lie_in_their_ranges_and_a_range_moves_no_other() {
    let ranges = PerturbationRanges::default();
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let inside = |x: f64, [low, high]: [f64; 2]| (low..=high).contains(&x);
    for seed in 0..100 {
        let drawn = draw(&ranges, seed);
        assert_eq!(drawn, draw(&ranges, seed));
        assert!(inside(drawn.contact_time, ranges.contact_time));
        assert!(inside(drawn.contact_damping, ranges.contact_damping));
        assert!(inside(drawn.servo_lag, ranges.servo_lag));
        assert!(inside(drawn.mass["rod"], ranges.mass));
        let tracker = &drawn.tracker;
        assert!(inside(tracker.latency, ranges.tracker_latency));
        assert!(inside(
            length(&tracker.offset["rod_pos"]),
            ranges.tracker_offset
        ));
        assert!(inside(
            length(&tracker.offset["rod_quat"]),
            ranges.tracker_rotation
        ));
        let later = PerturbationRanges {
            tracker_latency: [0.03, 0.04],
            ..ranges.clone()
        };
        let mut other = draw(&later, seed);
        assert!(inside(other.tracker.latency, [0.03, 0.04]));
        other.tracker.latency = tracker.latency;
        assert_eq!(other, drawn);
    }
}

/// Actions that do not depend on the readings.
struct Blind(asid::core::rng::Rng);

impl Policy for Blind {
    fn reset(&mut self) {}
    fn act(&mut self, _: usize, _: &[f64], action: &mut [f64]) -> Result<()> {
        action.fill_with(|| self.0.random_range(-0.1..0.1));
        Ok(())
    }
    fn export(&self) -> Value {
        Value::Null
    }
}

/// An episode of a world with these errors, and the errors that had to be left out.
fn episode(
    backend: &dyn asid::core::Backend,
    problem: &Problem<'_>,
    ranges: &PerturbationRanges,
) -> (Vec<u64>, Vec<String>) {
    let world = perturb(
        backend,
        problem.task.scene(),
        (&[], &[]),
        problem.parameters,
        problem.signals,
        &draw(ranges, 3),
    )
    .unwrap();
    let model = &*world.model;
    let Problem {
        task,
        parameters,
        signals,
        streams,
        ..
    } = *problem;
    let mut real = SimulatedWorld::new(task, model, parameters, &[0.04], signals, streams)
        .unwrap()
        .with_tracker(world.tracker)
        .unwrap();
    let played = real.explore(&mut Blind(streams.stream("blind"))).unwrap();
    let bits = played
        .episode
        .readings
        .iter()
        .map(|x| x.to_bits())
        .collect();
    (bits, world.left_out)
}

/// With every range at its null value, the perturbed world is bitwise the simulator. Each part
/// alone changes the episode or is reported as left out.
#[test]
fn each_part_acts_or_is_said_to_be_left_out() {
    let off = PerturbationRanges::off();
    let parts: [(&str, PerturbationRanges); 8] = [
        (
            "step",
            PerturbationRanges {
                steps: 2,
                ..off.clone()
            },
        ),
        (
            "contact softness",
            PerturbationRanges {
                contact_time: [1.3; 2],
                ..off.clone()
            },
        ),
        (
            "contact softness",
            PerturbationRanges {
                contact_damping: [0.7; 2],
                ..off.clone()
            },
        ),
        (
            "lag",
            PerturbationRanges {
                servo_lag: [0.01; 2],
                ..off.clone()
            },
        ),
        (
            "mass",
            PerturbationRanges {
                mass: [1.03; 2],
                ..off.clone()
            },
        ),
        (
            "latency",
            PerturbationRanges {
                tracker_latency: [0.01; 2],
                ..off.clone()
            },
        ),
        (
            "offset",
            PerturbationRanges {
                tracker_offset: [0.001; 2],
                ..off.clone()
            },
        ),
        (
            "rate",
            PerturbationRanges {
                tracker_every: [2; 2],
                ..off.clone()
            },
        ),
    ];
    let task = task("rod-balancing");
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        on_engine(
            &*backend,
            &*task,
            &task.parameters(),
            2,
            |problem, model| {
                let Problem {
                    task,
                    parameters,
                    signals,
                    streams,
                    ..
                } = *problem;
                let mut plain =
                    SimulatedWorld::new(task, &**model, parameters, &[0.04], signals, streams)
                        .unwrap();
                let simulator = plain.explore(&mut Blind(streams.stream("blind"))).unwrap();
                let simulator: Vec<u64> = simulator
                    .episode
                    .readings
                    .iter()
                    .map(|x| x.to_bits())
                    .collect();
                let (same, left_out) = episode(&*backend, problem, &off);
                assert!(left_out.is_empty() && same == simulator, "{}", entry.name);
                let soft = backend
                    .capabilities()
                    .contains(Capabilities::CONTACT_STIFFNESS);
                for (part, ranges) in &parts {
                    let (readings, left_out) = episode(&*backend, problem, ranges);
                    if *part == "contact softness" && !soft {
                        assert!(left_out[0].starts_with(part), "{left_out:?}");
                        assert_eq!(readings, simulator);
                    } else {
                        assert!(left_out.is_empty(), "{}: {left_out:?}", entry.name);
                        assert!(
                            readings != simulator,
                            "{part} does nothing on {}",
                            entry.name
                        );
                    }
                }
            },
        );
    }
}

fn run(place: &Workplace, arguments: &[&str]) -> std::process::Output {
    place.run(&tiny(&[&["run"], arguments].concat()))
}

fn result(place: &Workplace, folder: &str) -> Value {
    serde_json::from_str(&place.read(&format!("{folder}/result.json"))).unwrap()
}

#[test]
fn a_run_says_which_world_it_was_in_and_its_config_repeats_it() {
    let place = Workplace::new();
    let done = |arguments: &[&str]| {
        let output = run(&place, arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {error}");
    };
    let rod = "rod-balancing";
    done(&[rod, "--world", "perturbed", "--seed", "3", "--out", "a"]);
    done(&[rod, "--config", "a/config.toml", "--out", "b"]);
    let [a, b] = ["a", "b"].map(|folder| result(&place, folder));
    assert_eq!(a["real"]["world"], "perturbed");
    let drawn = &a["real"]["perturbation"];
    assert!(drawn["tracker"]["latency"].is_number() && drawn["mass"]["rod"].is_number());
    assert_eq!(a["real"], b["real"]);
    assert_eq!(place.read("a/real.csv"), place.read("b/real.csv"));
    assert_eq!(place.read("a/config.toml"), place.read("b/config.toml"));
    assert!(place.read("a/report.html").contains("tracker late by"));

    // The truth and the initial pose of a seed are the same in every world and for every method.
    done(&[
        rod,
        "--seed",
        "3",
        "--set",
        "explorer.std=0.3",
        "--set",
        "identifier.reps.epsilon=0.4",
        "--out",
        "c",
    ]);
    done(&[rod, "--world", "stand-in", "--seed", "3", "--out", "d"]);
    let [c, d] = ["c", "d"].map(|folder| result(&place, folder));
    assert_eq!(c["real"]["world"], "matched");
    assert_eq!(d["real"]["world"], "stand-in");
    for other in [&c, &d] {
        assert_eq!(a["parameters"][0]["truth"], other["parameters"][0]["truth"]);
    }
    let first = |folder: &str| {
        let log = place.read(&format!("{folder}/real.csv"));
        let [head, row] = [0, 1].map(|k| log.lines().nth(k).unwrap().to_owned());
        let at = head.split(',').position(|c| c == "rod_pos.0").unwrap();
        row.split(',').nth(at).unwrap().to_owned()
    };
    // The other rod's first reading is bitwise the same: initial pose and noise belong to the
    // world.
    assert_eq!(first("c"), first("d"));
    assert_ne!(
        first("a"),
        first("c"),
        "the tracker of a perturbed world is off"
    );
}

#[test]
fn worlds_that_cannot_be_are_refused() {
    let place = Workplace::new();
    let engines = all::<BackendEntry>().len();
    let own = ["--backend", "rapier"];
    for (task, options, expected) in [
        ("rod-balancing", vec!["--world", "perturbd"], "`perturbed`"),
        (
            "sphere-striking",
            vec!["--world", "stand-in"],
            "no other object",
        ),
        (
            "rod-balancing",
            vec!["--world", "crossed", "--real-backend", "rapier"],
            "another engine",
        ),
        (
            "rod-balancing",
            vec![
                "--world",
                "matched",
                "--real-effect",
                "gravity-tilt:pitch=0.1",
            ],
            "the simulator itself",
        ),
        (
            "rod-balancing",
            vec![
                "--world",
                "perturbed",
                "--set",
                "real.perturbation.mass=[2,1]",
            ],
            "real.perturbation.mass",
        ),
        (
            "rod-balancing",
            vec!["--set", "real.perturbation.weight=[2,1]"],
            "weight",
        ),
    ] {
        let arguments = [&[task][..], &own, &options, &["--out", "out"]].concat();
        let output = run(&place, &arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{options:?}: {error}");
        assert!(
            error.contains(expected) && error.lines().count() == 1,
            "{options:?}: {error}"
        );
        assert!(place.names().is_empty(), "{options:?} left something");
    }
    let output = run(
        &place,
        &[
            "rod-balancing",
            "--backend",
            "rapier",
            "--world",
            "crossed",
            "--out",
            "x",
        ],
    );
    if engines == 2 {
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let real = &result(&place, "x")["real"];
        assert_eq!(real["world"], "crossed");
        assert_ne!(real["backend"], "rapier");
    } else {
        assert!(String::from_utf8_lossy(&output.stderr).contains("--real-backend"));
    }
}

/// Cost of starting: an arm's controller with and without parsing the document, and a small batch
/// with threads.
///
/// The times are printed, as they depend on the machine:
/// `cargo test --test worlds beginning -- --nocapture`.
#[test]
fn beginning_costs_no_parsing() {
    const TIMES: u32 = 50;
    let task = task("rod-balancing");
    let attempt = |scene: &asid::core::Scene| {
        let home = [0.0, 0.25, 0.0, -2.9, 0.0, 3.2, 0.785];
        let settings = asid::mjcf::cartesian::CartesianSettings::default();
        asid::mjcf::cartesian::CartesianController::new(scene, "ee", &home, settings).unwrap()
    };
    // The minimum of many: other load on the machine makes single times longer, never shorter.
    let time = |work: &mut dyn FnMut()| {
        let once = |_| {
            let clock = std::time::Instant::now();
            work();
            clock.elapsed().as_secs_f64()
        };
        (0..TIMES).map(once).fold(f64::INFINITY, f64::min)
    };
    let kept = task.scene();
    let parsed = time(&mut || {
        // Another folder discards the parsed document.
        attempt(&kept.clone().in_directory(None));
    });
    let remembered = time(&mut || {
        attempt(kept);
    });
    println!(
        "a controller: {:.3} ms with parsing, {:.4} ms without, ratio {:.0}",
        1e3 * parsed,
        1e3 * remembered,
        parsed / remembered
    );
    // Two parses compared with none: far more than ten times as fast on any machine.
    assert!(
        remembered * 10.0 < parsed,
        "{remembered} s against {parsed} s"
    );
    for entry in all::<BackendEntry>() {
        let model = (entry.make)().unwrap().load(kept).unwrap();
        let begin = |threads| {
            let config = asid::core::BatchConfig {
                size: 2,
                threads,
                targets: Vec::new(),
            };
            model.simulator(&config).unwrap();
        };
        begin(2);
        let [one, two] = [1, 2].map(|threads| time(&mut || begin(threads)));
        println!(
            "a batch of 2 on {}: {:.3} ms with one thread, {:.3} ms with two",
            entry.name,
            1e3 * one,
            1e3 * two
        );
    }
}
