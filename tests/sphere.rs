//! Physics of the tasks with a ball, on every built-in engine.
//!
//! Rolling friction stops the ball where theory says, on each patch. The softness of the paddle's
//! contact changes the outcome.
//!
//! `cargo test --features mujoco --test sphere -- --nocapture` prints the results of each engine.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a skipped check is a printed row

#[allow(dead_code)] // not every test needs all of it
mod task_support;

use asid::algorithms::fisher::FisherSettings;
use asid::core::registry::{BackendEntry, TaskEntry, all, find};
use asid::core::{Capabilities, Control, Parameter, Policy, Problem, RealWorld, Rollout};
use asid::pipeline::episode_information;
use asid::worlds::SimulatedWorld;
use task_support::visits;

const RADIUS: f64 = 0.03;
const G: f64 = 9.81;

/// Calls `check` with a problem for each engine that supports what the task and `parameters` need.
fn on_every_engine(
    task: &str,
    optional: &str,
    needs: Capabilities,
    check: impl Fn(&str, &Problem<'_>),
) {
    let task = (find::<TaskEntry>(task).unwrap().make)().unwrap();
    let mut parameters: Vec<Parameter> = task.parameters();
    let optional = task
        .optional_parameters()
        .into_iter()
        .filter(|p| p.name == optional);
    parameters.extend(optional);
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        if !backend
            .capabilities()
            .contains(task.spec().requires | needs)
        {
            println!("{}: not claimed", entry.name);
            continue;
        }
        task_support::on_engine(&*backend, &*task, &parameters, 0, |problem, _| {
            check(entry.name, problem);
        });
    }
}

/// Rolling distance of a ball that starts at `from` (m) with `speed` along y (m/s), for each row of
/// unknowns.
fn roll_out(problem: &Problem<'_>, from: [f64; 2], speed: f64, unknowns: &[Vec<f64>]) -> Vec<f64> {
    let layout = problem.model.layout();
    let n = unknowns.len();
    let sims: Vec<usize> = (0..n).collect();
    let mut batch = problem.batch(n).unwrap();
    batch.set_parameters(&sims, &unknowns.concat()).unwrap();
    batch.place(problem.task, &sims, &from.repeat(n)).unwrap();
    let home = asid::core::problem::home(layout);
    let ball = layout.joint("ball_free").unwrap().clone();
    let mut qpos = home.0.clone();
    problem.task.place(layout, &from, &mut qpos).unwrap();
    let ctrl = layout.keyframes[0].ctrl.clone();
    let recording = layout.recording(&["ball_pos"]).unwrap();
    let run = |batch: &mut asid::core::problem::Batch, frames: usize| {
        let mut out = vec![0.0; n * frames * 3];
        let commands = ctrl.repeat(frames);
        let rollout = Rollout::new(&sims, frames, 10, Control::Shared(&commands), &recording);
        batch.simulator.rollout(&rollout, &mut out).unwrap();
        out
    };
    // The ball first settles at the height that the floor's softness gives, and then rolls.
    let settled = run(&mut batch, 20);
    qpos[ball.qpos + 2] = settled[settled.len() - 1];
    let mut qvel = home.1.clone();
    qvel[ball.qvel + 1] = speed;
    qvel[ball.qvel + 3] = -speed / RADIUS;
    batch
        .simulator
        .set_state(&sims, &qpos.repeat(n), &qvel.repeat(n))
        .unwrap();
    run(&mut batch, 150)
        .chunks_exact(150 * 3)
        .map(|rows| (rows[149 * 3 + 1] - from[1]).abs())
        .collect()
}

/// Distance of a solid ball of radius r, which decelerates by 5/7 mu g / r.
fn theory(speed: f64, friction: f64) -> f64 {
    speed * speed / (2.0 * 5.0 / 7.0 * friction * G / RADIUS)
}

