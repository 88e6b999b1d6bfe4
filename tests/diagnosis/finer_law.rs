//! A cart whose dry friction falls slightly with speed, integrated by hand. Constant dry friction
//! makes up for most of it.

use super::one_joint::{joint_log, normal};
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="cart"><option timestep="0.002" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="0.5"/>
    <geom name="cart" type="box" size="0.1 0.1 0.1" mass="1"/></body></worldbody>
  <actuator><motor name="motor" joint="rail"/></actuator>
  <sensor><jointpos name="x" joint="rail"/></sensor></mujoco>"#;
const MASS: f64 = 1.0;
const DAMPING: f64 = 0.5;
/// Friction at high speed, and its excess at rest, N; speed at which most of the excess is gone,
/// m/s.
const COULOMB: f64 = 2.0;
const BREAKAWAY: f64 = 1.2;
const SPEED: f64 = 0.1;
/// Standard deviation of a reading, m, time between readings, s, and length of a log, s.
const NOISE: f64 = 3e-4;
const ROW: f64 = 0.01;
const SECONDS: f64 = 4.0;

/// One step of symplectic Euler. Friction stops the cart but does not reverse it.
fn step([x, v]: [f64; 2], force: f64, h: f64) -> [f64; 2] {
    let friction = COULOMB + BREAKAWAY * (-(v / SPEED).powi(2)).exp();
    let pushed = v + h * (force - DAMPING * v) / MASS;
    let v = pushed.signum() * (pushed.abs() - h * friction / MASS).max(0.0);
    [x + h * v, v]
}

fn log(episode: usize) -> String {
    let k = episode as f64;
    let command =
        move |t: f64| 6.0 * ((3.0 + 0.3 * k) * t + k).sin() + 2.0 * ((7.0 - 0.4 * k) * t).sin();
    let mut noise = normal(500 + episode as u64);
    joint_log(
        "time,ctrl.motor,x,qpos.rail,qvel.rail",
        [SECONDS, ROW],
        100,
        (command, step),
        move || NOISE * noise(),
    )
}

/// Guards against a refinement whose fit begins without the friction of the law that it replaces.
/// Such a fit does not reach its optimum.
#[test]
fn a_friction_that_falls_with_the_speed_is_told_from_one_that_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let mass = "name = \"mass\"\ntarget = \"geom/cart/mass\"\nrange = [0.5, 2.0]";
    write_files(folder.path(), NOMINAL, mass, log);
    let found = run_on(folder.path(), &[]).0.result;
    assert_names(&found, &["stribeck-friction@rail"]);
    let values = &found.effects[0].parameters;
    assert!(
        (values["breakaway"] / BREAKAWAY - 1.0).abs() < 0.25,
        "{values:?}"
    );
    assert!(
        (values["coulomb"] / COULOMB - 1.0).abs() < 0.02,
        "{values:?}"
    );
}
