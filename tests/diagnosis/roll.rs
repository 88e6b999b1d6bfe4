//! A wrist behind a stiff servo, integrated by hand. The model lacks dry and viscous friction, the
//! commonest finding on real arms.
//!
//! The joint is light, so its smoothed speed is as rough as the missing force. An inertia leads the
//! screening about that trajectory, and both frictions are far behind it.

use super::one_joint::{joint_log, normal};
use super::run_on;
use super::world::write_files;

const NOMINAL: &str = r#"<mujoco model="wrist"><option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body name="wrist"><joint name="roll" type="hinge" axis="1 0 0" damping="0.2" armature="0.01"/>
    <geom name="ball" type="sphere" size="0.02" mass="0.3" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="servo" joint="roll" kp="25" kv="1.5" forcerange="-8 8"/></actuator>
  <sensor><jointpos name="angle" joint="roll"/></sensor>
</mujoco>
"#;
/// Inertia including the rotor's, kg m².
const INERTIA: f64 = 0.01 + 0.4 * 0.3 * 0.02 * 0.02;
/// Stiffness and damping of the servo, N m/rad and N m s/rad, and its limit, N m.
const SERVO: (f64, f64, f64) = (25.0, 1.5, 8.0);
/// Viscous friction of the model, missing viscous friction, N m s/rad, and missing dry friction, N
/// m.
const DAMPING: f64 = 0.2;
const VISCOUS: f64 = 0.3;
const DRY: f64 = 0.15;
const NOISE: f64 = 1.5e-3;
const SECONDS: f64 = 4.0;
const ROW: f64 = 0.005;

/// Slow sines about zero, rad.
fn command(episode: usize, time: f64) -> f64 {
    let k = episode as f64;
    let wave =
        |size: f64, pace: f64, phase: f64| size * ((pace * time + phase).sin() - phase.sin());
    wave(0.2, 2.1 + 0.3 * k, 0.9 * k) + wave(0.15, 6.1 - 0.3 * k, 2.0 * k)
}

/// Angle and speed after a step of `h`: symplectic Euler, with dry friction that stops but does not
/// reverse the motion.
fn step([q, v]: [f64; 2], command: f64, h: f64) -> [f64; 2] {
    let (kp, kv, limit) = SERVO;
    let servo = (kp * (command - q) - kv * v).clamp(-limit, limit);
    let free = v + h * (servo - (DAMPING + VISCOUS) * v) / INERTIA;
    let stopped = h * DRY / INERTIA;
    let v = free - free.clamp(-stopped, stopped);
    [q + h * v, v]
}

fn log(episode: usize) -> String {
    let mut noise = normal(70 + episode as u64);
    let machine = (|time| command(episode, time), step);
    let header = "time,ctrl.servo,angle,qpos.roll,qvel.roll";
    joint_log(header, [SECONDS, ROW], 100, machine, || NOISE * noise())
}

/// Within the servo's limit, its damping is equivalent to that of the joint. The logs cannot tell
/// the two apart.
#[test]
fn dry_friction_behind_a_stiff_servo_is_named_with_what_damps_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = "name = \"rotor\"\ntarget = \"joint/roll/armature\"\nrange = [0.005, 0.02]";
    write_files(folder.path(), NOMINAL, rotor, log);
    let r = run_on(folder.path(), &[]).0.result;
    let pairs =
        ["servo-damping@servo", "viscous-friction@roll"].map(|s| ["coulomb-friction@roll", s]);
    assert!(
        pairs.iter().any(|pair| r.verdict.effects == pair),
        "{}",
        r.sentence
    );
    let value = |name: &str| {
        let mut all = r.effects.iter().filter_map(|e| e.parameters.get(name));
        *all.next().unwrap()
    };
    let (dry, viscous) = (value("force"), value("damping"));
    assert!((dry / DRY - 1.0).abs() < 0.1, "{dry}");
    assert!((viscous / VISCOUS - 1.0).abs() < 0.2, "{viscous}");
}
