//! The shuffleboard's physics on every built-in engine.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // what each engine gives is printed

#[allow(dead_code)] // not every test needs all of it
mod task_support;

use asid::core::registry::{TaskEntry, find};
use asid::core::{Control, Policy, Problem, RealWorld, Rollout, Task};
use asid::worlds::SimulatedWorld;

/// Radius of the puck, m.
const RADIUS: f64 = 0.0381;
const G: f64 = 9.81;

/// Calls `check` with a problem for each engine.
fn on_every_engine(check: impl Fn(&str, &Problem<'_>)) {
    task_support::on_every_engine("shuffleboard", 0, check);
}

/// Final position and rotation of a puck far from the hand, thrown with a velocity along x, m/s,
/// and a spin, rad/s.
///
/// Returns one row of x, m, and rotation, rad, per row of unknowns.
fn throw(problem: &Problem<'_>, theta: &[[f64; 2]], velocity: f64, spin: f64) -> Vec<[f64; 2]> {
    const FRAMES: usize = 500;
    let layout = problem.model.layout();
    let n = theta.len();
    let sims: Vec<usize> = (0..n).collect();
    let mut batch = problem.batch(n).unwrap();
    batch.set_parameters(&sims, &theta.concat()).unwrap();
    batch.simulator.reset(&sims).unwrap();
    let key = &layout.keyframes[0];
    let mut qpos = key.qpos.clone();
    problem
        .task
        .place(layout, &[0.6, 0.0, 0.0], &mut qpos)
        .unwrap();
    let mut qvel = key.qvel.clone();
    let at = layout.joint("puck_free").unwrap().qvel;
    qvel[at] = velocity;
    qvel[at + 5] = spin;
    batch
        .simulator
        .set_state(&sims, &qpos.repeat(n), &qvel.repeat(n))
        .unwrap();
    let recording = layout.recording(&["puck_pos", "puck_quat"]).unwrap();
    let mut out = vec![0.0; n * FRAMES * 7];
    let still = key.ctrl.repeat(FRAMES);
    let rollout = Rollout::new(
        &sims,
        FRAMES,
        problem.substeps(0.01).unwrap(),
        Control::Shared(&still),
        &recording,
    );
    batch.simulator.rollout(&rollout, &mut out).unwrap();
    out.chunks_exact(FRAMES * 7)
        .map(|rows| {
            let yaws = rows
                .chunks_exact(7)
                .map(|r| asid::core::signal::yaw(&r[3..7]));
            let (mut turned, mut last) = (0.0, 0.0);
            for yaw in yaws {
                let step: f64 = yaw - last;
                turned += (step + 3.0 * std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                    - std::f64::consts::PI;
                last = yaw;
            }
            [rows[(FRAMES - 1) * 7] - 0.6, turned]
        })
        .collect()
}

#[test]
fn the_puck_slides_as_far_as_its_friction_says() {
    on_every_engine(|engine, problem| {
        let theta = [0.01, 0.02, 0.035].map(|mu| [mu, 1e-3]);
        for (way, [mu, _]) in throw(problem, &theta, 0.3, 0.0).iter().zip(theta) {
            let expected = 0.3 * 0.3 / (2.0 * mu * G);
            assert!(
                (way[0] / expected - 1.0).abs() < 0.03,
                "{engine}, friction {mu}: {} against {expected}",
                way[0]
            );
        }
    });
}

#[test]
fn torsional_friction_shortens_the_spin_of_the_puck() {
    on_every_engine(|engine, problem| {
        let mu = 0.02;
        let torsional = [5e-4, 1.5e-3, 5e-3];
        let spin = 10.0;
        let turns: Vec<f64> = throw(problem, &torsional.map(|t| [mu, t]), 0.0, spin)
            .iter()
            .map(|row| row[1])
            .collect();
        assert!(
            turns.windows(2).all(|w| w[1] < 0.8 * w[0]),
            "{engine}: {turns:?}"
        );
        // The puck rests on its rim, whose friction has the radius as its lever arm. If the two
        // bounds are independent, the torques add; if a contact has one cone, their squares add.
        let angle = |torque: f64| spin * spin * RADIUS * RADIUS / (4.0 * G * torque);
        for (turn, t) in turns.iter().zip(torsional) {
            let rim = mu * RADIUS;
            let (low, high) = (angle(rim + t), angle(rim.hypot(t)));
            println!(
                "{engine}, torsional friction {t} m: {turn:.2} rad, theory {low:.2} to {high:.2} rad"
            );
            assert!(
                (0.9 * low..1.1 * high).contains(turn),
                "{engine}, torsional friction {t}: {turn} rad, not {low} to {high}"
            );
        }
    });
}

/// A hand at rest.
struct Still;

impl Policy for Still {
    fn reset(&mut self) {}

    fn act(
        &mut self,
        _step: usize,
        _reading: &[f64],
        action: &mut [f64],
    ) -> asid::core::Result<()> {
        action.fill(0.0);
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

#[test]
fn the_real_board_wears_with_each_shot() {
    on_every_engine(|engine, problem| {
        let truth = [0.02, 1e-3];
        let mut world = SimulatedWorld::new(
            problem.task,
            problem.model,
            problem.parameters,
            &truth,
            problem.signals,
            problem.streams,
        )
        .unwrap();
        let mut before = truth.to_vec();
        for _ in 0..2 {
            world.explore(&mut Still).unwrap();
            for (a, b) in before.iter().zip(world.truth()) {
                assert!((1.0..=1.06).contains(&(b / a)), "{engine}: {a} to {b}");
            }
            assert_ne!(before, world.truth());
            before = world.truth().to_vec();
        }
    });
}

#[test]
fn each_condition_has_its_own_zone() {
    let task = (find::<TaskEntry>("shuffleboard").unwrap().make)().unwrap();
    let zones: Vec<Box<dyn Task>> = task
        .conditions()
        .iter()
        .map(|c| task.under(&c.name).unwrap().unwrap())
        .collect();
    let rest = |x: f64| [x, 0.0, 0.012, x, 0.0, 0.012];
    let scores: Vec<[bool; 2]> = zones
        .iter()
        .map(|zone| [0.8, 1.05].map(|x| zone.outcome(&rest(x)).success))
        .collect();
    assert_eq!(scores, [[true, false], [false, true]]);
}

/// The difficulty sets the wear of the board per shot, under each condition.
#[test]
fn a_board_wears_as_much_as_its_difficulty_says() {
    let task = task_support::task("shuffleboard");
    for wear in [0.0, 0.2] {
        let set = [("wear".to_owned(), wear), ("zone_length".to_owned(), 0.1)].into();
        let task = task.adjusted(&set).unwrap().unwrap();
        let far = task.under("far").unwrap().unwrap();
        assert_eq!(far.downstream().threshold, Some(0.05));
        let mut rng = asid::core::Streams::new(1).stream("wear");
        let mut largest: f64 = 0.0;
        for _ in 0..200 {
            let mut truth = vec![0.02, 1e-3];
            far.wear(&far.parameters(), &mut truth, &mut rng);
            largest = largest.max(truth[0] / 0.02 - 1.0);
        }
        assert!(largest <= wear && largest >= 0.9 * wear, "{largest}");
    }
}
