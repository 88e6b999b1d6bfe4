//! A real machine that is a scene simulated by the engine.

use asid::core::{BatchConfig, Control, Recording, Rollout, Scene, Simulator};

use crate::diagnosis_support::engine;

/// A simulation of a scene, with the sensors that are read.
pub struct Player {
    simulator: Box<dyn Simulator>,
    recording: Recording,
    substeps: usize,
}

impl Player {
    /// Loads a scene to read some sensors in every row; row and time step are in seconds.
    pub fn of(xml: &str, sensors: &[&str], [row, step]: [f64; 2]) -> Self {
        let scene = Scene::from_xml("machine", xml, &[]).unwrap();
        let model = engine().load(&scene).unwrap();
        let config = BatchConfig {
            size: 1,
            threads: 1,
            targets: Vec::new(),
        };
        Self {
            simulator: model.simulator(&config).unwrap(),
            recording: model.layout().recording(sensors).unwrap(),
            substeps: (row / step).round() as usize,
        }
    }

    /// Returns readings (`rows x width`) from an initial state on.
    ///
    /// The first row reads the initial state. Each further row is read at the end of a row of
    /// `commands` (`rows - 1 x actuators`).
    pub fn play(
        &mut self,
        (qpos, qvel): (&[f64], &[f64]),
        commands: &[f64],
        rows: usize,
    ) -> Vec<f64> {
        self.simulator.reset(&[0]).unwrap();
        self.simulator.set_state(&[0], qpos, qvel).unwrap();
        let width = self.recording.width();
        let mut out = vec![0.0; rows * width];
        let control = Control::Shared(commands);
        let (first, later) = out.split_at_mut(width);
        self.simulator.read(&[0], &self.recording, first).unwrap();
        let rollout = Rollout::new(&[0], rows - 1, self.substeps, control, &self.recording);
        self.simulator.rollout(&rollout, later).unwrap();
        out
    }
}
