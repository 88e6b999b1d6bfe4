//! A leg with a knee that nearly sticks: its dry friction is so large that derivatives at the model
//! without friction hardly show it.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use asid::core::Progress;
use asid::diagnosis::diagnose::{Diagnosis, Settings, diagnose};
use asid::diagnosis::machine::Machine;
use asid::diagnosis::study::Study;

use super::one_joint::normal;
use super::played::Player;
use super::rows::write_model;
use super::{assert_names, has_contacts};
use crate::diagnosis_support::engine;

/// Rows of a log, and time between them, s.
const ROWS: usize = 100;
const ROW: f64 = 0.01;
/// Time step, s.
const STEP: f64 = 0.001;
/// Standard deviation of a reading, m or rad.
const NOISE: f64 = 1e-3;
/// Dry friction of the real knee, N m: one stops it now and then, one holds it most of the time.
/// The motor's largest torque is 3.
const STOPS: f64 = 1.0;
const HOLDS: f64 = 2.5;

/// A trunk on a vertical rail, with a leg that pushes it off the floor.
fn scene(friction: f64) -> String {
    format!(
        r#"<mujoco model="leg"><option timestep="{STEP}" cone="elliptic"/>
        <worldbody><geom name="floor" type="plane" size="9 9 0.1"/>
        <body name="trunk" pos="0 0 0.5"><joint name="rail" type="slide" axis="0 0 1"/>
          <geom name="trunk" type="box" size="0.1 0.05 0.05" mass="1" contype="0" conaffinity="0"/>
          <body name="thigh"><joint name="hip" type="hinge" axis="0 1 0" stiffness="20" damping="0.05"/>
            <geom name="thigh" type="capsule" fromto="0 0 0 0 0 -0.25" size="0.02" mass="0.3" contype="0" conaffinity="0"/>
            <body name="shank" pos="0 0 -0.25"><joint name="knee" type="hinge" axis="0 1 0" stiffness="10" damping="0.02" frictionloss="{friction}"/>
              <geom name="shank" type="capsule" fromto="0 0 0 0 0 -0.25" size="0.02" mass="0.2" contype="0" conaffinity="0"/>
              <geom name="foot" type="sphere" size="0.03" pos="0 0 -0.25" mass="0.05"/></body></body></body>
        </worldbody><actuator><motor name="at_hip" joint="hip"/><motor name="at_knee" joint="knee"/></actuator>
        <sensor><jointpos name="height" joint="rail"/><jointpos name="q_hip" joint="hip"/><jointpos name="q_knee" joint="knee"/>
        </sensor></mujoco>"#
    )
}

/// Torques of a log at a time, N m.
fn torques(episode: u32, time: f64) -> [f64; 2] {
    let k = f64::from(episode);
    let wave = |pace: f64, phase: f64| (std::f64::consts::TAU * pace * time + phase).sin();
    [
        2.0 * wave(1.0 + 0.2 * k, k),
        3.0 * wave(1.7 - 0.1 * k, 2.0 * k),
    ]
}

fn write_study(folder: &Path, friction: f64, episodes: u32) {
    let sensors = ["height", "q_hip", "q_knee"];
    let mut player = Player::of(&scene(friction), &sensors, [ROW, STEP]);
    for episode in 0..episodes {
        let mut noise = normal(300 + u64::from(episode));
        let start = [0.03, 0.2, -0.4];
        let commands = (0..ROWS - 1).flat_map(|k| torques(episode, ROW * k as f64));
        let commands: Vec<f64> = commands.collect();
        let places = player.play((&start, &[0.0; 3]), &commands, ROWS);
        let mut text = "time,ctrl.at_hip,ctrl.at_knee,height,q_hip,q_knee".to_owned();
        for kind in ["qpos", "qvel"] {
            for name in ["rail", "hip", "knee"] {
                write!(text, ",{kind}.{name}").unwrap();
            }
        }
        for (k, row) in places.chunks_exact(3).enumerate() {
            let time = ROW * k as f64;
            let [hip, knee] = torques(episode, time);
            write!(text, "\n{time:.2},{hip},{knee}").unwrap();
            for x in row {
                write!(text, ",{}", x + NOISE * noise()).unwrap();
            }
            let [height, hip, knee] = start;
            match k {
                0 => write!(text, ",{height},{hip},{knee},0,0,0").unwrap(),
                _ => text += &",".repeat(6),
            }
        }
        let kind = if episode + 2 < episodes {
            "train"
        } else {
            "test"
        };
        std::fs::write(folder.join(format!("{kind}_{episode}.csv")), text + "\n").unwrap();
    }
    write_model(folder, &scene(0.0));
}

/// Records the sets that are tried and the leader of each ranking. Stops the work once `is_enough`
/// of both counts.
struct Watched {
    tried: Mutex<Vec<String>>,
    led: Mutex<Vec<String>>,
    is_enough: fn(tried: usize, led: usize) -> bool,
}

impl Progress for Watched {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _units: u64) {}
    fn end(&self) {}
    fn is_stopped(&self) -> bool {
        let [tried, led] = [&self.tried, &self.led].map(|all| all.lock().unwrap().len());
        (self.is_enough)(tried, led)
    }
    fn note(&self, text: &str) {
        let name = text.strip_prefix("trying ").map(str::to_owned);
        self.tried.lock().unwrap().extend(name);
    }
    fn ranking(&self, _stage: &str, rows: &[(String, f64)]) {
        let first = rows.first().map(|(name, _)| name.clone());
        self.led.lock().unwrap().extend(first);
    }
}

/// Diagnoses the leg with some friction of its knee until `is_enough`; also returns what was
/// recorded.
fn diagnosed(friction: f64, is_enough: fn(usize, usize) -> bool) -> (Diagnosis, Watched) {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), friction, 5);
    let study = Study::read(folder.path()).unwrap();
    let machine = Machine::new(engine(), &study.scene, &[], &[], 0).unwrap();
    let watched = Watched {
        tried: Mutex::default(),
        led: Mutex::default(),
        is_enough,
    };
    let (found, _) = diagnose(&study, machine, Settings::default(), &watched).unwrap();
    (found, watched)
}

/// By derivatives at a knee without friction, hysteresis of the drives leads. Replays with friction
/// have the smallest residuals.
#[test]
fn a_friction_that_stops_a_knee_is_tried_first_and_named() {
    if !has_contacts() {
        return;
    }
    let (found, watched) = diagnosed(STOPS, |tried, _| tried > 1);
    let r = &found.result;
    assert_names(r, &["coulomb-friction@knee"]);
    let force = r.effects[0].parameters["force"];
    assert!((force / STOPS - 1.0).abs() < 0.05, "{force}");
    assert_eq!(watched.tried.lock().unwrap()[0], "coulomb-friction@knee");
}

/// In replays that begin where the knee stands, the model's knee moves at once, and a small
/// friction reduces that motion only a little.
#[test]
fn a_friction_that_holds_a_knee_leads_the_screening() {
    if !has_contacts() {
        return;
    }
    let (_, watched) = diagnosed(HOLDS, |_, led| led > 0);
    assert_eq!(watched.led.lock().unwrap()[0], "coulomb-friction@knee");
}
