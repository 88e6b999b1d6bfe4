//! A scene on each engine, with and without effects.

use std::sync::Arc;

use asid::core::registry::{BackendEntry, all};
use asid::core::{
    Backend, BatchConfig, Capabilities, Control, Model as _, Rollout, Scene, Simulator, Target,
};
use asid::effects::EffectEntry;
use asid::effects::refined::{Refined, counts_episodes, needs};
use asid::effects::{Effect, EffectSpec};
use asid::mjcf::Plant;

/// Engines with the needed capabilities.
pub fn engines(needed: Capabilities) -> Vec<Box<dyn Backend>> {
    let made = all::<BackendEntry>()
        .into_iter()
        .map(|e| (e.make)().unwrap());
    made.filter(|b| b.capabilities().contains(needed)).collect()
}

/// Engines that support an effect, which is written as users write it.
pub fn engines_for(effect: &str) -> Vec<Box<dyn Backend>> {
    let spec: EffectSpec = effect.parse().unwrap();
    let entries = all::<EffectEntry>();
    let entry = entries.iter().find(|e| e.name == spec.name).unwrap();
    let effect: Box<dyn Effect> = (entry.make)();
    engines(needs(&*effect))
}

pub fn scene(xml: &str) -> Scene {
    Scene::from_xml("bench", xml, &[]).unwrap()
}

/// A simulation of a scene with effects.
pub struct Bench {
    pub engine: String,
    pub plant: Plant,
    pub simulator: Box<dyn Simulator>,
    /// Relative error of the engine's arithmetic over a run.
    pub rounding: f64,
    names: Vec<String>,
}

impl Bench {
    pub fn new(backend: &dyn Backend, xml: &str, effects: &[&str]) -> Self {
        Self::with_values(backend, xml, &[], effects)
    }

    /// The same with other values of some targets than the document's.
    pub fn with_values(
        backend: &dyn Backend,
        xml: &str,
        values: &[(&str, f64)],
        effects: &[&str],
    ) -> Self {
        let scene = scene(xml);
        let specs: Vec<EffectSpec> = effects.iter().map(|e| e.parse().unwrap()).collect();
        let values = values.iter().map(|(t, v)| (t.parse().unwrap(), *v));
        let values: Vec<(Target, f64)> = values.collect();
        let plant = Arc::new(Plant::of(&scene).unwrap());
        let model = backend.load(&scene).unwrap();
        let model = Refined::new(backend, model, plant, &values, &specs)
            .unwrap_or_else(|e| panic!("{}, {effects:?}: {e}", backend.name()));
        let config = BatchConfig {
            size: 1,
            threads: 1,
            targets: counts_episodes(&*model).into_iter().collect(),
        };
        let sensors = &model.layout().sensors;
        Self {
            engine: backend.name().to_owned(),
            plant: Plant::of(&scene).unwrap(),
            names: sensors.iter().map(|s| s.name.clone()).collect(),
            simulator: model.simulator(&config).unwrap(),
            rounding: match backend
                .capabilities()
                .contains(Capabilities::DOUBLE_PRECISION)
            {
                true => 1e-9,
                false => 2e-4,
            },
        }
    }

    /// Begins the episode of the logs with this number.
    pub fn episode(&mut self, number: usize) -> &mut Self {
        self.simulator.reset(&[0]).unwrap();
        self.simulator
            .set_parameters(&[0], &[number as f64])
            .unwrap();
        self
    }

    pub fn state(&mut self, qpos: &[f64], qvel: &[f64]) -> &mut Self {
        self.simulator.set_state(&[0], qpos, qvel).unwrap();
        self
    }

    /// All sensors after each frame of `substeps` steps, with one command per frame.
    pub fn run(&mut self, substeps: usize, commands: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let recording = self.plant.layout.recording(&self.names).unwrap();
        let control = commands.concat();
        let control = Control::Shared(&control);
        let frames = commands.len();
        let rollout = Rollout::new(&[0], frames, substeps, control, &recording);
        let mut out = vec![0.0; frames * recording.width()];
        self.simulator.rollout(&rollout, &mut out).unwrap();
        assert!(self.simulator.status()[0].is_running(), "{}", self.engine);
        out.chunks_exact(recording.width()).map(Vec::from).collect()
    }

    /// The same with a constant command over frames of one step.
    pub fn hold(&mut self, frames: usize, command: &[f64]) -> Vec<Vec<f64>> {
        self.run(1, &vec![command.to_vec(); frames])
    }
}

/// Engines that support an effect and can load a scene.
pub fn engines_that_load(effect: &str, xml: &str) -> Vec<Box<dyn Backend>> {
    let scene = scene(xml);
    let engines = engines_for(effect).into_iter();
    engines.filter(|b| b.load(&scene).is_ok()).collect()
}

/// Runs a check on each engine that supports the effects.
pub fn on_each(xml: &str, effects: &[&str], mut check: impl FnMut(&mut Bench)) {
    let able = engines_for(effects.first().unwrap_or(&"viscous-friction"));
    for backend in able {
        if effects
            .iter()
            .all(|e| engines_for(e).iter().any(|b| b.name() == backend.name()))
        {
            check(&mut Bench::new(&*backend, xml, effects));
        }
    }
}

/// Asserts that a value agrees with theory within an absolute tolerance.
#[track_caller]
pub fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found}, expected {expected} within {tolerance}"
    );
}