#[test]
fn rolling_friction_stops_the_ball_where_theory_says() {
    for task in ["sphere-striking", "sphere-free", "sphere-distractors"] {
        on_every_engine(task, "", Capabilities::empty(), |engine, problem| {
            let frictions = [1e-3, 2e-3, 3.5e-3, 5e-3, 6e-3];
            let unknowns: Vec<Vec<f64>> = frictions.iter().map(|f| vec![*f]).collect();
            let ways = roll_out(problem, [0.6, 0.2], -0.35, &unknowns);
            for (way, friction) in ways.iter().zip(frictions) {
                let expected = theory(0.35, friction);
                let error = way / expected - 1.0;
                println!("{task}, {engine}, {friction} m: {way:.4} m, theory {expected:.4} m");
                // A ball that sinks in by 0.25 mm rolls on a radius 0.8 % smaller.
                assert!(error.abs() < 0.03, "{task}, {engine}, {friction}: {error}");
            }
        });
    }
}

/// Patches into which a ball sinks have a ridge at each seam, which throws a slow ball back.
#[test]
fn a_slow_ball_rolls_over_the_seams() {
    on_every_engine(
        "sphere-patches",
        "",
        Capabilities::empty(),
        |engine, problem| {
            for seam in [0.056, -0.256] {
                let way = roll_out(problem, [0.6, seam + 0.03], -0.1, &[vec![2e-4; 3]])[0];
                let expected = theory(0.1, 2e-4);
                println!("seam at {seam}, {engine}: {way:.4} m, theory {expected:.4} m");
                assert!(
                    (way / expected - 1.0).abs() < 0.1,
                    "{engine}, {seam}: {way}"
                );
            }
        },
    );
}

#[test]
fn each_patch_stops_the_ball_by_its_own_friction() {
    on_every_engine(
        "sphere-patches",
        "",
        Capabilities::empty(),
        |engine, problem| {
            for (patch, y) in [0.26, -0.05, -0.36].into_iter().enumerate() {
                let frictions = [4e-4, 7e-4, 1e-3];
                let unknowns: Vec<Vec<f64>> = frictions
                    .iter()
                    .map(|f| {
                        let mut row = vec![2e-4; 3];
                        row[patch] = *f;
                        row
                    })
                    .collect();
                let ways = roll_out(problem, [0.6, y], -0.15, &unknowns);
                for (way, friction) in ways.iter().zip(frictions) {
                    let expected = theory(0.15, friction);
                    let error = way / expected - 1.0;
                    let number = patch + 1;
                    println!(
                        "patch {number}, {engine}, {friction} m: {way:.4} m, theory {expected:.4} m"
                    );
                    assert!(
                        error.abs() < 0.02,
                        "{engine}, patch {patch}, {friction}: {error}"
                    );
                }
            }
        },
    );
}

#[test]
fn a_ball_at_rest_sinks_into_a_soft_floor_as_its_time_constant_says() {
    on_every_engine(
        "sphere-striking",
        "",
        Capabilities::empty(),
        |engine, problem| {
            let layout = problem.model.layout();
            let mut batch = problem.batch(1).unwrap();
            batch.set_parameters(&[0], &[3e-3]).unwrap();
            batch.place(problem.task, &[0], &[0.6, 0.2]).unwrap();
            let recording = layout.recording(&["ball_pos"]).unwrap();
            let frames = 100;
            let ctrl = layout.keyframes[0].ctrl.repeat(frames);
            let mut out = vec![0.0; frames * 3];
            let rollout = Rollout::new(&[0], frames, 10, Control::Shared(&ctrl), &recording);
            batch.simulator.rollout(&rollout, &mut out).unwrap();
            let sunk = RADIUS - out[out.len() - 1];
            // A critically damped spring and damper with a time constant of 0.02 s, of which the
            // impedance 0.5 acts. The rest of the weight's acceleration passes through.
            let theory = (1.0 - 0.5) * G * 0.02 * 0.02;
            println!(
                "{engine}: sunk in by {:.3} mm, theory {:.3} mm",
                1e3 * sunk,
                1e3 * theory
            );
            if problem
                .capabilities
                .contains(Capabilities::CONTACT_STIFFNESS)
            {
                assert!((sunk / theory - 1.0).abs() < 0.01, "{engine}: {sunk}");
            } else {
                assert!(sunk.abs() < 1e-4, "{engine}: {sunk}");
            }
        },
    );
}

