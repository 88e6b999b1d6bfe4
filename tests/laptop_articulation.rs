//! The laptop's physics on every built-in engine: what identification and the task rely on, without
//! any learning.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // what each engine gives is printed

#[allow(dead_code)] // not every test needs all of it
mod task_support;

use asid::algorithms::fisher::FisherSettings;
use asid::algorithms::identify::articulation::{self, Joint};
use asid::core::episode::ChannelColumns;
use asid::core::registry::{ExplorerEntry, IdentifierEntry, find};
use asid::core::{Control, Episode, Problem, RealWorld, Rollout, Streams};
use asid::pipeline::episode_information;
use asid::readings::SignalSet;
use asid::worlds::SimulatedWorld;
use rand::Rng as _;

/// Calls `check` with a problem for each engine.
fn on_every_engine(check: impl Fn(&str, &Problem<'_>)) {
    task_support::on_every_engine("laptop-articulation", 0, check);
}

/// Readings of attempts with these (articulated, offset, reach), from the middle of the start
/// range.
fn attempts(problem: &Problem<'_>, cases: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let protocol = problem.task.downstream();
    let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
    let sims: Vec<usize> = (0..cases.len()).collect();
    let mut batch = problem.batch(cases.len()).unwrap();
    let theta: Vec<f64> = cases.iter().flat_map(|c| [c[0], c[1]]).collect();
    batch.set_parameters(&sims, &theta).unwrap();
    batch
        .place(problem.task, &sims, &start.repeat(cases.len()))
        .unwrap();
    let control: Vec<f64> = cases
        .iter()
        .flat_map(|c| problem.task.attempt(&start, &c[2..]).unwrap())
        .collect();
    let recording = problem
        .model
        .layout()
        .recording(&protocol.channels)
        .unwrap();
    let mut out = vec![0.0; cases.len() * protocol.frames * recording.width()];
    let substeps = problem.substeps(protocol.frame_period).unwrap();
    let rollout = Rollout::new(
        &sims,
        protocol.frames,
        substeps,
        Control::PerSimulation(&control),
        &recording,
    );
    batch.simulator.rollout(&rollout, &mut out).unwrap();
    out.chunks_exact(protocol.frames * recording.width())
        .map(<[f64]>::to_vec)
        .collect()
}

/// The base's pose in the plane and the lid's angle at the end.
fn end(problem: &Problem<'_>, readings: &[f64]) -> Vec<f64> {
    problem.task.locate(&readings[readings.len() - 14..])
}

/// A log that has only readings.
fn log(problem: &Problem<'_>, readings: &[f64]) -> Episode {
    Episode {
        time: (0..readings.len() / 14).map(|k| k as f64 * 0.02).collect(),
        channels: (problem.signals.iter())
            .map(|s| ChannelColumns {
                name: s.sensor.clone(),
                len: problem.model.layout().sensor(&s.sensor).unwrap().len,
            })
            .collect(),
        readings: readings.to_vec(),
        ..Episode::default()
    }
}

#[test]
fn the_hand_that_closes_the_lid_must_know_the_axis_and_cannot_move_a_rigid_one() {
    on_every_engine(|engine, problem| {
        // By geometry: the same line of contact, rotated about an axis 20 mm lower or higher.
        let good = [[1.0, -0.02, 0.087], [1.0, 0.0, 0.06], [1.0, 0.02, 0.036]];
        let readings = attempts(problem, &[good, good.map(|c| [0.0, c[1], c[2]])].concat());
        for (case, r) in good.iter().zip(&readings[..3]) {
            let outcome = problem.task.outcome(r);
            assert!(outcome.success, "{engine} {case:?}: {outcome:?}");
            // 0.3 N m at 0.1 m is 3 N; friction holds the base up to 12 N.
            let base = end(problem, r);
            assert!((base[0] - 0.6).abs() < 0.003, "{engine} {case:?}: {base:?}");
            let found = articulation::of_episodes(
                problem.task,
                problem.model.layout(),
                problem.signals,
                &[log(problem, r)],
            );
            let found = found.unwrap().unwrap();
            assert_eq!(found.joint, Joint::Revolute, "{engine}");
            let (axis, origin) = (found.axis.unwrap(), found.origin.unwrap());
            assert!(axis[0].abs() > 0.9999, "{engine}: {axis:?}");
            let off = (origin[1] - 0.1).hypot(origin[2] - 0.015 - case[1]);
            assert!(off < 0.001, "{engine} {case:?}: {origin:?}");
        }
        for (case, r) in good.iter().zip(&readings[3..]) {
            let (last, outcome) = (end(problem, r), problem.task.outcome(r));
            // The laptop is pushed as a whole, as far as the hand moves. Dry friction lets the lid
            // creep by less than the noise of one reading, 10 mrad.
            assert!(last[0] > 0.66, "{engine} {case:?}: {last:?}");
            assert!((last[3] - 1.8).abs() < 0.01, "{engine} {case:?}: {last:?}");
            assert!(!outcome.success);
        }
    });
}

#[test]
fn the_parts_at_rest_tell_neither_the_joint_nor_its_axis() {
    on_every_engine(|engine, problem| {
        let protocol = problem.task.exploration();
        let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
        let actions = vec![0.0; 5 * protocol.action.len()];
        let settings = FisherSettings::default();
        for articulated in [0.0, 1.0] {
            let theta = [articulated, 0.0];
            let told = episode_information(problem, &settings, &theta, &start, &actions).unwrap();
            for (before, after) in told.expected_std[0].iter().zip(&told.expected_std[5]) {
                assert!(*after > 0.99 * before, "{engine}: {before} to {after}");
            }
        }
    });
}

#[test]
fn start_poses_are_located_from_what_is_placed() {
    on_every_engine(|engine, problem| {
        let recording = (problem.model.layout())
            .recording(&problem.task.downstream().channels)
            .unwrap();
        let mut batch = problem.batch(1).unwrap();
        for u in [0.02, 0.5, 0.98] {
            let start: Vec<f64> = (problem.task.exploration().start.iter())
                .map(|c| c.at(u))
                .collect();
            let offset = problem.parameters[1].from_unit(u);
            batch.set_parameters(&[0], &[1.0, offset]).unwrap();
            batch.place(problem.task, &[0], &start).unwrap();
            let mut row = vec![0.0; recording.width()];
            batch.simulator.read(&[0], &recording, &mut row).unwrap();
            for (a, b) in problem.task.locate(&row).iter().zip(&start) {
                assert!((a - b).abs() < 1e-5, "{engine}: {a} {b}");
            }
        }
    });
}

#[test]
fn an_episode_without_contact_leaves_the_question_open() {
    on_every_engine(|engine, problem| {
        let layout = problem.model.layout();
        let start: Vec<f64> = (problem.task.exploration().start.iter())
            .map(|c| c.center())
            .collect();
        let names: Vec<String> = problem.signals.iter().map(|s| s.sensor.clone()).collect();
        let recording = layout.recording(&names).unwrap();
        let mut batch = problem.batch(1).unwrap();
        batch.set_parameters(&[0], &[1.0, 0.01]).unwrap();
        batch.place(problem.task, &[0], &start).unwrap();
        let mut row = vec![0.0; recording.width()];
        batch.simulator.read(&[0], &recording, &mut row).unwrap();
        // A few noisy readings of a laptop that nobody touches.
        let signals = SignalSet::new(layout, problem.signals).unwrap();
        let mut rng = problem.streams.stream("noise");
        let readings: Vec<f64> = (0..6)
            .flat_map(|_| {
                let mut seen = row.clone();
                signals.add_noise(&mut seen, || 12.0_f64.sqrt() * (rng.random::<f64>() - 0.5));
                seen
            })
            .collect();
        let episode = Episode {
            actuators: layout.actuators.iter().map(|a| a.name.clone()).collect(),
            ctrl: layout.keyframes[0].ctrl.repeat(6),
            ..log(problem, &readings)
        };
        let settings = "population = 16\niterations = 3".parse().unwrap();
        let identifier = (find::<IdentifierEntry>("reps").unwrap().make)(&settings).unwrap();
        let found = identifier.identify(problem, &[episode]).unwrap();
        // Even odds, up to the uncertainty of 1000 samples of the Metropolis walks.
        let [articulated, offset] = &found.posterior.marginals[..] else {
            panic!("two unknowns");
        };
        let p = articulated.estimate;
        assert!((0.3..0.7).contains(&p), "{engine}: {p}");
        assert!(offset.std > 0.009, "{engine}: {offset:?}");
    });
}

/// Interaction is the hand's contact with the lid. That of a random explorer is counted like any
/// other's: it touches the lid in some episodes and misses it in most.
#[test]
fn interaction_of_random_motion_with_the_lid_can_be_counted() {
    const EPISODES: u64 = 12;
    let entry = find::<ExplorerEntry>("random").unwrap();
    let explorer = (entry.make)(&(entry.defaults)()).unwrap();
    on_every_engine(|engine, problem| {
        let mut interacted = 0;
        for seed in 0..EPISODES {
            let problem = Problem {
                streams: Streams::new(seed),
                ..*problem
            };
            let mut explored = explorer.explore(&problem, None).unwrap();
            let mut world = SimulatedWorld::new(
                problem.task,
                problem.model,
                problem.parameters,
                &[1.0, 0.0],
                problem.signals,
                problem.streams.child("real world"),
            )
            .unwrap();
            let real = world.explore(&mut *explored.policy).unwrap();
            // Contact of base and lid separately; the lid's is the task's.
            assert_eq!(real.touched.len(), 2);
            assert_eq!(real.contact_fraction, real.touched[1]);
            interacted += u64::from(real.contact_fraction > 0.0);
        }
        println!("{engine}: {interacted} of {EPISODES} episodes");
        assert!(
            (1..EPISODES).contains(&interacted),
            "{engine}: {interacted}"
        );
    });
}
