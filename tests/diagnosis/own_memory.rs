//! A servo whose document gives it a filter and a delay, integrated by hand.
//!
//! Both are states beside position and speed. The smoother places the machine at each row, and must
//! not lose them there: the servo would answer at once, and what the model lacks would be anything.

use std::fmt::Write as _;

use super::one_joint::normal;
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="servo"><option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body><joint name="hinge" type="hinge" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="0.4" diaginertia="0.02 0.02 0.02"/></body></worldbody>
  <actuator><position name="servo" joint="hinge" kp="8" kv="0.25" timeconst="0.05" delay="0.04" nsample="50" interp="linear"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor></mujoco>"#;

/// Inertia, kg m², and gains, N m/rad and N m s/rad.
const INERTIA: f64 = 0.02;
const GAINS: [f64; 2] = [8.0, 0.25];
/// Time constant and delay of the command, s.
const LAG: f64 = 0.05;
const DELAY: f64 = 0.04;
/// Standard deviation of a reading, rad.
const NOISE: f64 = 2e-3;
const ROW: f64 = 0.01;
const ROWS: usize = 250;

/// Command of an episode in a row, rad: steps of a fifth of a second.
fn command(episode: usize, row: usize) -> f64 {
    let step = (row / 20 * (2 * episode + 3)) as f64;
    0.4 * (2.4 * step).sin()
}

/// A log of the machine with a viscous friction, N m s/rad.
fn log(episode: usize, friction: f64) -> String {
    let mut noise = normal(510 + episode as u64);
    let (mut angle, mut speed, mut level) = (0.0, 0.0, command(episode, 0));
    angle += level;
    let mut text = "time,ctrl.servo,angle,qpos.hinge,qvel.hinge".to_owned();
    let steps = 100;
    let h = ROW / f64::from(steps);
    let late = (DELAY / ROW).round() as usize;
    for row in 0..ROWS {
        let time = ROW * row as f64;
        let start = if row == 0 {
            format!("{angle},0")
        } else {
            ",".into()
        };
        let (u, read) = (command(episode, row), angle + NOISE * noise());
        write!(text, "\n{time:.2},{u},{read},{start}").unwrap();
        let delayed = command(episode, row.saturating_sub(late));
        for _ in 0..steps {
            // Symplectic Euler with a step of 0.1 ms.
            level += h * (delayed - level) / LAG;
            let torque = GAINS[0] * (level - angle) - (GAINS[1] + friction) * speed;
            speed += h * torque / INERTIA;
            angle += h * speed;
        }
    }
    text + "\n"
}

fn named(friction: f64, effects: &[&str]) -> Option<f64> {
    let folder = tempfile::tempdir().unwrap();
    let inertia = "name = \"mass\"\ntarget = \"joint/hinge/armature\"\nrange = [0.0, 0.004]";
    write_files(folder.path(), NOMINAL, inertia, |k| log(k, friction));
    let found = run_on(folder.path(), &[]).0.result;
    assert_names(&found, effects);
    assert!(found.checks.iter().all(|c| c.check != "memory"));
    let effect = found.effects.first()?;
    effect.parameters.get("damping").copied()
}

#[test]
fn filter_and_delay_of_the_document_are_no_gap() {
    named(0.0, &[]);
}

#[test]
fn friction_is_named_beside_a_filter_and_a_delay_of_the_document() {
    let damping = named(0.3, &["viscous-friction@hinge"]).unwrap();
    assert!((damping / 0.3 - 1.0).abs() < 0.05, "{damping}");
}
