//! A tray that carries a block, with a spring in its lift that the model lacks.
//!
//! The spring yields under the weight of tray and block. By derivatives, a heavier tray, a constant
//! force and a bias of the drive are therefore ahead of it. The study's parameter makes up for part
//! of it.

use std::fmt::Write as _;
use std::path::Path;

use super::one_joint::normal;
use super::played::Player;
use super::rows::{write_episode, write_model_with};
use super::{assert_names, has_contacts, run_on};

/// Rows of a log, time between them and time step, s, and standard deviation of a reading, m.
const ROWS: usize = 130;
const ROW: f64 = 0.01;
const STEP: f64 = 0.001;
const NOISE: f64 = 5e-4;
/// Logs, how many of them are for training, and rows before each log in which the tray comes to
/// rest.
const EPISODES: usize = 8;
const TRAINING: usize = 6;
const SETTLING: usize = 200;

/// Compliance of the lift, m/N.
const COMPLIANCE: f64 = 1.5e-3;
/// Masses of the tray and of the block, kg; the model has another mass of the block.
const TRAY: f64 = 0.6;
const BLOCK: f64 = 0.15;

/// Mass of the lift's rotor, kg, and damping ratio of its spring.
const ROTOR: f64 = 0.05;
const LOSS: f64 = 0.03;

/// The tray on its `joints`, with the elements `before` and `after` its body, and the block on it.
fn scene([before, joints, after]: [&str; 3], block: f64) -> String {
    format!(
        r#"<mujoco model="tray"><option timestep="{STEP}" integrator="implicitfast" cone="elliptic" impratio="10"/>
        <worldbody>{before}<body name="tray" pos="0 0 0.3">{joints}
        <geom name="tray" type="box" size="0.1 0.1 0.01" mass="{TRAY}"/></body>{after}
        <body name="block" pos="0 0 0.33"><freejoint name="block"/>
        <geom name="block" type="box" size="0.03 0.03 0.02" mass="{block}"/></body></worldbody>
        <actuator><position name="hoist" joint="lift" kp="600" kv="40"/></actuator>
        <sensor><framepos name="height" objtype="xbody" objname="tray"/>
        <framepos name="place" objtype="xbody" objname="block"/></sensor></mujoco>"#
    )
}

/// The model: the tray directly on its drive.
fn model() -> String {
    let lift = format!(r#"<joint name="lift" type="slide" axis="0 0 1" armature="{ROTOR}"/>"#);
    scene(["", &lift, ""], 0.25)
}

/// The real machine: the tray on a spring on the rotor, with the rotor's weight compensated.
fn machine() -> String {
    let stiffness = 1.0 / COMPLIANCE;
    let damping = 2.0 * LOSS * (stiffness * TRAY).sqrt();
    let rotor = format!(
        r#"<body name="rotor" gravcomp="1"><joint name="lift" type="slide" axis="0 0 1"/>
        <geom size="0.01" mass="{ROTOR}" contype="0" conaffinity="0"/>"#
    );
    let spring = format!(
        r#"<joint name="spring" type="slide" axis="0 0 1" stiffness="{stiffness}" damping="{damping}"/>"#
    );
    scene([&rotor, &spring, "</body>"], BLOCK)
}

fn write_study(folder: &Path) {
    let mut player = Player::of(&machine(), &["height", "place"], [ROW, STEP]);
    let mut start = vec![0.0; 2];
    start.extend([0.0, 0.0, 0.33, 1.0, 0.0, 0.0, 0.0]);
    for episode in 0..EPISODES {
        let turn = 2.0 + 0.7 * episode as f64;
        let command = |row: usize| {
            let time = ROW * row.saturating_sub(SETTLING) as f64;
            0.03 * (turn * time).sin() + 0.02 * (1.0 - (2.3 * turn * time).cos())
        };
        let rows = SETTLING + ROWS;
        let commands: Vec<f64> = (0..rows).map(command).collect();
        let shown = player.play((&start, &[0.0; 8]), &commands[..rows - 1], rows);
        let shown = &shown[6 * SETTLING..];
        let commands = commands[SETTLING..].iter();
        write_episode(
            folder,
            (episode, TRAINING),
            &log(episode, commands.copied(), shown),
        );
    }
    let parameters =
        "[[parameter]]\nname = \"block\"\ntarget = \"geom/block/mass\"\nrange = [0.05, 0.3]\n";
    write_model_with(folder, &model(), parameters);
}

/// A log of the hoist's commands and of the readings of tray and block.
fn log(episode: usize, commands: impl Iterator<Item = f64>, places: &[f64]) -> String {
    let mut noise = normal(40 + episode as u64);
    let mut text = "time,ctrl.hoist".to_owned();
    for sensor in ["height", "place"] {
        (0..3).for_each(|i| write!(text, ",{sensor}.{i}").unwrap());
    }
    for (row, (command, places)) in commands.zip(places.chunks(6)).enumerate() {
        write!(text, "\n{:.2},{command}", ROW * row as f64).unwrap();
        for x in places {
            write!(text, ",{}", x + NOISE * noise()).unwrap();
        }
    }
    text.push('\n');
    text
}

/// The column of the spring is far behind that of a heavier tray.
///
/// Replays from the initial states of the logs leave no residual with the spring. Replays from the
/// initial states that were smoothed under the model without it do.
#[test]
fn a_lift_that_gives_way_under_what_it_carries_is_no_heavier_tray() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let result = run_on(folder.path(), &[]).0.result;
    assert_names(&result, &["joint-compliance@lift"]);
    let found = result.effects[0].parameters["compliance"];
    assert!((found / COMPLIANCE - 1.0).abs() < 0.05, "{found}");
    assert!(result.gap.refined < 1.1, "{:?}", result.gap);
}
