//! A driven pendulum beside free ones. Their columns resemble wiring faults and have none.

use std::fmt::Write as _;
use std::path::Path;

use asid::diagnosis::study::Study;

use super::has_contacts;
use super::one_joint::normal;
use super::played::Player;
use super::rows::write_model;
use super::wiring::mended;

/// Rows of a log, time between them and time step, s, and standard deviation of a reading, rad.
const ROWS: usize = 400;
const ROW: f64 = 0.005;
const STEP: f64 = 0.001;
const NOISE: f64 = 1e-3;
/// Delay of a column, rows: 60 ms.
const LATE: usize = 12;

/// One pendulum driven by a motor, and three free pendulums.
const PENDULUMS: &str = r#"<mujoco model="pendulums"><compiler angle="radian"/><option timestep="0.001"/>
  <worldbody>
    <body name="driven"><joint name="driven" type="hinge" axis="0 1 0" damping="0.2"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="2" contype="0" conaffinity="0"/></body>
    <body name="a" pos="0 1 0"><joint name="a" type="hinge" axis="0 1 0" damping="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body>
    <body name="b" pos="0 2 0"><joint name="b" type="hinge" axis="0 1 0" damping="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body>
    <body name="c" pos="0 3 0"><joint name="c" type="hinge" axis="0 1 0" damping="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body>
  </worldbody>
  <actuator><motor name="motor" joint="driven"/></actuator>
  <sensor><jointpos name="q_driven" joint="driven"/><jointpos name="q_a" joint="a"/><jointpos name="q_b" joint="b"/>
    <jointpos name="q_c" joint="c"/></sensor>
</mujoco>"#;

/// Errors of the columns: delay of each, rows, and offset of the driven one's zero in all logs but
/// the first, rad.
#[derive(Clone, Copy, Default)]
struct Wrong {
    late: [usize; 4],
    slips: f64,
}

/// A study whose logs give their initial states.
fn study(wrong: Wrong) -> Study {
    let folder = tempfile::tempdir().unwrap();
    write_logs(folder.path(), wrong);
    Study::read(folder.path()).unwrap()
}

fn write_logs(folder: &Path, Wrong { late, slips }: Wrong) {
    let mut player = Player::of(PENDULUMS, &["q_driven", "q_a", "q_b", "q_c"], [ROW, STEP]);
    for episode in 0..5_u32 {
        let mut noise = normal(70 + u64::from(episode));
        let k = f64::from(episode);
        let torque = |row: usize| 2.0 * (5.0 * ROW * row as f64 + k).sin();
        let commands: Vec<f64> = (0..ROWS).map(torque).collect();
        let start = [0.1, 0.6 - 0.1 * k, 0.9, -0.5];
        let zeros = [slips * k.min(1.0), 0.0, 0.0, 0.0];
        let places = player.play((&start, &[0.0; 4]), &commands[..ROWS - 1], ROWS);
        let mut text = "time,ctrl.motor,q_driven,q_a,q_b,q_c".to_owned();
        for kind in ["qpos", "qvel"] {
            write!(text, ",{kind}.driven,{kind}.a,{kind}.b,{kind}.c").unwrap();
        }
        text.push('\n');
        for (row, torque) in commands.iter().enumerate() {
            write!(text, "{:.3},{torque}", ROW * row as f64).unwrap();
            for (column, late) in late.iter().enumerate() {
                let place = places[4 * row.saturating_sub(*late) + column];
                let read = place + zeros[column] + NOISE * noise();
                write!(text, ",{read}").unwrap();
            }
            for value in start.iter().chain(&[0.0; 4]) {
                match row {
                    0 => write!(text, ",{value}").unwrap(),
                    _ => text.push(','),
                }
            }
            text.push('\n');
        }
        let kind = if episode < 4 { "train" } else { "test" };
        std::fs::write(folder.join(format!("{kind}_{episode}.csv")), text).unwrap();
    }
    write_model(folder, PENDULUMS);
}

/// Columns of the free pendulums are late relative to the initial states in the logs, and carry no
/// information about commands.
#[test]
fn columns_that_no_drive_moves_are_late_by_no_clock() {
    if !has_contacts() {
        return;
    }
    let late = |late: [usize; 4]| Wrong { late, slips: 0.0 };
    let clock = mended(&study(late([LATE; 4])));
    assert!(clock.wiring.iter().any(|w| w.fault == "wiring-clock"));
    let others = mended(&study(late([0, LATE, LATE, LATE])));
    assert!(others.wiring.is_empty(), "{:?}", others.wiring);
}

/// As for an encoder that slips after the first log: another zero explains the other logs, and
/// contradicts the first.
#[test]
fn a_zero_that_slips_once_is_no_wiring() {
    if !has_contacts() {
        return;
    }
    for slips in [-1.0, -0.7, 0.4, 0.7, 1.0] {
        let wrong = Wrong {
            slips,
            ..Wrong::default()
        };
        let found = mended(&study(wrong));
        assert!(found.wiring.is_empty(), "{slips} rad: {:?}", found.wiring);
    }
}
