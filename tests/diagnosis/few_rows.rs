//! Logs of ten rows, of machines with six joints and without initial states in the logs. The number
//! of encoders varies.

use std::fmt::Write as _;
use std::path::Path;

use asid::diagnosis::result::Kind;

use super::one_joint::normal;
use super::played::Player;
use super::rows::write_model;
use super::{has_contacts, run_on};

/// Joints, rows of a log, time between them and time step, s, and standard deviation of a reading,
/// rad.
const JOINTS: usize = 6;
const ROWS: usize = 10;
const ROW: f64 = 0.05;
const STEP: f64 = 0.001;
const NOISE: f64 = 1e-3;

/// Pendulums, each driven by a motor; the first `read` of them have an encoder.
fn scene(read: usize) -> String {
    let mut bodies = String::new();
    let (mut motors, mut sensors) = (String::new(), String::new());
    for k in 0..JOINTS {
        write!(
            bodies,
            r#"<body pos="0 {k} 0"><joint name="j{k}" type="hinge" axis="0 1 0" damping="0.1"/>
               <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body>"#
        )
        .unwrap();
        write!(motors, r#"<motor name="m{k}" joint="j{k}"/>"#).unwrap();
        if k < read {
            write!(sensors, r#"<jointpos name="q{k}" joint="j{k}"/>"#).unwrap();
        }
    }
    format!(
        r#"<mujoco model="six"><compiler angle="radian"/><option timestep="0.001"/><worldbody>{bodies}</worldbody>
           <actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"#
    )
}

fn write_study(folder: &Path, read: usize) {
    let scene = scene(read);
    let names: Vec<String> = (0..read).map(|k| format!("q{k}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut player = Player::of(&scene, &names, [ROW, STEP]);
    for episode in 0..6_u32 {
        let mut noise = normal(30 + u64::from(episode));
        let phase =
            |row: usize, joint: usize| 9.0 * ROW * row as f64 + joint as f64 + f64::from(episode);
        let torques = |row: usize| (0..JOINTS).map(move |j| 0.5 * phase(row, j).sin());
        let commands: Vec<f64> = (0..ROWS).flat_map(torques).collect();
        let places = player.play(
            (&[0.1; JOINTS], &[0.0; JOINTS]),
            &commands[..JOINTS * (ROWS - 1)],
            ROWS,
        );
        let mut text = "time".to_owned();
        (0..JOINTS).for_each(|j| write!(text, ",ctrl.m{j}").unwrap());
        names
            .iter()
            .for_each(|name| write!(text, ",{name}").unwrap());
        for row in 0..ROWS {
            write!(text, "\n{:.2}", ROW * row as f64).unwrap();
            let own = &commands[JOINTS * row..JOINTS * (row + 1)];
            own.iter().for_each(|c| write!(text, ",{c}").unwrap());
            for place in &places[read * row..read * (row + 1)] {
                write!(text, ",{}", place + NOISE * noise()).unwrap();
            }
        }
        text.push('\n');
        let kind = if episode < 4 { "train" } else { "test" };
        std::fs::write(folder.join(format!("{kind}_{episode}.csv")), text).unwrap();
    }
    write_model(folder, &scene);
}

/// Ten rows are fewer than the twelve unknown coordinates of a log, but they hold sixty readings.
#[test]
fn ten_rows_of_six_encoders_are_diagnosed() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), JOINTS);
    let result = run_on(folder.path(), &[]).0.result;
    assert_eq!(result.verdict.kind, Kind::None, "{}", result.sentence);
}
