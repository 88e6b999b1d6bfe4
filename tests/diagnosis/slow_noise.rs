//! A driven pendulum, integrated by hand, with filtered readings. Their noise decorrelates only
//! over twenty rows.
//!
//! Next to the motion, differences over a few rows show a third of such noise. A correct model
//! would seem to leave three times its noise.

use super::one_joint::{joint_log, normal};
use super::world::write_files;
use super::{Kind, run_on};

const NOMINAL: &str = r#"<mujoco model="pendulum"><option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body name="bob"><joint name="hinge" type="hinge" axis="0 1 0" damping="0.02"/>
    <geom name="ball" type="sphere" size="0.03" pos="0 0 -0.4" mass="0.5" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor>
</mujoco>
"#;
/// Length, m, mass, kg, and radius of the bob, m.
const BOB: (f64, f64, f64) = (0.4, 0.5, 0.03);
const GRAVITY: f64 = 9.81;
const DAMPING: f64 = 0.02;
/// Standard deviation of the noise, rad, and its correlation from row to row.
const NOISE: f64 = 4e-3;
const CORRELATION: f64 = 0.95;
const SECONDS: f64 = 5.0;
const ROW: f64 = 0.005;

/// Torque of the motor, N m.
fn command(episode: usize, time: f64) -> f64 {
    let k = episode as f64;
    0.5 * ((2.0 + 0.4 * k) * time).sin() + 0.3 * ((5.0 - 0.5 * k) * time).sin()
}

/// Angle and speed after a step of `h`: symplectic Euler, with dry friction that stops but does not
/// reverse the motion.
fn step([q, v]: [f64; 2], torque: f64, dry: f64, h: f64) -> [f64; 2] {
    let (length, mass, radius) = BOB;
    let inertia = mass * (length * length + 0.4 * radius * radius);
    let free = v + h * (torque - mass * GRAVITY * length * q.sin() - DAMPING * v) / inertia;
    let stopped = h * dry / inertia;
    let v = free - free.clamp(-stopped, stopped);
    [q + h * v, v]
}

/// A log of the pendulum with dry friction `dry`, N m.
fn log(episode: usize, dry: f64) -> String {
    let mut fresh = normal(40 + episode as u64);
    let mut next = fresh();
    let noise = || {
        let now = next;
        next = CORRELATION * now + (1.0 - CORRELATION * CORRELATION).sqrt() * fresh();
        NOISE * now
    };
    let machine = (
        |time| command(episode, time),
        |state, torque, h| step(state, torque, dry, h),
    );
    let header = "time,ctrl.motor,angle,qpos.hinge,qvel.hinge";
    joint_log(header, [SECONDS, ROW], 20, machine, noise)
}

const MASS: &str = "name = \"mass\"\ntarget = \"geom/ball/mass\"\nrange = [0.3, 0.8]";

#[test]
fn a_right_model_leaves_no_gap_beside_slow_noise() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), NOMINAL, MASS, |episode| log(episode, 0.0));
    let r = run_on(folder.path(), &[]).0.result;
    assert_eq!(r.verdict.kind, Kind::None, "{}", r.sentence);
    // About fifty readings are independent of each other.
    let noise = r.gap.signals[0].noise;
    assert!((noise / NOISE).ln().abs() < 0.3, "{noise}");
}

#[test]
fn dry_friction_is_named_beside_slow_noise() {
    let dry = 0.03;
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), NOMINAL, MASS, |episode| log(episode, dry));
    let r = run_on(folder.path(), &[]).0.result;
    assert!(
        r.verdict.effects == ["coulomb-friction@hinge"],
        "{}",
        r.sentence
    );
    let force = r.effects[0].parameters["force"];
    assert!((force / dry - 1.0).abs() < 0.15, "{force}");
}
