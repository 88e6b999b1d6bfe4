//! A servo that drives its pendulum through a spring, integrated by hand. Logs begin in mid-motion.

use super::one_joint::{machine_log, normal};
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="servo"><option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body name="bob"><joint name="hinge" type="hinge" axis="0 1 0" damping="0.03" armature="0.004"/>
    <geom name="ball" type="sphere" size="0.03" pos="0 0 -0.22" mass="0.35" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="servo" joint="hinge" kp="8" kv="0.25"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor>
</mujoco>
"#;
const STUDY: &str = "name = \"mass\"\ntarget = \"geom/ball/mass\"\nrange = [0.15, 0.7]";
/// Compliance of the spring, rad/(N m).
const COMPLIANCE: f64 = 0.08;
/// Mass of the bob, kg, its distance from the joint and its radius, m.
const BOB: (f64, f64, f64) = (0.45, 0.22, 0.03);
const GRAVITY: f64 = 9.81;
/// Friction of the joint, N m s/rad, and inertia of the rotor, kg m².
const DAMPING: f64 = 0.03;
const ROTOR: f64 = 0.004;
/// Gains of the servo, N m/rad and N m s/rad.
const GAINS: [f64; 2] = [8.0, 0.25];
/// Standard deviation of a reading, rad.
const NOISE: f64 = 3e-3;
const SECONDS: f64 = 3.3;
const ROW: f64 = 0.01;

fn command(episode: usize, time: f64) -> f64 {
    let k = episode as f64;
    0.4 * ((2.0 + 0.5 * k) * time).sin() + 0.3 * ((5.0 + 0.4 * k) * time + k).sin() - 0.3 * k.sin()
}

/// Angle and speed of the joint, then of the rotor, after a step of `h`: symplectic Euler.
fn step([q, v, angle, speed]: [f64; 4], command: f64, h: f64) -> [f64; 4] {
    let (mass, length, radius) = BOB;
    let inertia = mass * (length * length + 0.4 * radius * radius);
    let spring = (angle - q) / COMPLIANCE;
    let drive = GAINS[0] * (command - angle) - GAINS[1] * speed;
    let speed = speed + h * (drive - spring) / ROTOR;
    let v = v + h * (spring - mass * GRAVITY * length * q.sin() - DAMPING * v) / inertia;
    [q + h * v, v, angle + h * speed, speed]
}

fn log(episode: usize) -> String {
    let mut noise = normal(20 + episode as u64);
    let k = episode as f64;
    let (q, v) = (0.25 * (3.0 * k).sin(), 0.3 * (2.0 * k).cos());
    let header = "time,ctrl.servo,angle,qpos.hinge,qvel.hinge";
    let read = |u: &f64, state: &[f64; 4]| format!("{u},{}", state[0] + NOISE * noise());
    let advance = |state, u: &f64, h| step(state, *u, h);
    let machine = (|time| command(episode, time), read, advance);
    // The rotor begins at the position and speed of the joint.
    let begins = ([q, v, q, v], &*format!("{q},{v}"));
    machine_log(header, ([SECONDS, ROW], 1000), begins, machine)
}

/// A model begins with its rotor in balance between servo and spring. The spring would be stretched
/// by up to 0.1 rad there, and its oscillation fills the first second.
#[test]
fn a_spring_in_series_is_named_where_no_log_says_how_far_it_is_stretched() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), NOMINAL, STUDY, log);
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["joint-compliance@hinge"]);
    // The spring's damping is the model's guess, and its initial stretch is unknown. The logs
    // determine the compliance to a quarter.
    let [low, high] = r.effects[0].intervals95["compliance"];
    assert!(low < COMPLIANCE && COMPLIANCE < high, "{low} {high}");
    assert!(high - low < 0.6 * COMPLIANCE, "{low} {high}");
}
