//! A cart with a hanging pole, driven by a motor through a soft belt, integrated by hand.

use super::one_joint::{machine_log, normal};
use super::world::write_files;
use super::{assert_names, run_on};

const NOMINAL: &str = r#"<mujoco model="cart-pole"><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="3" armature="0.05"/>
    <geom name="cart" type="box" size="0.05 0.05 0.05" mass="0.8" contype="0" conaffinity="0"/>
    <body name="pole"><joint name="pivot" type="hinge" axis="0 1 0" damping="0.003"/>
      <inertial pos="0 0 -0.2" mass="0.13" diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody>
  <actuator><motor name="belt" joint="rail"/></actuator>
  <sensor><jointpos name="x" joint="rail"/><jointvel name="dx" joint="rail"/><jointpos name="phi" joint="pivot"/></sensor>
</mujoco>
"#;
const STUDY: &str = "name = \"cart\"\ntarget = \"geom/cart/mass\"\nrange = [0.4, 1.6]";
/// Mass of the cart, kg. Because the rotor swings on the belt, the cart appears lighter.
const CART: f64 = 1.36;
/// Compliance of the belt, m/N, and mass of the rotor as felt at the rail, kg.
const BELT: (f64, f64) = (0.1, 0.05);
/// Mass of the pole, kg, distance of its centre below the pivot, m, and inertia about the centre,
/// kg m².
const POLE: (f64, f64, f64) = (0.13, 0.2, 1e-3);
/// Damping of the rail, N s/m, and of the pivot, N m s/rad.
const DAMPING: [f64; 2] = [3.0, 0.003];
const GRAVITY: f64 = 9.81;
/// Standard deviations of the readings of position, m, speed, m/s, and angle, rad.
const NOISE: [f64; 3] = [2e-3, 2e-2, 4e-3];
const SECONDS: f64 = 3.3;
const ROW: f64 = 0.01;

fn command(episode: usize, time: f64) -> f64 {
    let k = episode as f64;
    2.5 * ((3.0 + 0.7 * k) * time).sin() + 1.2 * ((7.0 - 0.5 * k) * time + k).sin() - 1.2 * k.sin()
}

/// Positions and speeds of cart, pole and rotor after a step of `h`: symplectic Euler.
fn step(at: [f64; 3], speed: [f64; 3], force: f64, h: f64) -> ([f64; 3], [f64; 3]) {
    let ([x, phi, rotor], [dx, dphi, drotor]) = (at, speed);
    let (mass, length, inertia) = POLE;
    let belt = (rotor - x) / BELT.0;
    let (sin, cos) = phi.sin_cos();
    // The pole's centre is at x - l sin(phi).
    let along = belt - DAMPING[0] * dx - mass * length * sin * dphi * dphi;
    let about = -DAMPING[1] * dphi - mass * GRAVITY * length * sin;
    let (a, b, c) = (
        CART + mass,
        -mass * length * cos,
        inertia + mass * length * length,
    );
    let determinant = a * c - b * b;
    let accelerations = [
        (c * along - b * about) / determinant,
        (a * about - b * along) / determinant,
        (force - belt) / BELT.1,
    ];
    let speed = [0, 1, 2].map(|i| [dx, dphi, drotor][i] + h * accelerations[i]);
    ([0, 1, 2].map(|i| at[i] + h * speed[i]), speed)
}

fn log(episode: usize) -> String {
    let mut noise = normal(60 + episode as u64);
    let header = "time,ctrl.belt,x,dx,phi,qpos.rail,qpos.pivot,qvel.rail,qvel.pivot";
    let read = |u: &f64, (at, speed): &([f64; 3], [f64; 3])| {
        let read = [at[0], speed[0], at[1]];
        let [x, dx, phi] = [0, 1, 2].map(|i| read[i] + NOISE[i] * noise());
        format!("{u},{x},{dx},{phi}")
    };
    let advance = |(at, speed), u: &f64, h| step(at, speed, *u, h);
    let machine = (|time| command(episode, time), read, advance);
    let rest = ([0.0; 3], [0.0; 3]);
    machine_log(header, ([SECONDS, ROW], 1000), (rest, "0,0,0,0"), machine)
}

/// From row to row a lighter cart makes up for most of the belt, and columns about that trajectory
/// show no belt. Replays show it.
#[test]
fn a_soft_belt_is_named_that_no_column_shows() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path(), NOMINAL, STUDY, log);
    let r = run_on(folder.path(), &[]).0.result;
    assert_names(&r, &["joint-compliance@rail"]);
    let compliance = r.effects[0].parameters["compliance"];
    assert!((compliance / BELT.0 - 1.0).abs() < 0.05, "{compliance}");
}
