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

/// A command that moves in every log.
fn moving(row: usize, episode: u32) -> f64 {
    (9.0 * ROW * row as f64 + 1.0 + f64::from(episode)).sin()
}

/// Writes logs of the model itself that begin in mid-motion, with the state there, under commands
/// of a row and a log.
fn write_study(folder: &Path, command: fn(usize, u32) -> f64) {
    let mut player = Player::of(SCENE, &["angle", "speed", "torque"], [ROW, STEP]);
    for episode in 0..4_u32 {
        let mut noise = normal(70 + u64::from(episode));
        let rows = BEFORE + ROWS;
        let commands: Vec<f64> = (0..rows).map(|row| command(row, episode)).collect();
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
    if has_contacts() {
        is_no_gap(moving);
    }
}

/// Symptom: a force of 50 standard deviations in the first row of each log, and a gap of a right
/// model, because the first log holds one command.
///
/// Cause: that log alone was searched for another command, and had none.
#[test]
fn a_force_under_a_command_that_the_first_log_holds_is_no_gap_either() {
    let command = |row, episode| match episode {
        0 => 0.5,
        _ => moving(row, episode),
    };
    if has_contacts() {
        is_no_gap(command);
    }
}

fn is_no_gap(command: fn(usize, u32) -> f64) {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), command);
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
    let column = |s: &Sensor| ChannelColumns {
        name: s.name.clone(),
        len: s.len,
    };
    let log = |commands: Vec<f64>| {
        let mut episode = Episode::of_commands(layout, commands, ROW);
        episode.channels = layout.sensors.iter().map(column).collect();
        episode.readings = vec![0.0; episode.rows() * episode.channels.len()];
        episode
    };
    let start = InitialState {
        qpos: vec![0.1],
        qvel: vec![0.0],
    };
    let idle = log((0..ROWS).map(|k| (0.1 * k as f64).sin()).collect());
    // A command that every log holds is told from none.
    let held = [0.5, 1.0, 1.5].map(|command| log(vec![command; ROWS]));
    for logs in [&[&idle][..], &[&held[0]], &held.each_ref()] {
        let followers = Followers::of(&*model, &start, logs).unwrap();
        let mut none = idle.clone();
        followers.open(&mut none);
        assert_eq!(none.readings, idle.readings, "its first command is none");
        let mut opened = held[0].clone();
        followers.open(&mut opened);
        assert!(opened.readings[..2].iter().all(|x| *x == 0.0));
        assert!(opened.readings[2].is_nan());
        assert!(opened.readings[3..].iter().all(|x| *x == 0.0));
    }
}
