//! A log that begins while an earlier command still acts. No model can predict the drive's force in
//! its first row.

use std::fmt::Write as _;
use std::path::Path;

use asid::core::episode::{ChannelColumns, InitialState};
use asid::core::layout::Sensor;
use asid::core::{Episode, Scene};
use asid::diagnosis::result::Kind;
use asid::readings::first_row::Followers;

use super::one_joint::normal;
use super::played::Player;
use super::rows::{write_episode, write_model};
use super::{engine, has_contacts, run_on};

/// Rows of a log, rows of motion before it, time between rows and time step, s.
const ROWS: usize = 100;
const BEFORE: usize = 10;
const ROW: f64 = 0.01;
const STEP: f64 = 0.002;
/// Standard deviations of the readings of angle, rad, and torque, N m.
const NOISE: [f64; 2] = [1e-3, 0.01];

const SCENE: &str = r#"<mujoco model="swing"><compiler angle="radian"/><option timestep="0.002"/><worldbody>
    <body><joint name="swing" type="hinge" axis="0 1 0" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body></worldbody>
    <actuator><position name="servo" joint="swing" kp="20" kv="0.5"/></actuator>
    <sensor><jointpos name="angle" joint="swing"/><jointvel name="speed" joint="swing"/>
      <actuatorfrc name="torque" actuator="servo"/></sensor></mujoco>"#;

/// Writes logs of the model itself that begin in mid-motion, with the state there.
fn write_study(folder: &Path) {
    let mut player = Player::of(SCENE, &["angle", "speed", "torque"], [ROW, STEP]);
    for episode in 0..4_u32 {
        let mut noise = normal(70 + u64::from(episode));
        let command = |row: usize| (9.0 * ROW * row as f64 + 1.0 + f64::from(episode)).sin();
        let rows = BEFORE + ROWS;
        let commands: Vec<f64> = (0..rows).map(command).collect();
        let played = player.play((&[0.1], &[0.0]), &commands[..rows - 1], rows);
        let mut text = "time,ctrl.servo,angle,torque,qpos.swing,qvel.swing".to_owned();
        for (k, row) in played.chunks_exact(3).enumerate().skip(BEFORE) {
            let [angle, speed, torque] = row else {
                unreachable!("three sensors")
            };
            let (time, command) = (ROW * (k - BEFORE) as f64, commands[k]);
            let [a, t] = [angle + NOISE[0] * noise(), torque + NOISE[1] * noise()];
            write!(text, "\n{time:.2},{command},{a},{t},").unwrap();
            if k == BEFORE {
                write!(text, "{angle},{speed}").unwrap();
            } else {
                text.push(',');
            }
        }
        text.push('\n');
        write_episode(folder, (episode as usize, 3), &text);
    }
    write_model(folder, SCENE);
}

/// The log begins with row 10, when the command of row 9 still acts. The drive's force differs
/// there, and that is no gap.
#[test]
fn a_force_under_a_command_from_before_the_log_is_no_gap() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let result = run_on(folder.path(), &[]).0.result;
    assert_eq!(result.verdict.kind, Kind::None);
    assert!(result.gap.nominal < 1.1, "{}", result.gap.nominal);
}

/// Of a position, a speed and the force of a drive, only the force follows the command at once.
#[test]
fn the_force_of_a_drive_follows_the_command_and_its_joint_does_not_yet() {
    if !has_contacts() {
        return;
    }
    let model = engine().load(&Scene::from_xml("swing", SCENE, &[]).unwrap());
    let model = model.unwrap();
    let layout = model.layout();
    let commands = (0..ROWS).map(|k| (0.1 * k as f64).sin()).collect();
    let mut episode = Episode::of_commands(layout, commands, ROW);
    let column = |s: &Sensor| ChannelColumns {
        name: s.name.clone(),
        len: s.len,
    };
    episode.channels = layout.sensors.iter().map(column).collect();
    episode.readings = vec![0.0; episode.rows() * episode.channels.len()];
    let start = InitialState {
        qpos: vec![0.1],
        qvel: vec![0.0],
    };
    let followers = Followers::of(&*model, &start, &episode).unwrap();
    let mut idle = episode.clone();
    followers.open(&mut idle);
    assert_eq!(idle.readings, episode.readings, "its first command is none");
    episode.ctrl[0] = 0.5;
    followers.open(&mut episode);
    assert!(episode.readings[..2].iter().all(|x| *x == 0.0));
    assert!(episode.readings[2].is_nan());
    assert!(episode.readings[3..].iter().all(|x| *x == 0.0));
}
