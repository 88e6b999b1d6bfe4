//! A cart on a rail, integrated by hand, independently of all engines here.
//!
//! `m x'' = u - b x' + f(x, x', t)` is integrated by a Runge-Kutta method with a step of 0.1 ms, so
//! that a diagnosis on these logs is no inverse crime.

use std::fmt::Write as _;
use std::path::Path;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// The model as its owner has it: a mass of 1 kg, which is not the real one, and no effect.
pub const NOMINAL: &str = r#"<mujoco model="cart"><option timestep="0.002" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="2"/>
    <geom name="cart" type="box" size="0.05 0.05 0.05" mass="1"/></body></worldbody>
  <actuator><motor name="belt" joint="rail" ctrlrange="-20 20"/></actuator>
  <sensor><jointpos name="x" joint="rail"/><jointvel name="dx" joint="rail"/></sensor></mujoco>
"#;

/// What the real cart has that the model lacks.
#[allow(dead_code)] // Each test program uses some of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Truth {
    /// Nothing.
    None,
    /// Dry friction, N, smoothed over 5 mm/s.
    Coulomb(f64),
    /// Dry friction, N, and its excess over the mean against motion in the positive direction, N.
    UnevenFriction([f64; 2]),
    /// More viscous friction, N s/m.
    Viscous(f64),
    /// A spring, N/m.
    Spring(f64),
    /// A delay of the command, s.
    Delay(f64),
    /// A limit of the motor's force, N.
    Limit(f64),
    /// A bias of the position reading, m.
    SensorBias(f64),
    /// A step size of the speed reading, m/s.
    SpeedSteps(f64),
    /// A magnet at 0.05 m, N. No catalogue has this effect.
    Magnet(f64),
    /// Slightly more of both frictions and a command 1.5 ms late, as on any machine; and a spring,
    /// N/m.
    Ordinary(f64),
    /// Readings of noise alone.
    Noise,
}

/// Mass of the real cart, kg.
pub const MASS: f64 = 1.3;
const DAMPING: f64 = 2.0;
const SECONDS: f64 = 2.4;
/// Standard deviations of the noise, m and m/s.
pub const NOISE: [f64; 2] = [5e-4, 5e-3];

/// Returns the command, a few sines that differ between episodes, N.
fn command(episode: usize, t: f64) -> f64 {
    let k = episode as f64;
    let phase = 1.7 * k;
    4.0 * ((2.5 + 0.6 * k) * t + phase).sin() + 2.5 * ((6.0 + 0.5 * k) * t).sin()
}

/// Returns the force that the model lacks, N.
fn extra(truth: Truth, x: f64, v: f64) -> f64 {
    match truth {
        Truth::Coulomb(force) => -force * (v / 5e-3).tanh(),
        Truth::UnevenFriction([force, offset]) => -force * (v / 5e-3).tanh() - offset,
        Truth::Viscous(d) => -d * v,
        Truth::Spring(k) => -k * x,
        Truth::Ordinary(k) => -0.25 * v - 0.05 * (v / 5e-3).tanh() - k * x,
        Truth::Magnet(force) => {
            let s = (x - 0.05) / 0.04;
            -force * s * (-0.5 * s * s).exp()
        }
        _ => 0.0,
    }
}

/// Returns the command that the drive gets, N: held for 10 ms, and late by the delay.
fn arriving(truth: Truth, episode: usize, t: f64) -> f64 {
    let late = match truth {
        Truth::Delay(tau) => tau,
        Truth::Ordinary(_) => 0.0015,
        _ => 0.0,
    };
    // Half a step of the integrator off the edge, so that rounding has no effect.
    let row = ((t - late + 5e-5) / 0.01).floor().max(0.0);
    let asked = command(episode, row * 0.01);
    match truth {
        Truth::Limit(most) => asked.clamp(-most, most),
        _ => asked,
    }
}

/// One episode as a log.
pub fn log(truth: Truth, episode: usize) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(77 + episode as u64);
    let mut normal = || -> f64 {
        // The sum of twelve uniform numbers is approximately normal.
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    };
    let (mut x, mut v) = (0.0, 0.0);
    let h = 1e-4;
    let mut text = "time,ctrl.belt,x,dx,qpos.rail,qvel.rail\n".to_owned();
    for row in 0..(SECONDS / 0.01) as usize {
        let time = row as f64 * 0.01;
        let bias = if let Truth::SensorBias(b) = truth {
            b
        } else {
            0.0
        };
        let seen = match truth {
            Truth::Noise => [0.0, 0.0],
            _ => [x + bias, v],
        };
        let mut readings = [seen[0] + NOISE[0] * normal(), seen[1] + NOISE[1] * normal()];
        if let Truth::SpeedSteps(step) = truth {
            readings[1] = (readings[1] / step).round() * step;
        }
        let start = if row == 0 { "0,0" } else { "," };
        let u = if truth == Truth::Noise {
            0.0
        } else {
            command(episode, time)
        };
        let _ = writeln!(
            text,
            "{time:.3},{u},{},{},{start}",
            readings[0], readings[1]
        );
        for step in 0..100 {
            let t = time + f64::from(step) * h;
            let u = arriving(truth, episode, t);
            let a = |x: f64, v: f64| (u - DAMPING * v + extra(truth, x, v)) / MASS;
            let (k1, l1) = (v, a(x, v));
            let (k2, l2) = (v + h / 2.0 * l1, a(x + h / 2.0 * k1, v + h / 2.0 * l1));
            let (k3, l3) = (v + h / 2.0 * l2, a(x + h / 2.0 * k2, v + h / 2.0 * l2));
            let (k4, l4) = (v + h * l3, a(x + h * k3, v + h * l3));
            x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
        }
    }
    text
}

/// Writes a study of four training and two test episodes of a model, with one parameter.
pub fn write_files(folder: &Path, model: &str, parameter: &str, log: impl Fn(usize) -> String) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("nominal.xml"), model).unwrap();
    for episode in 0..6 {
        let kind = if episode < 4 { "train" } else { "test" };
        let name = format!("{kind}_{episode}.csv");
        std::fs::write(folder.join(name), log(episode)).unwrap();
    }
    let study = format!(
        r#"model = "nominal.xml"
train = ["train_*.csv"]
test = ["test_*.csv"]
[[parameter]]
{parameter}
"#
    );
    std::fs::write(folder.join("study.toml"), study).unwrap();
}

/// Writes a study of the cart.
pub fn write_study(folder: &Path, truth: Truth) {
    let mass = r#"name = "mass"
target = "geom/cart/mass"
range = [0.4, 3.0]
unit = "kg""#;
    write_files(folder, NOMINAL, mass, |episode| log(truth, episode));
}
