//! A servo that holds a constant command, settles beside it, and has another sensor zero in each
//! log.

use std::fmt::Write as _;

use super::one_joint::normal;
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="servo"><option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body><joint name="hinge" type="hinge" axis="0 1 0" damping="0.03"/>
    <inertial pos="0 0 0" mass="0.4" diaginertia="0.02 0.02 0.02"/></body></worldbody>
  <actuator><position name="servo" joint="hinge" kp="8" kv="0.25"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor></mujoco>"#;

/// Inertia, kg m², damping of joint and servo, N m s/rad, and stiffness, N m/rad.
const INERTIA: f64 = 0.02;
const DAMPING: f64 = 0.28;
const KP: f64 = 8.0;
/// Offset of the servo from its command, rad.
const BIAS: f64 = -0.23;
/// Reading of the sensor at zero in each log, rad.
const ZEROS: [f64; 6] = [0.13, -0.14, 0.03, -0.32, 0.46, -0.05];
/// Standard deviation of a reading, rad.
const NOISE: f64 = 3e-3;
const ROW: f64 = 0.02;
const ROWS: usize = 120;

/// Returns the angle at a time, s: the step response of a damped oscillator that begins at rest.
fn angle(time: f64) -> f64 {
    let frequency = (KP / INERTIA).sqrt();
    let ratio = DAMPING / (2.0 * (KP * INERTIA).sqrt());
    let turning = frequency * (1.0 - ratio * ratio).sqrt();
    let (sin, cos) = (turning * time).sin_cos();
    let decay = (-ratio * frequency * time).exp();
    BIAS * (1.0 - decay * (cos + ratio * frequency / turning * sin))
}

fn log(episode: usize) -> String {
    let mut noise = normal(310 + episode as u64);
    let mut text = "time,ctrl.servo,angle,qpos.hinge,qvel.hinge".to_owned();
    for row in 0..ROWS {
        let time = ROW * row as f64;
        let read = angle(time) + ZEROS[episode] + NOISE * noise();
        let start = if row == 0 { "0,0" } else { "," };
        write!(text, "\n{time:.2},0,{read},{start}").unwrap();
    }
    text + "\n"
}

/// Without the sensor's zero the model must jump to the first reading.
///
/// Guards against a dry friction estimated from the two rows of that jump. It could hold the servo
/// anywhere, and hide where the servo stands.
#[test]
fn a_servo_that_misses_its_goal_is_named_beside_a_sensor_that_is_homed() {
    let folder = tempfile::tempdir().unwrap();
    let damping = "name = \"damping\"\ntarget = \"joint/hinge/damping\"\nrange = [0.01, 0.1]";
    write_files(folder.path(), NOMINAL, damping, log);
    let found = run_on(folder.path(), &[]).0.result;
    assert_names(&found, &["actuator-bias@servo", "episode-offset@angle"]);
    let of = |name: &str| found.effects.iter().find(|e| e.effect == name).unwrap();
    let bias = of("actuator-bias").parameters["bias"];
    assert!((bias - BIAS).abs() < 0.005, "{bias}");
    let zero = of("episode-offset").parameters["e4"];
    assert!((zero - ZEROS[4]).abs() < 0.01, "{zero}");
}
