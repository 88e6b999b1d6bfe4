//! Machines of one joint that lack two effects at once.

use std::fmt::Write as _;
use std::path::Path;

use super::one_joint::normal;
use super::played::Player;
use super::rows::{write_episode, write_model};
use super::{has_contacts, run_on};

/// Rows of a log, time between them and time step, s.
const ROWS: usize = 240;
const ROW: f64 = 0.01;
const STEP: f64 = 0.001;
/// Number of logs; three of them are held out.
const EPISODES: usize = 9;

/// A pendulum on a position servo, and the standard deviation of its reading, rad.
const SERVO: &str = r#"<mujoco model="servo"><compiler angle="radian"/><option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body name="link" pos="0 0 0.5"><joint name="hinge" type="hinge" axis="0 1 0" damping="0.03" armature="0.004"/>
    <geom name="link" type="capsule" fromto="0 0 0 0 0 -0.2" size="0.01" mass="0.08" contype="0" conaffinity="0"/>
    <geom name="bob" type="sphere" pos="0 0 -0.22" size="0.03" mass="0.35" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="servo" joint="hinge" kp="8" kv="0.25" forcerange="-2.5 2.5"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor>
</mujoco>"#;
const ANGLE: f64 = 3e-3;

/// A carriage on a belt with a position servo, and the standard deviation of its reading, m.
const BELT: &str = r#"<mujoco model="belt"><option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="carriage"><joint name="axis" type="slide" axis="1 0 0" damping="12" armature="0.6"/>
    <geom name="carriage" type="box" size="0.08 0.05 0.03" mass="1.6" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="drive" joint="axis" kp="900" kv="45" forcerange="-60 60"/></actuator>
  <sensor><jointpos name="position" joint="axis"/></sensor>
</mujoco>"#;
const POSITION: f64 = 5e-4;

/// Commands of a log: two waves and some steps, scaled by an amplitude.
fn commands(episode: usize, amplitude: f64) -> Vec<f64> {
    let k = episode as f64;
    let at = |time: f64| {
        let wave = |pace: f64, phase: f64| (std::f64::consts::TAU * pace * time + phase).sin();
        let step = if wave(0.6, 1.3 * k) > 0.3 { 0.5 } else { 0.0 };
        0.6 * wave(0.5 + 0.07 * k, k) + 0.3 * wave(1.7 + 0.05 * k, 2.0 * k) + step
    };
    (0..ROWS)
        .map(|row| amplitude * at(ROW * row as f64))
        .collect()
}

/// A machine, its commands and the errors of its sensor.
struct Machine<'m> {
    /// The model, and the scene that is the real machine.
    model: &'m str,
    real: &'m str,
    /// Names of drive, sensor and joint.
    drive: &'m str,
    sensor: &'m str,
    joint: &'m str,
    amplitude: f64,
    noise: f64,
    /// Delay of the commands, time steps, and drift of the reading, its unit per second.
    late: usize,
    drift: f64,
}

impl Machine<'_> {
    fn write_study(&self, folder: &Path) {
        let fine = (ROW / STEP).round() as usize;
        // Simulated step by step, so that commands can be late by part of a row.
        let mut player = Player::of(self.real, &[self.sensor], [STEP, STEP]);
        for episode in 0..EPISODES {
            let mut noise = normal(90 + episode as u64);
            let rows = commands(episode, self.amplitude);
            let steps = (ROWS - 1) * fine;
            let applied = |step: usize| rows[step.saturating_sub(self.late) / fine];
            let applied: Vec<f64> = (0..steps).map(applied).collect();
            let start = 0.2 * self.amplitude;
            let shown = player.play((&[start], &[0.0]), &applied, steps + 1);
            let (drive, sensor, joint) = (self.drive, self.sensor, self.joint);
            let mut text = format!("time,ctrl.{drive},{sensor},qpos.{joint},qvel.{joint}\n");
            for (row, command) in rows.iter().enumerate() {
                let time = ROW * row as f64;
                let read = shown[row * fine] + self.drift * time + self.noise * noise();
                let begins = if row == 0 {
                    format!("{start},0")
                } else {
                    ",".to_owned()
                };
                writeln!(text, "{time:.2},{command},{read},{begins}").unwrap();
            }
            write_episode(folder, (episode, 6), &text);
        }
        write_model(folder, self.model);
    }

    /// Effects of the verdict and of each set that is ambiguous with it, each sorted.
    fn found(&self) -> Vec<Vec<String>> {
        let folder = tempfile::tempdir().unwrap();
        self.write_study(folder.path());
        let verdict = run_on(folder.path(), &[]).0.result.verdict;
        let mut all = vec![verdict.effects];
        all.extend(verdict.ambiguous_with);
        all.iter_mut().for_each(|names| names.sort());
        all
    }
}

/// The drift is not a force, and causes most of the gap.
#[test]
fn a_late_drive_and_a_sensor_that_drifts() {
    if !has_contacts() {
        return;
    }
    let servo = Machine {
        model: SERVO,
        real: SERVO,
        drive: "servo",
        sensor: "angle",
        joint: "hinge",
        amplitude: 0.5,
        noise: ANGLE,
        late: 16,
        drift: -0.015,
    };
    let found = servo.found();
    assert_eq!(
        found[0],
        ["actuator-delay@servo", "sensor-drift@angle"],
        "{found:?}"
    );
}

/// On an axis, drag and the drive's damping act as viscous friction does. But bearings with dry
/// friction have viscous friction too, so both frictions come first.
#[test]
fn both_frictions_of_a_carriage_come_before_one_and_its_drag() {
    if !has_contacts() {
        return;
    }
    let real = BELT.replace(r#"damping="12""#, r#"damping="20" frictionloss="4""#);
    let belt = Machine {
        model: BELT,
        real: &real,
        drive: "drive",
        sensor: "position",
        joint: "axis",
        amplitude: 0.12,
        noise: POSITION,
        late: 0,
        drift: 0.0,
    };
    let found = belt.found();
    assert_eq!(
        found[0],
        ["coulomb-friction@axis", "viscous-friction@axis"],
        "{found:?}"
    );
    let other = ["coulomb-friction@axis", "linear-drag@carriage"];
    assert!(found.iter().any(|names| names[..] == other), "{found:?}");
}
