//! Two servos, integrated by hand.
//!
//! In one study the first has play between its rotor, which no sensor reads, and its link. In the
//! other, the second's sensor has another zero in each log, and the first has a spring.

use std::fmt::Write as _;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::world::write_files;
use super::{assert_names, run_on};

/// Two uncoupled servos.
const NOMINAL: &str = r#"<mujoco model="servos"><option timestep="0.002" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body name="left"><joint name="left" type="hinge" axis="0 0 1" damping="0.2"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body>
    <body name="right" pos="0 1 0"><joint name="right" type="hinge" axis="0 0 1" damping="0.2"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body>
  </worldbody>
  <actuator><position name="s_left" joint="left" kp="30" kv="1.5"/><position name="s_right" joint="right" kp="30" kv="1.5"/></actuator>
  <sensor><jointpos name="q_left" joint="left"/><jointpos name="q_right" joint="right"/></sensor>
</mujoco>
"#;
/// Inertia of the joints, kg m², and their viscous friction, N m s/rad.
const INERTIA: [f64; 2] = [0.05, 0.5];
const DAMPING: f64 = 0.2;
/// Stiffness, N m/rad, and damping, N m s/rad, of a servo.
const KP: f64 = 30.0;
const KV: f64 = 1.5;
/// Standard deviation of a reading, rad.
const NOISE: f64 = 1e-3;
const SECONDS: f64 = 3.0;
const ROW: f64 = 0.01;

/// Faults of the left joint and of the right sensor.
#[derive(Clone, Copy)]
struct Truth {
    /// Play between the left drive and its joint, rad.
    play: f64,
    /// Stiffness of a spring at the left joint, N m/rad.
    stiffness: f64,
    /// Change of the right sensor's zero from one log to the next, rad.
    trend: f64,
}

const RIGHT: Truth = Truth {
    play: 0.0,
    stiffness: 0.0,
    trend: 0.0,
};

fn command(episode: usize, joint: usize, time: f64) -> f64 {
    let (k, j) = (episode as f64, joint as f64);
    0.5 * ((3.0 + 0.4 * k + 0.7 * j) * time).sin() + 0.3 * ((9.0 - 0.5 * k + j) * time + k).sin()
}

/// Position, speed and rotor of a joint after a step of `h` with a command.
///
/// The joint uses symplectic Euler, the massless rotor backward Euler. Within the play the rotor
/// follows its command; at an end of the play it pushes the joint.
fn step([q, v, rotor]: [f64; 3], (command, inertia): (f64, f64), truth: Truth, h: f64) -> [f64; 3] {
    let free = (KV * rotor + h * KP * command) / (KV + h * KP);
    let ahead = free - q;
    let (rotor, torque) = if ahead.abs() < truth.play / 2.0 {
        (free, 0.0)
    } else {
        let end = q + (truth.play / 2.0).copysign(ahead);
        (end, KP * (command - end) - KV * v)
    };
    let v = v + h * (torque - DAMPING * v - truth.stiffness * q) / inertia;
    [q + h * v, v, rotor]
}

fn log(episode: usize, truth: Truth) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(50 + episode as u64);
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    let mut joints = [[0.0; 3]; 2];
    let steps = 100;
    let h = ROW / f64::from(steps);
    let zero = truth.trend * episode as f64;
    let mut text =
        "time,ctrl.s_left,ctrl.s_right,q_left,q_right,qpos.left,qpos.right,qvel.left,qvel.right"
            .to_owned();
    for row in 0..(SECONDS / ROW) as usize {
        let time = ROW * row as f64;
        let u = [0, 1].map(|j| command(episode, j, time));
        let [left, right] = [joints[0][0] + noise(), joints[1][0] + zero + noise()];
        let start = if row == 0 { "0,0,0,0" } else { ",,," };
        let _ = write!(text, "\n{time:.2},{},{},{left},{right},{start}", u[0], u[1]);
        for _ in 0..steps {
            joints[0] = step(joints[0], (u[0], INERTIA[0]), truth, h);
            joints[1] = step(joints[1], (u[1], INERTIA[1]), RIGHT, h);
        }
    }
    text + "\n"
}

fn diagnosed(truth: Truth) -> asid::diagnosis::result::DiagnosisResult {
    let folder = tempfile::tempdir().unwrap();
    let damping = "name = \"damping\"\ntarget = \"joint/right/damping\"\nrange = [0.05, 0.5]";
    write_files(folder.path(), NOMINAL, damping, |episode| {
        log(episode, truth)
    });
    run_on(folder.path(), &[]).0.result
}

/// When a joint is set to a reading, its hidden rotor moves with it. Otherwise a rigid end of the
/// play would turn a milliradian of noise into an impact.
#[test]
fn play_behind_a_servo_is_named_with_its_width() {
    let r = diagnosed(Truth {
        play: 0.04,
        ..RIGHT
    });
    assert_names(&r, &["backlash@left"]);
    let width = r.effects[0].parameters["width"];
    assert!((width / 0.04 - 1.0).abs() < 0.1, "{width}");
}

/// The sensor has the highest evidence and makes up for all of the force that is missing at its
/// joint, but closes less than half of the gap. Next to the spring that force is hardly any of the
/// missing power.
#[test]
fn a_cause_beside_a_spring_that_lacks_far_more_force_is_named_too() {
    let r = diagnosed(Truth {
        stiffness: 8.0,
        trend: 0.008,
        ..RIGHT
    });
    assert_names(&r, &["joint-stiffness@left", "sensor-trend@q_right"]);
}
