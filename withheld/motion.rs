//! The plan of one episode: its initial state and its commands.

use rand::Rng;
use std::f64::consts::TAU;

use crate::anatomy::{Anatomy, JointKind};
use crate::machine::Command;

/// Number of sines in a command.
const SINES: usize = 5;
/// Time over which a command fades in from its centre, s, so that a servo does not get a jump.
const FADE: f64 = 0.15;

/// A planned episode.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Initial position.
    pub qpos: Vec<f64>,
    /// Initial velocity.
    pub qvel: Vec<f64>,
    /// Commands, rows x actuators, each held for one row.
    pub commands: Vec<f64>,
    /// Number of rows.
    pub rows: usize,
    /// Time between rows, s.
    pub period: f64,
}

/// How the episodes of a case are planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Length, s.
    pub seconds: f64,
    /// Rows per second.
    pub rate: f64,
    /// Factor of all amplitudes and spreads: 1, or less for a case with too little excitation.
    pub vigour: f64,
    /// Initial share of the episode during which commands rest.
    pub rest: f64,
}

impl Motion {
    /// Draws an episode.
    #[must_use]
    pub fn draw(anatomy: &Anatomy, style: Style, random: &mut impl Rng) -> Self {
        let period = 1.0 / style.rate;
        let rows = (style.seconds * style.rate).round() as usize + 1;
        let nu = anatomy.drives.len();
        let mut commands = vec![0.0; rows * nu];
        for (u, drive) in anatomy.drives.iter().enumerate() {
            let mut all = anatomy.machine.commands.iter();
            let Some(command) = all.find(|c| c.actuator == drive.name) else {
                continue;
            };
            let sines = sines(command, random);
            for row in 0..rows {
                let time = row as f64 * period - style.rest * style.seconds;
                let fade = (time / FADE).clamp(0.0, 1.0);
                let sum: f64 = sines
                    .iter()
                    .map(|(a, f, p)| a * (TAU * f * time + p).sin())
                    .sum();
                let value = command.center + style.vigour * fade * sum;
                // A log holds six decimals of a command, so the machine gets the same rounded
                // value.
                commands[row * nu + u] = round(value, 6);
            }
        }
        let (qpos, qvel) = start(anatomy, style.vigour, random);
        Self {
            qpos,
            qvel,
            commands,
            rows,
            period,
        }
    }
}

/// Rounds a number to the given decimals.
#[must_use]
pub fn round(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale
}

/// Amplitude, frequency and phase of each sine; the amplitudes add up to the command's.
fn sines(command: &Command, random: &mut impl Rng) -> Vec<(f64, f64, f64)> {
    let [low, high] = command.band;
    let mut all: Vec<(f64, f64, f64)> = (0..SINES)
        .map(|i| {
            let share = (i as f64 + random.random::<f64>()) / SINES as f64;
            let frequency = low * (high / low).powf(share);
            let weight = 0.3 + random.random::<f64>();
            (weight, frequency, TAU * random.random::<f64>())
        })
        .collect();
    let total: f64 = all.iter().map(|s| s.0).sum();
    for s in &mut all {
        s.0 *= command.amplitude / total;
    }
    all
}

fn start(anatomy: &Anatomy, vigour: f64, random: &mut impl Rng) -> (Vec<f64>, Vec<f64>) {
    let mut qpos = anatomy.qpos0.clone();
    let mut qvel = vec![0.0; anatomy.nv];
    let mut draw = |[center, spread]: [f64; 2]| {
        let value = center + vigour * spread * random.random_range(-1.0..=1.0);
        round(value, 9)
    };
    for joint in &anatomy.joints {
        let mut all = anatomy.machine.starts.iter();
        let Some(s) = all.find(|s| s.joint == joint.name) else {
            continue;
        };
        let position: Vec<f64> = s.position.iter().map(|&p| draw(p)).collect();
        let velocity: Vec<f64> = s.velocity.iter().map(|&v| draw(v)).collect();
        qvel[joint.dof..joint.dof + velocity.len()].copy_from_slice(&velocity);
        if joint.kind == JointKind::Free {
            qpos[joint.qpos..joint.qpos + 3].copy_from_slice(&position[..3]);
            let yaw = position.get(3).copied().unwrap_or(0.0);
            let quaternion = [(yaw / 2.0).cos(), 0.0, 0.0, (yaw / 2.0).sin()];
            qpos[joint.qpos + 3..joint.qpos + 7].copy_from_slice(&quaternion);
        } else {
            qpos[joint.qpos..joint.qpos + position.len()].copy_from_slice(&position);
        }
    }
    (qpos, qvel)
}
