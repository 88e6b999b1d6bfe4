//! A cart whose dry friction falls a little as it speeds up, integrated by hand: dry friction that does not makes up for most of it.

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
/// Friction while the cart slides fast, what it has above that at rest, N, and the speed at which most of that is gone, m/s.
const COULOMB: f64 = 2.0;
const BREAKAWAY: f64 = 1.2;
const SPEED: f64 = 0.1;
/// Deviation of a reading, m, the time between readings, s, and how long a log is.
const NOISE: f64 = 3e-4;
const ROW: f64 = 0.01;
const SECONDS: f64 = 4.0;

/// Symplectic Euler; the friction brings the cart to a stand and no further.
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

/// The finer law began without the friction of the simpler one, whose place it took, and never came to it.
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
