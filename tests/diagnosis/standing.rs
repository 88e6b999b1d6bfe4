//! A machine that stands on the ground, while its document places it slightly above. No log gives
//! the initial state, and no sensor reads its position.

use std::fmt::Write as _;
use std::path::Path;

use asid::diagnosis::result::Kind;

use super::one_joint::normal;
use super::played::Player;
use super::rows::{write_episode, write_model};
use super::{has_contacts, run_on};

/// Rows of a log, rows at rest before it, time between rows and time step, s.
const ROWS: usize = 150;
const BEFORE: usize = 100;
const ROW: f64 = 0.01;
const STEP: f64 = 0.002;
/// Standard deviations of the readings of acceleration, m/s², and height, m.
const NOISE: [f64; 2] = [0.03, 2e-4];

/// A box on the ground, in which a servo moves a mass up and down.
const SCENE: &str = r#"<mujoco model="box"><option timestep="0.002"/><worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <body pos="0 0 0.055"><freejoint name="base"/><geom type="box" size="0.15 0.15 0.05" mass="4"/><site name="imu"/>
      <body><joint name="lift" type="slide" axis="0 0 1" damping="2"/>
        <geom type="sphere" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body></body></worldbody>
    <actuator><position name="servo" joint="lift" kp="300" kv="10"/></actuator>
    <sensor><accelerometer name="acc" site="imu"/><jointpos name="height" joint="lift"/></sensor></mujoco>"#;

fn write_study(folder: &Path) {
    let mut player = Player::of(SCENE, &["acc", "height"], [ROW, STEP]);
    for episode in 0..4_u32 {
        let mut noise = normal(110 + u64::from(episode));
        let wave = |time: f64| 0.03 * (time * (6.0 + 2.0 * f64::from(episode))).sin();
        let rows = BEFORE + ROWS;
        let command = |k: usize| wave(ROW * k.saturating_sub(BEFORE) as f64);
        let commands: Vec<f64> = (0..rows).map(command).collect();
        let mut start = vec![0.0; 8];
        (start[2], start[3]) = (0.055, 1.0);
        let played = player.play((&start, &[0.0; 7]), &commands[..rows - 1], rows);
        let mut text = "time,ctrl.servo,acc.0,acc.1,acc.2,height".to_owned();
        for (k, row) in played.chunks_exact(4).enumerate().skip(BEFORE) {
            write!(text, "\n{:.2},{}", ROW * (k - BEFORE) as f64, commands[k]).unwrap();
            let deviations = [NOISE[0], NOISE[0], NOISE[0], NOISE[1]];
            for (reading, deviation) in row.iter().zip(deviations) {
                write!(text, ",{}", reading + deviation * noise()).unwrap();
            }
        }
        text.push('\n');
        write_episode(folder, (episode as usize, 3), &text);
    }
    write_model(folder, SCENE);
}

/// From 5 mm above the ground the model falls, and its accelerometer reads zero for 30 ms. Only the
/// document causes this initial height.
#[test]
fn a_machine_that_stands_lacks_nothing() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let result = run_on(folder.path(), &[]).0.result;
    assert_eq!(result.verdict.kind, Kind::None, "{}", result.sentence);
    assert!(result.gap.nominal < 1.2, "{}", result.gap.nominal);
}
