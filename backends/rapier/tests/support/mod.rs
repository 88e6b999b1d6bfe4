//! Helpers: a scene, a batch and named readings.

#![allow(dead_code, clippy::unwrap_used)]

use asid_core::{Backend, BatchConfig, Control, Rollout, Scene, Simulator, Target};
use asid_rapier::Rapier;

/// A batch of one scene with the recorded channels by name.
pub struct Bench {
    pub simulator: Box<dyn Simulator>,
    pub channels: Vec<String>,
}

/// Wraps the content of a document.
pub fn scene(inside: &str) -> Scene {
    let xml = format!("<mujoco><compiler angle=\"radian\"/>{inside}</mujoco>");
    Scene::from_xml("test", &xml, &[]).unwrap()
}

impl Bench {
    pub fn new(inside: &str, channels: &[&str]) -> Self {
        Self::with(&scene(inside), channels, 1, 1, &[])
    }

    pub fn with(
        scene: &Scene,
        channels: &[&str],
        size: usize,
        threads: usize,
        targets: &[&str],
    ) -> Self {
        let model = Rapier.load(scene).unwrap();
        let targets: Vec<Target> = targets.iter().map(|t| t.parse().unwrap()).collect();
        let config = BatchConfig {
            size,
            threads,
            targets,
        };
        Self {
            simulator: model.simulator(&config).unwrap(),
            channels: channels.iter().map(|c| (*c).to_owned()).collect(),
        }
    }

    pub fn all(&self) -> Vec<usize> {
        (0..self.simulator.batch_size()).collect()
    }

    /// Runs all simulations with one constant command, and returns every frame's row, simulation by
    /// simulation.
    pub fn run(&mut self, frames: usize, ctrl: &[f64]) -> Vec<Vec<f64>> {
        let controls: Vec<f64> = ctrl
            .iter()
            .copied()
            .cycle()
            .take(frames * ctrl.len())
            .collect();
        let record = self.simulator.layout().recording(&self.channels).unwrap();
        let sims = self.all();
        let mut out = vec![0.0; sims.len() * frames * record.width()];
        let rollout = Rollout::new(&sims, frames, 1, Control::Shared(&controls), &record);
        self.simulator.rollout(&rollout, &mut out).unwrap();
        out.chunks(record.width().max(1))
            .map(<[f64]>::to_vec)
            .collect()
    }

    pub fn read(&mut self) -> Vec<f64> {
        let record = self.simulator.layout().recording(&self.channels).unwrap();
        let sims = self.all();
        let mut out = vec![0.0; sims.len() * record.width()];
        self.simulator.read(&sims, &record, &mut out).unwrap();
        out
    }

    pub fn place(&mut self, qpos: &[f64], qvel: &[f64]) {
        self.simulator.set_state(&[0], qpos, qvel).unwrap();
    }
}
