//! Engines: models, simulators, and the hooks passed to them.

use std::ops::Deref;
use std::sync::Arc;

use super::Across;
use asid_core::backend::{Backend, Capabilities, Model};
use asid_core::error::Result;
use asid_core::layout::{Layout, Recording};
use asid_core::scene::Scene;
use asid_core::simulator::{BatchConfig, Rollout, Simulator, Snapshot, Status, StepHook};
use asid_core::target::Target;

impl Backend for Across<Box<dyn Backend>> {
    fn name(&self) -> &str {
        self.name
            .unwrap_or_else(|| self.run(|backend| backend.name()))
    }

    fn version(&self) -> String {
        self.run(|backend| backend.version())
    }

    fn capabilities(&self) -> Capabilities {
        self.run(|backend| backend.capabilities())
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        let model = self.try_run(|backend| backend.load(scene))?;
        Ok(Arc::new(Across::new(model, self.border)))
    }
}

impl<T> Model for Across<T>
where
    T: Deref + Send + Sync,
    T::Target: Model,
{
    fn layout(&self) -> &Layout {
        self.run(|model| model.layout())
    }

    fn engine(&self) -> String {
        self.run(|model| model.engine())
    }

    fn remembers_commands(&self) -> bool {
        self.run(|model| model.remembers_commands())
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        self.try_run(|model| model.nominal(target))
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        let simulator = self.try_run(|model| model.simulator(config))?;
        Ok(Box::new(Across::new(simulator, self.border)))
    }
}

impl Simulator for Across<Box<dyn Simulator>> {
    fn layout(&self) -> &Layout {
        self.run(|simulator| simulator.layout())
    }

    fn batch_size(&self) -> usize {
        self.run(|simulator| simulator.batch_size())
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.set_parameters(sims, values))
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.reset(sims))
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.set_state(sims, qpos, qvel))
    }

    fn displace(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.displace(sims, qpos, qvel))
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        let back = self.border.back();
        let hook = rollout.hook.map(|hook| Across::new(hook, back));
        let rollout = Rollout {
            hook: hook.as_ref().map(|hook| hook as &dyn StepHook),
            ..*rollout
        };
        self.try_run_mut(|simulator| simulator.rollout(&rollout, out))
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.read(sims, record, out))
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        self.try_run_mut(|simulator| simulator.save(sims))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.load(snapshot, rows, sims))
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        self.try_run_mut(|simulator| simulator.copy_state(from, to))
    }

    fn status(&self) -> &[Status] {
        self.run(|simulator| simulator.status())
    }

    fn steps_taken(&self) -> u64 {
        self.run(|simulator| simulator.steps_taken())
    }
}
