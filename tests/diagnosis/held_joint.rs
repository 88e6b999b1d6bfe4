//! Two servos, integrated by hand. The gear of one nearly holds its joint: the friction is 0.94 of
//! the drive's torque.

use super::one_joint::{machine_log, normal};
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="head"><option timestep="0.002" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="neck"><joint name="pan" type="hinge" axis="0 0 1" damping="0.02"/>
    <inertial pos="0 0 0" mass="0.4" diaginertia="0.012 0.012 0.012"/>
    <body name="head"><joint name="roll" type="hinge" axis="0 0 1" damping="0.02"/>
      <inertial pos="0 0 0" mass="0.2" diaginertia="0.008 0.008 0.008"/></body></body></worldbody>
  <actuator><position name="s_pan" joint="pan" kp="4" kv="0.1"/><position name="s_roll" joint="roll" kp="4" kv="0.1"/></actuator>
  <sensor><jointpos name="q_pan" joint="pan"/><jointpos name="q_roll" joint="roll"/></sensor>
</mujoco>
"#;
const STUDY: &str = "name = \"damping\"\ntarget = \"joint/pan/damping\"\nrange = [0.005, 0.1]";
/// Inertias about the common axis, kg m². The joints are in line, so only a torque between the
/// bodies couples them.
const INERTIA: [f64; 2] = [0.012, 0.008];
/// Gains of both servos, N m/rad and N m s/rad, and damping of the joints, N m s/rad.
const GAINS: [f64; 2] = [4.0, 0.1];
const DAMPING: [f64; 2] = [0.03, 0.02];
/// Friction of the second joint relative to the torque of its drive.
const FRICTION: f64 = 0.94;
/// Standard deviation of a reading, rad.
const NOISE: f64 = 1.5e-3;
const SECONDS: f64 = 4.0;
const ROW: f64 = 0.01;

fn commands(episode: usize, time: f64) -> [f64; 2] {
    let k = episode as f64;
    let motion = |a: f64, b: f64, phase: f64| {
        0.5 * (a * time).sin() + 0.4 * ((b * time + phase).sin() - phase.sin())
    };
    [
        motion(2.0 + 0.3 * k, 5.0 - 0.4 * k, k),
        motion(1.5 + 0.4 * k, 3.6 + 0.3 * k, 2.0 * k),
    ]
}

/// Positions and speeds of both joints after a step of `h`: symplectic Euler, with friction
/// smoothed over 1 mrad/s.
fn step(q: [f64; 2], v: [f64; 2], u: [f64; 2], h: f64) -> ([f64; 2], [f64; 2]) {
    let drive = [0, 1].map(|i| GAINS[0] * (u[i] - q[i]) - GAINS[1] * v[i]);
    let friction = FRICTION * drive[1].abs() * (v[1] / 1e-3).tanh();
    let torque = [
        drive[0] - DAMPING[0] * v[0],
        drive[1] - DAMPING[1] * v[1] - friction,
    ];
    // In line: (I1 + I2) a1 + I2 a2 = t1 and I2 (a1 + a2) = t2.
    let first = (torque[0] - torque[1]) / INERTIA[0];
    let v = [
        v[0] + h * first,
        v[1] + h * (torque[1] / INERTIA[1] - first),
    ];
    ([0, 1].map(|i| q[i] + h * v[i]), v)
}

fn log(episode: usize) -> String {
    let mut noise = normal(70 + episode as u64);
    let header = "time,ctrl.s_pan,ctrl.s_roll,q_pan,q_roll,qpos.pan,qpos.roll,qvel.pan,qvel.roll";
    let read = |u: &[f64; 2], (q, _): &([f64; 2], [f64; 2])| {
        let [pan, roll] = q.map(|x| x + NOISE * noise());
        format!("{},{},{pan},{roll}", u[0], u[1])
    };
    let advance = |(q, v), u: &[f64; 2], h| step(q, v, *u, h);
    let machine = (|time| commands(episode, time), read, advance);
    let rest = ([0.0; 2], [0.0; 2]);
    machine_log(header, ([SECONDS, ROW], 2000), (rest, "0,0,0,0"), machine)
}

/// From row to row, a friction of 0.94 of the drive resembles one of 0.99, or a servo that is far
/// too soft. Over a whole replay the joint's position tells them apart.
#[test]
fn a_friction_that_nearly_holds_a_joint_is_named_with_its_value() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), NOMINAL, STUDY, log);
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["load-friction@roll"]);
    let coefficient = r.effects[0].parameters["coefficient"];
    assert!(
        (coefficient - FRICTION).abs() < 0.02,
        "coefficient {coefficient}"
    );
}
