//! A planar arm in fast motion, integrated by hand: two point masses on rods, driven at both
//! joints. Its motion is chaotic over an episode.
//!
//! The logs come from a Runge-Kutta integration with a step of 0.1 ms. The model takes steps of 2
//! ms, so at the end of an episode its integrator is off by hundreds of standard deviations of the
//! noise.

use std::fmt::Write as _;
use std::path::Path;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::world::write_files;

const NOMINAL: &str = r#"<mujoco model="arm"><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="upper">
    <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.1"/>
    <geom name="upper_ball" type="sphere" pos="0.3 0 0" size="0.01" mass="1" contype="0" conaffinity="0"/>
    <body name="fore" pos="0.3 0 0">
      <joint name="elbow" type="hinge" axis="0 1 0" damping="0.02"/>
      <geom name="fore_ball" type="sphere" pos="0.25 0 0" size="0.01" mass="0.5" contype="0" conaffinity="0"/>
    </body></body></worldbody>
  <actuator><motor name="m_shoulder" joint="shoulder"/><motor name="m_elbow" joint="elbow"/></actuator>
  <sensor><jointpos name="q_shoulder" joint="shoulder"/><jointpos name="q_elbow" joint="elbow"/></sensor>
</mujoco>
"#;

const LENGTH: [f64; 2] = [0.3, 0.25];
/// Mass of the real forearm, kg. The model has 0.5 kg.
pub const FORE: f64 = 0.6;
const UPPER: f64 = 1.0;
const DAMPING: [f64; 2] = [0.1, 0.02];
const NOISE: f64 = 1e-3;
const SECONDS: f64 = 4.0;
/// Gain of the real shoulder drive: the share of its command that it applies.
pub const GAIN: f64 = 0.75;

/// Torques at a row, N m, each held for 10 ms.
fn command(episode: usize, row: usize) -> [f64; 2] {
    let (k, t) = (episode as f64, row as f64 * 0.01);
    [
        7.0 * ((3.0 + 0.4 * k) * t + 0.9 * k).sin(),
        1.5 * ((4.5 - 0.3 * k) * t + 2.1 * k).sin(),
    ]
}

/// Joint accelerations at the given angles, speeds and torques.
fn acceleration(q: [f64; 2], v: [f64; 2], torque: [f64; 2]) -> [f64; 2] {
    let [a, b] = LENGTH;
    let ball = |m: f64| 0.4 * m * 1e-4;
    let (sin, cos) = q[1].sin_cos();
    let m22 = ball(FORE) + FORE * b * b;
    let m12 = m22 + FORE * a * b * cos;
    let m11 = ball(UPPER) + UPPER * a * a + FORE * a * a + m22 + 2.0 * FORE * a * b * cos;
    let h = FORE * a * b * sin;
    let g = 9.81;
    let lower = FORE * g * b * (q[0] + q[1]).cos();
    let f = [
        torque[0] - DAMPING[0] * v[0]
            + h * (2.0 * v[0] * v[1] + v[1] * v[1])
            + (UPPER + FORE) * g * a * q[0].cos()
            + lower,
        torque[1] - DAMPING[1] * v[1] - h * v[0] * v[0] + lower,
    ];
    let det = m11 * m22 - m12 * m12;
    [
        (m22 * f[0] - m12 * f[1]) / det,
        (m11 * f[1] - m12 * f[0]) / det,
    ]
}

fn log(episode: usize) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(5 + episode as u64);
    let mut noise = || NOISE * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
    let (mut q, mut v) = ([1.2, 0.4], [0.0; 2]);
    let h = 1e-4;
    let mut text =
        "time,ctrl.m_shoulder,ctrl.m_elbow,q_shoulder,q_elbow,qpos.shoulder,qpos.elbow,qvel.shoulder,qvel.elbow\n"
            .to_owned();
    for row in 0..(SECONDS / 0.01) as usize {
        let u = command(episode, row);
        let start = if row == 0 { "1.2,0.4,0,0" } else { ",,," };
        let _ = writeln!(
            text,
            "{:.2},{},{},{},{},{start}",
            row as f64 * 0.01,
            u[0],
            u[1],
            q[0] + noise(),
            q[1] + noise()
        );
        let torque = [GAIN * u[0], u[1]];
        for _ in 0..100 {
            let add = |x: [f64; 2], s: f64, d: [f64; 2]| [x[0] + s * d[0], x[1] + s * d[1]];
            let (k1, l1) = (v, acceleration(q, v, torque));
            let (k2, l2) = {
                let (q, v) = (add(q, h / 2.0, k1), add(v, h / 2.0, l1));
                (v, acceleration(q, v, torque))
            };
            let (k3, l3) = {
                let (q, v) = (add(q, h / 2.0, k2), add(v, h / 2.0, l2));
                (v, acceleration(q, v, torque))
            };
            let (k4, l4) = {
                let (q, v) = (add(q, h, k3), add(v, h, l3));
                (v, acceleration(q, v, torque))
            };
            for i in 0..2 {
                q[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                v[i] += h / 6.0 * (l1[i] + 2.0 * l2[i] + 2.0 * l3[i] + l4[i]);
            }
        }
    }
    text
}

/// Writes a study of the arm.
pub fn write_study(folder: &Path) {
    let mass = r#"name = "fore_mass"
target = "geom/fore_ball/mass"
range = [0.2, 1.2]"#;
    write_files(folder, NOMINAL, mass, log);
}
