//! Placing a simulation within an episode: a filter and a delay keep what they remember.

#![allow(clippy::unwrap_used)]

mod common;

use common::*;

const SLIDE: &str = r#"<mujoco><option timestep="0.001" gravity="0 0 0"/>
  <worldbody><body><joint name="x" type="slide" axis="1 0 0" damping="1"/><geom size="0.1" mass="1"/></body></worldbody>
  <actuator><position name="servo" joint="x" kp="50" kv="5" timeconst="0.05" delay="0.02" nsample="30" interp="linear"/></actuator>
</mujoco>"#;

/// A simulation that is placed where it stands goes on as if nothing had happened. One whose state
/// is set begins with a drive that has settled on the next command.
#[test]
fn a_displaced_simulation_keeps_what_its_drives_remember() {
    let model = load(SLIDE);
    assert!(model.remembers_commands());
    let memory = r#" timeconst="0.05" delay="0.02" nsample="30" interp="linear""#;
    assert!(!load(&SLIDE.replace(memory, "")).remembers_commands());
    let record = recording(&model, &["qpos.x", "qvel.x"]);
    let mut simulator = batch(&model, 3, 1, &[]);
    let commands = |from: usize| -> Vec<f64> {
        let wave = |k: usize| (0.1 * (from + k) as f64).sin();
        (0..60).map(wave).collect()
    };
    roll(&mut simulator, 60, 1, &commands(0), &record);
    let mut state = vec![0.0; 6];
    simulator.read(&[0, 1, 2], &record, &mut state).unwrap();
    let (q, v) = (state[0], state[1]);
    simulator.displace(&[1], &[q], &[v]).unwrap();
    simulator.set_state(&[2], &[q], &[v]).unwrap();
    let after = roll(&mut simulator, 60, 1, &commands(60), &record);
    let row = |sim: usize| &after[sim * 120..(sim + 1) * 120];
    let apart = |sim: usize| {
        let pairs = row(0).iter().zip(row(sim));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(apart(1) < 1e-12, "{}", apart(1));
    assert!(apart(2) > 1e-2, "{}", apart(2));
}
