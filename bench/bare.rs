//! The engines' own bare loops: what a person would write who has only the engine.

use anyhow::Result;
use asid_core::Scene;
use asid_rapier::bare::{BareScene, BareWorld};

use crate::workload::Workload;

/// Simulations that are stepped in plain loops, one after the other on each thread.
pub trait Bare {
    /// Puts every simulation at its start. Not part of what is measured.
    ///
    /// # Errors
    /// When the engine refuses a state.
    fn rewind(&mut self) -> Result<()>;

    /// Runs all of them once, spread evenly over `threads`.
    fn run(&mut self, threads: usize);
}

/// The bare loop of an engine.
///
/// # Errors
/// When the engine has none here or refuses the scene.
pub fn bare<'a>(engine: &str, scene: &Scene, work: &'a Workload) -> Result<Box<dyn Bare + 'a>> {
    match engine {
        "rapier" => Ok(Box::new(Rapier {
            scene: BareScene::new(scene, &work.targets)?,
            worlds: Vec::new(),
            work,
        })),
        #[cfg(feature = "mujoco")]
        "mujoco" => Ok(Box::new(crate::mujoco::Mujoco::new(scene, work)?)),
        other => anyhow::bail!("no bare loop for engine `{other}`"),
    }
}

struct Rapier<'a> {
    scene: BareScene,
    worlds: Vec<BareWorld>,
    work: &'a Workload,
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
}