#[test]
fn a_softer_ball_leaves_the_paddle_faster() {
    on_every_engine(
        "sphere-striking",
        "stiffness",
        Capabilities::CONTACT_STIFFNESS,
        |engine, problem| {
            let protocol = problem.task.downstream();
            let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
            let constants = [0.02, 0.06];
            let sims: Vec<usize> = (0..constants.len()).collect();
            let mut batch = problem.batch(constants.len()).unwrap();
            let unknowns: Vec<f64> = constants.iter().flat_map(|c| [5e-3, *c]).collect();
            batch.set_parameters(&sims, &unknowns).unwrap();
            batch
                .place(problem.task, &sims, &start.repeat(constants.len()))
                .unwrap();
            let control = problem.task.attempt(&start, &[0.9, 0.0]).unwrap();
            let recording = problem
                .model
                .layout()
                .recording(&protocol.channels)
                .unwrap();
            let mut out = vec![0.0; constants.len() * protocol.frames * 3];
            let substeps = problem.substeps(protocol.frame_period).unwrap();
            let rollout = Rollout::new(
                &sims,
                protocol.frames,
                substeps,
                Control::Shared(&control),
                &recording,
            );
            batch.simulator.rollout(&rollout, &mut out).unwrap();
            let ends: Vec<f64> = out
                .chunks_exact(protocol.frames * 3)
                .map(|rows| rows[rows.len() - 2])
                .collect();
            println!(
                "{engine}: time constants {constants:?} s, the ball rests at y = {ends:.4?} m"
            );
            // When the paddle stops, the contact's spring returns its energy.
            assert!(ends[0] > ends[1] + 0.005, "{engine}: {ends:?}");
        },
    );
}

/// When the paddle stops, the ball rolls on at the paddle's speed, plus what the contact's spring
/// returns.
#[test]
fn a_struck_ball_rolls_on_as_fast_as_the_paddle() {
    on_every_engine(
        "sphere-striking",
        "",
        Capabilities::empty(),
        |engine, problem| {
            let protocol = problem.task.downstream();
            let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
            let layout = problem.model.layout();
            let recording = layout.recording(&protocol.channels).unwrap();
            let substeps = problem.substeps(protocol.frame_period).unwrap();
            for speed in [0.3, 0.6, 0.9] {
                let mut batch = problem.batch(1).unwrap();
                batch.set_parameters(&[0], &[1e-3]).unwrap();
                batch.place(problem.task, &[0], &start).unwrap();
                let control = problem.task.attempt(&start, &[speed, 0.0]).unwrap();
                let control = Control::Shared(&control);
                let rollout = Rollout::new(&[0], protocol.frames, substeps, control, &recording);
                let mut out = vec![0.0; protocol.frames * 3];
                batch.simulator.rollout(&rollout, &mut out).unwrap();
                let at: Vec<&[f64]> = out.chunks_exact(3).collect();
                let step = |w: &[&[f64]]| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
                let fastest = at.windows(2).map(step).fold(0.0, f64::max) / protocol.frame_period;
                println!("{engine}: struck at {speed} m/s the ball leaves at {fastest:.3} m/s");
                assert!((fastest / speed - 1.0).abs() < 0.05, "{engine}: {fastest}");
            }
        },
    );
}

/// Moves the hand on a straight line towards the first reading of a ball.
struct Towards {
    /// Index of the ball's position in a reading's row, and of the hand's.
    ball: usize,
    hand: usize,
    aim: Option<[f64; 2]>,
}

impl Policy for Towards {
    fn reset(&mut self) {
        self.aim = None;
    }

