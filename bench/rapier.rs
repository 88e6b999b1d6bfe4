//! Rapier's own bare loop.

use anyhow::Result;
use asid_core::Scene;
use asid_rapier::bare::{BareScene, BareWorld};

use crate::bare::Bare;
use crate::workload::Workload;

/// rapier's worlds in plain loops.
pub struct Rapier<'a> {
    scene: BareScene,
    worlds: Vec<BareWorld>,
    work: &'a Workload,
}

impl<'a> Rapier<'a> {
    /// The bare loop for a scene.
    ///
    /// # Errors
    /// If the engine refuses it.
    pub fn new(scene: &Scene, work: &'a Workload) -> Result<Self> {
        Ok(Self {
            scene: BareScene::new(scene, &work.targets)?,
            worlds: Vec::new(),
            work,
        })
    }
}

impl Bare for Rapier<'_> {
    fn rewind(&mut self) -> Result<()> {
        let w = self.work;
        self.worlds.clear();
        for i in 0..w.sims {
            let (qpos, qvel) = (w.row(&w.qpos, i), w.row(&w.qvel, i));
            let world = self.scene.world(w.row(&w.values, i), qpos, qvel)?;
            self.worlds.push(world);
        }
        Ok(())
    }

    fn run(&mut self, threads: usize) {
        let work = self.work;
        let share = work.sims.div_ceil(threads);
        let step = |first: usize, worlds: &mut [BareWorld]| {
            for (i, world) in worlds.iter_mut().enumerate() {
                world.run(work.row(&work.control, first + i), work.substeps);
            }
        };
        if threads == 1 {
            step(0, &mut self.worlds);
            return;
        }
        std::thread::scope(|scope| {
            for (chunk, worlds) in self.worlds.chunks_mut(share).enumerate() {
                scope.spawn(move || step(chunk * share, worlds));
            }
        });
    }

    #[cfg(test)]
    fn qpos(&self, i: usize) -> Vec<f64> {
        let layout = self.scene.layout();
        let (mut qpos, mut qvel) = (vec![0.0; layout.nq], vec![0.0; layout.nv]);
        self.worlds[i].coordinates(&mut qpos, &mut qvel);
        qpos
    }
}
