//! A joint without a sensor: a cart with a hanging load, of which only the cart is read, integrated
//! by hand.
//!
//! The load's motion shows in its pull on the cart.

use std::fmt::Write as _;

use asid::diagnosis::result::Kind;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::run_on;
use super::world::write_files;

const NOMINAL: &str = r#"<mujoco model="crane"><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="2"/>
    <geom name="cart" type="sphere" size="0.01" mass="1" contype="0" conaffinity="0"/>
    <body name="load"><joint name="pivot" type="hinge" axis="0 -1 0" damping="0.002"/>
    <geom name="load" type="sphere" pos="0 0 -0.4" size="0.01" mass="0.5" contype="0" conaffinity="0"/></body></body></worldbody>
  <actuator><motor name="belt" joint="rail"/></actuator>
  <sensor><jointpos name="x" joint="rail"/></sensor>
</mujoco>
"#;
/// Masses, kg, length of the rope, m, and gravity, m/s².
const CART: f64 = 1.0;
const LOAD: f64 = 0.5;
const LENGTH: f64 = 0.4;
const GRAVITY: f64 = 9.81;
/// Viscous friction of the rail, N s/m.
const RAIL: f64 = 2.0;
/// Standard deviation of a reading, m.
const NOISE: f64 = 1e-4;
const SECONDS: f64 = 4.0;
const ROW: f64 = 0.01;

fn command(episode: usize, time: f64) -> f64 {
    let k = episode as f64;
    3.0 * ((4.0 + 0.3 * k) * time).sin() + 2.0 * ((7.0 - 0.2 * k) * time + k).sin()
}

/// A log of the machine with viscous friction of the pivot, N m s/rad.
fn log(episode: usize, pivot: f64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(70 + episode as u64);
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    let (mut x, mut v, mut angle, mut spin) = (0.0, 0.0, 0.0_f64, 0.0);
    let steps = 100;
    let h = ROW / f64::from(steps);
    let mut text = "time,ctrl.belt,x".to_owned();
    for row in 0..(SECONDS / ROW) as usize {
        let time = ROW * row as f64;
        let force = command(episode, time);
        let _ = write!(text, "\n{time:.2},{force},{}", x + noise());
        for _ in 0..steps {
            // Lagrange's equations of a cart and a point mass on a rope, by symplectic Euler with a
            // step of 0.1 ms.
            let (s, c) = angle.sin_cos();
            let pull =
                LOAD * LENGTH * spin * spin * s + (LOAD * GRAVITY * s + pivot * spin / LENGTH) * c;
            let a = (force - RAIL * v + pull) / (CART + LOAD * s * s);
            let turn = -(a * c + GRAVITY * s) / LENGTH - pivot * spin / (LOAD * LENGTH * LENGTH);
            v += h * a;
            spin += h * turn;
            x += h * v;
            angle += h * spin;
        }
    }
    text + "\n"
}

/// Returns the kind of the verdict, its effects, and the largest missing force in the unit of its
/// joint.
fn told(pivot: f64) -> (Kind, Vec<String>, f64) {
    let folder = tempfile::tempdir().unwrap();
    let mass = "name = \"mass\"\ntarget = \"geom/cart/mass\"\nrange = [0.8, 1.2]";
    write_files(folder.path(), NOMINAL, mass, |episode| log(episode, pivot));
    let found = run_on(folder.path(), &[]).0.result;
    let forces = found.missing_force.iter().map(|f| f.identified);
    let largest = forces.fold(0.0, f64::max);
    (found.verdict.kind, found.verdict.effects, largest)
}

#[test]
fn a_right_model_of_a_joint_that_no_sensor_reads_lacks_nothing() {
    let (kind, _, force) = told(0.002);
    assert_eq!(kind, Kind::None);
    assert!(force < 0.1, "{force}");
}

#[test]
fn friction_of_a_joint_that_no_sensor_reads_is_named_there() {
    let (kind, effects, _) = told(0.03);
    assert_eq!(kind, Kind::Effects);
    assert_eq!(effects, ["viscous-friction@pivot"]);
}
