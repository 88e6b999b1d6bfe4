//! An arm whose elbow begins at its stop. One encoder is filtered, and the logs do not give their
//! initial states.

use std::fmt::Write as _;
use std::path::Path;

use super::one_joint::normal;
use super::played::Player;
use super::rows::{write_episode, write_model};
use super::{assert_names, has_contacts, run_on};

/// Rows of a log, time between them and time step, s, and standard deviation of a reading, rad.
const ROWS: usize = 400;
const ROW: f64 = 0.005;
const STEP: f64 = 0.001;
const NOISE: f64 = 3e-3;
/// Number of logs; two of them are held out.
const EPISODES: u32 = 6;
/// Time constant of the elbow's encoder, s.
const FILTER: f64 = 0.04;

/// Two links in a plane, driven by motors.
const ARM: &str = r#"<mujoco model="arm"><compiler angle="radian"/><option timestep="0.001" gravity="0 0 0"/>
  <worldbody><body name="upper"><joint name="shoulder" type="hinge" axis="0 0 1" damping="0.1" armature="0.04"/>
    <geom name="upper" type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="1" contype="0" conaffinity="0"/>
    <body name="fore" pos="0.4 0 0"><joint name="elbow" type="hinge" axis="0 0 1" damping="0.1" armature="0.04" range="-2.3 0" limited="true"/>
      <geom name="fore" type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="0.6" contype="0" conaffinity="0"/></body></body></worldbody>
  <actuator><motor name="m_shoulder" joint="shoulder"/><motor name="m_elbow" joint="elbow"/></actuator>
  <sensor><jointpos name="q_shoulder" joint="shoulder"/><jointpos name="q_elbow" joint="elbow"/></sensor>
</mujoco>"#;

/// Torques of a log at a time, N m.
fn torques(episode: u32, time: f64) -> [f64; 2] {
    let k = f64::from(episode);
    let wave = |pace: f64, phase: f64| (std::f64::consts::TAU * pace * time + phase).sin();
    let shoulder = 0.9 * wave(0.7 + 0.1 * k, k) + 0.4 * wave(1.9, 2.0 * k);
    let elbow = 0.5 * wave(0.9 - 0.05 * k, 0.7 * k) + 0.3 * wave(2.3, k);
    [shoulder, elbow]
}

/// Returns the output of a first-order filter for `values`, one per row.
///
/// The values are linear between rows. The filter begins in steady state at the first value.
fn filtered(values: &[f64], time_constant: f64) -> Vec<f64> {
    let mut out = vec![values[0]];
    let keeps = (-ROW / time_constant).exp();
    for pair in values.windows(2) {
        let lag = (pair[1] - pair[0]) / ROW * time_constant;
        let behind = out[out.len() - 1] - pair[0] + lag;
        out.push(pair[1] - lag + behind * keeps);
    }
    out
}

fn write_study(folder: &Path) {
    let mut player = Player::of(ARM, &["q_shoulder", "q_elbow"], [ROW, STEP]);
    for episode in 0..EPISODES {
        let mut noise = normal(50 + u64::from(episode));
        let rows = (0..ROWS).map(|k| torques(episode, ROW * k as f64));
        let commands: Vec<[f64; 2]> = rows.collect();
        let start = [0.1, -0.02 * f64::from(episode)];
        let applied = &commands.as_flattened()[..2 * (ROWS - 1)];
        let places = player.play((&start, &[0.0; 2]), applied, ROWS);
        let elbow: Vec<f64> = places.chunks_exact(2).map(|q| q[1]).collect();
        let elbow = filtered(&elbow, FILTER);
        let mut text = "time,ctrl.m_shoulder,ctrl.m_elbow,q_shoulder,q_elbow\n".to_owned();
        for (k, [shoulder, torque]) in commands.iter().enumerate() {
            let read = [places[2 * k], elbow[k]].map(|q| q + NOISE * noise());
            let time = ROW * k as f64;
            writeln!(
                text,
                "{time:.3},{shoulder},{torque},{},{}",
                read[0], read[1]
            )
            .unwrap();
        }
        write_episode(folder, (episode as usize, EPISODES as usize - 2), &text);
    }
    write_model(folder, ARM);
}

/// At the stop the derivatives change from step to step, so the fit without effects ends before its
/// optimum.
///
/// Any first set then seems to earn evidence that comes from a better trajectory. The derivative
/// promises a hundredth of the filter's evidence.
#[test]
fn a_filter_is_found_though_slopes_at_a_stop_promise_little() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["sensor-filter@q_elbow"]);
    let found = r.effects[0].parameters["time_constant"];
    assert!((found / FILTER - 1.0).abs() < 0.03, "{found}");
}
