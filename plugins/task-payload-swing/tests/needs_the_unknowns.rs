//! With knowledge of the unknowns the task can always be solved; no single torque solves it for
//! most of them.

#![allow(clippy::unwrap_used)]

use asid_core::{Backend as _, BatchConfig, Control, Rollout, Task};
use payload_swing::PayloadSwing;

/// Number of torques that are tried, from 0 to the motor's limit.
const TORQUES: usize = 76;

/// For each true value (mass in kg, damping in N m s/rad), which torques succeed.
fn successes(truths: &[[f64; 2]]) -> Vec<Vec<bool>> {
    let task = PayloadSwing::new().unwrap();
    let model = asid_rapier::Rapier.load(task.scene()).unwrap();
    let protocol = task.downstream();
    let config = BatchConfig {
        size: TORQUES,
        threads: 2,
        targets: task
            .parameters()
            .iter()
            .flat_map(|p| p.targets.clone())
            .collect(),
    };
    let mut simulator = model.simulator(&config).unwrap();
    let sims: Vec<usize> = (0..TORQUES).collect();
    let range = &protocol.action[0];
    let commands: Vec<f64> = sims
        .iter()
        .map(|&i| range.at(i as f64 / (TORQUES - 1) as f64))
        .flat_map(|torque| task.attempt(&[0.0], &[torque]).unwrap())
        .collect();
    let recording = model.layout().recording(&protocol.channels).unwrap();
    let substeps = (protocol.frame_period / model.layout().timestep).round() as usize;
    truths
        .iter()
        .map(|truth| {
            simulator.reset(&sims).unwrap();
            simulator
                .set_parameters(&sims, &truth.repeat(TORQUES))
                .unwrap();
            let mut readings = vec![0.0; TORQUES * protocol.frames];
            let control = Control::PerSimulation(&commands);
            let rollout = Rollout::new(&sims, protocol.frames, substeps, control, &recording);
            simulator.rollout(&rollout, &mut readings).unwrap();
            readings
                .chunks_exact(protocol.frames)
                .map(|attempt| task.outcome(attempt).success)
                .collect()
        })
        .collect()
}

#[test]
fn an_oracle_always_succeeds_and_no_single_torque_does() {
    let steps = |low: f64, high: f64| (0..5).map(move |i| low + f64::from(i) / 4.0 * (high - low));
    let truths: Vec<[f64; 2]> = steps(0.2, 1.0)
        .flat_map(|mass| steps(0.01_f64.ln(), 0.1_f64.ln()).map(move |d| [mass, d.exp()]))
        .collect();
    let table = successes(&truths);
    for (truth, row) in truths.iter().zip(&table) {
        assert!(row.contains(&true), "no torque succeeds at {truth:?}");
    }
    let best_blind = (0..TORQUES)
        .map(|i| table.iter().filter(|row| row[i]).count())
        .max()
        .unwrap();
    let share = best_blind as f64 / truths.len() as f64;
    assert!(share < 0.3, "one torque succeeds in {share} of the prior");
}

#[test]
fn the_goal_can_be_set_and_a_name_that_is_unknown_is_refused() {
    let task = PayloadSwing::new().unwrap();
    let set = |name: &str| task.adjusted(&[(name.to_owned(), 0.8)].into());
    let farther = set("goal").unwrap().unwrap();
    assert_eq!(farther.metric(&[0.8, 0.1]), [0.0, 0.0]);
    assert!(farther.outcome(&[0.8]).success && !task.outcome(&[0.8]).success);
    assert!(set("gaol").is_err());
}
