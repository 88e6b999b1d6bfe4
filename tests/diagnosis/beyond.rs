//! A pendulum on a servo, integrated by hand.
//!
//! One sensor drifts beyond what the drive can hold. One drive has a limit that the held-out logs
//! never reach.

use super::one_joint::{joint_log, normal};
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="servo"><option timestep="0.001" integrator="RK4"/>
  <worldbody><body name="bob"><joint name="hinge" type="hinge" axis="0 1 0" damping="0.03"/>
    <geom name="ball" type="sphere" size="0.03" pos="0 0 -0.22" mass="0.4" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="servo" joint="hinge" kp="8" kv="0.25" forcerange="-2.5 2.5"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor>
</mujoco>
"#;
const MASS: &str = "name = \"mass\"\ntarget = \"geom/ball/mass\"\nrange = [0.2, 0.7]";
/// Length, m, mass, kg, and radius of the bob, m.
const BOB: (f64, f64, f64) = (0.22, 0.4, 0.03);
const GRAVITY: f64 = 9.81;
const DAMPING: f64 = 0.03;
/// Gains of the servo, N m/rad and N m s/rad, and its largest torque, N m.
const GAINS: [f64; 2] = [8.0, 0.25];
const LIMIT: f64 = 2.5;
/// Standard deviation of the noise, rad.
const NOISE: f64 = 3e-3;
const SECONDS: f64 = 3.2;
const ROW: f64 = 0.004;

/// A log of commands of amplitude `size`, rad.
///
/// The sensor drifts by `rate`, rad/s, and the drive applies at most `limit`, N m.
fn log(episode: usize, size: f64, (rate, limit): (f64, f64)) -> String {
    let mut noise = normal(70 + episode as u64);
    let mut row = 0.0;
    let off = || {
        row += ROW;
        rate * (row - ROW) + NOISE * noise()
    };
    let k = episode as f64;
    let command = |time: f64| size * (((2.2 + 0.5 * k) * time).sin() + (0.9 * k * time).sin());
    let (length, mass, radius) = BOB;
    let inertia = mass * (length * length + 0.4 * radius * radius);
    let step = |[q, v]: [f64; 2], u: f64, h: f64| {
        let servo = (GAINS[0] * (u - q) - GAINS[1] * v).clamp(-limit, limit);
        let v = v + h * (servo - mass * GRAVITY * length * q.sin() - DAMPING * v) / inertia;
        [q + h * v, v]
    };
    let header = "time,ctrl.servo,angle,qpos.hinge,qvel.hinge";
    joint_log(header, [SECONDS, ROW], 40, (command, step), off)
}

/// At the end the sensor is off by half a radian, for which the servo would need 4 N m.
///
/// Along the readings the drive is therefore saturated, and no derivative points to the sensor.
#[test]
fn a_sensor_that_drifts_beyond_the_drives_limit_is_named() {
    let rate = -0.16;
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), NOMINAL, MASS, |episode| {
        log(episode, 0.12, (rate, LIMIT))
    });
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["sensor-drift@angle"]);
    let found = r.effects[0].parameters["rate"];
    assert!((found / rate - 1.0).abs() < 0.02, "{found}");
}

#[test]
fn a_limit_that_the_logs_held_out_never_reach_is_named() {
    let limit = 0.7;
    let folder = tempfile::tempdir().unwrap();
    let size = |episode: usize| if episode < 4 { 0.6 } else { 0.06 };
    // A mass free to compensate for the limit would cause a gap of its own.
    let mass = MASS.replace("[0.2, 0.7]", "[0.39, 0.41]");
    write_files(folder.path(), NOMINAL, &mass, |episode| {
        log(episode, size(episode), (0.0, limit))
    });
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["actuator-saturation@servo"]);
    assert_eq!(r.gap.closed, None, "{}", r.sentence);
    assert!(r.sentence.contains("never show it"), "{}", r.sentence);
}