    fn act(&mut self, _step: usize, reading: &[f64], action: &mut [f64]) -> asid::core::Result<()> {
        let at = |i: usize| [reading[i], reading[i + 1]];
        let aim = *self.aim.get_or_insert_with(|| at(self.ball));
        let hand = at(self.hand);
        for k in 0..2 {
            action[k] = aim[k] - hand[k];
        }
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// Each ball is tracked and its contacts are separate, which shows the explorer's target.
#[test]
fn a_push_at_one_ball_touches_and_moves_it_alone() {
    on_every_engine(
        "sphere-distractors",
        "",
        Capabilities::empty(),
        |engine, problem| {
            let objects = problem.task.objects();
            assert_eq!(objects.len(), 4);
            assert_eq!(problem.signals.len(), 4);
            for pushed in [0, 2] {
                let mut world = SimulatedWorld::new(
                    problem.task,
                    problem.model,
                    problem.parameters,
                    &[3e-3],
                    problem.signals,
                    problem.streams,
                )
                .unwrap()
                .with_exploration_start(vec![0.6, 0.05]);
                let mut policy = Towards {
                    ball: 3 * pushed,
                    hand: 3 * objects.len(),
                    aim: None,
                };
                let real = world.explore(&mut policy).unwrap();
                for (i, object) in objects.iter().enumerate() {
                    let way = visits::displacement(&visits::path(&real.episode, &object.position));
                    let (touched, label) = (real.touched[i], &object.outline.label);
                    println!(
                        "{engine}, at {pushed}: {label} touched {touched:.2}, moved {way:.3} m"
                    );
                    assert_eq!(touched > 0.0, i == pushed, "{engine}, {label}: {touched}");
                    // Unmoved, up to the noise of two readings of 2 mm each.
                    assert_eq!(way > 0.015, i == pushed, "{engine}, {label}: {way}");
                }
                assert_eq!(real.contact_fraction > 0.0, pushed == 0);
            }
        },
    );
}

/// A ball that is struck through all patches covers them; one at rest does not.
#[test]
fn visits_of_the_patches_can_be_counted() {
    let task = (find::<TaskEntry>("sphere-patches").unwrap().make)().unwrap();
    let regions = &task.spec().regions;
    assert_eq!(regions.len(), 3);
    let down: Vec<[f64; 2]> = (0..90)
        .map(|k| [0.5, 0.3 - 0.0085 * f64::from(k)])
        .collect();
    let shares = visits::shares(&down, regions);
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(visits::coverage(&shares) > 0.95, "{shares:?}");
    let still = visits::shares(&[[0.5, 0.2]; 50], regions);
    assert_eq!(visits::coverage(&still), 0.0);
}

/// Expected standard deviations before and after a push at a ball at rest, with all unknowns at
/// their centres.
fn told_by_a_push(problem: &Problem<'_>) -> [Vec<f64>; 2] {
    let start = [0.5, 0.0];
    let theta: Vec<f64> = problem.parameters.iter().map(Parameter::center).collect();
    let mut world = SimulatedWorld::new(
        problem.task,
        problem.model,
        problem.parameters,
        &theta,
        problem.signals,
        problem.streams,
    )
    .unwrap()
    .with_exploration_start(start.to_vec());
    let mut policy = Towards {
        ball: 0,
        hand: 3,
        aim: None,
    };
    let real = world.explore(&mut policy).unwrap();
    let settings = FisherSettings::default();
    let told = episode_information(problem, &settings, &theta, &start, &real.actions).unwrap();
    let last = told.expected_std.last().unwrap().clone();
    [told.expected_std[0].clone(), last]
}

/// The ball's speed after the paddle depends on the contact's stiffness, so a push is informative
/// about the stiffness.
///
/// It is hardly informative about the floor's sliding friction: above 0.5 a pushed ball rolls at
/// once. Neither unknown prevents the rolling friction from being found.
#[test]
fn a_push_tells_the_stiffness_and_hardly_the_sliding_friction() {
    for (unknown, needs, share) in [
        ("sliding_friction", Capabilities::empty(), 0.8..=1.0),
        ("stiffness", Capabilities::CONTACT_STIFFNESS, 0.0..=0.8),
    ] {
        on_every_engine("sphere-striking", unknown, needs, |engine, problem| {
            let [prior, after] = told_by_a_push(problem);
            println!("{engine}, {unknown}: expected deviations {prior:.5?} to {after:.5?}");
            assert!(after[0] < 0.1 * prior[0], "{engine}, {unknown}: {after:?}");
            assert!(
                share.contains(&(after[1] / prior[1])),
                "{engine}, {unknown}: {after:?}"
            );
        });
    }
}
