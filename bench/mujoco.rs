//! `mj_step` in a plain loop.
//!
//! Each simulation has its own `mjModel`, compiled with its parameter value, and its own `mjData`,
//! which is reset first.

use anyhow::{Context, Result, bail};
use asid_core::Scene;
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_editing::MjSpec;
use mujoco_rs::wrappers::mj_model::MjModel;

use crate::bare::Bare;
use crate::workload::Workload;

/// The simulations of a workload.
pub struct Mujoco<'a> {
    data: Vec<MjData<Box<MjModel>>>,
    work: &'a Workload,
}

impl<'a> Mujoco<'a> {
    /// Compiles the scene once for each simulation.
    ///
    /// # Errors
    /// If a target is not a geom's position, or if MuJoCo refuses the scene.
    pub fn new(scene: &Scene, work: &'a Workload) -> Result<Self> {
        let mut spec = MjSpec::from_xml_string(scene.xml()).context("MuJoCo refuses the scene")?;
        let mut data = Vec::with_capacity(work.sims);
        for i in 0..work.sims {
            for (target, &value) in work.targets.iter().zip(work.row(&work.values, i)) {
                if (target.element.as_str(), target.attribute.as_str()) != ("geom", "pos") {
                    bail!("the bare loop of MuJoCo sets positions of geoms only, not `{target}`");
                }
                let geom = spec
                    .geom_mut(&target.name)
                    .with_context(|| format!("no geom `{}`", target.name))?;
                geom.pos_mut()[target.index] = value;
            }
            let model = spec.compile().context("MuJoCo refuses the scene")?;
            data.push(MjData::new(Box::new(model)));
        }
        Ok(Self { data, work })
    }
}

impl Bare for Mujoco<'_> {
    fn rewind(&mut self) -> Result<()> {
        for (i, data) in self.data.iter_mut().enumerate() {
            data.reset();
            data.qpos_mut()
                .copy_from_slice(self.work.row(&self.work.qpos, i));
            data.qvel_mut()
                .copy_from_slice(self.work.row(&self.work.qvel, i));
        }
        Ok(())
    }

    fn run(&mut self, threads: usize) {
        let work = self.work;
        let share = work.sims.div_ceil(threads);
        let step = |first: usize, all: &mut [MjData<Box<MjModel>>]| {
            for (i, data) in all.iter_mut().enumerate() {
                for command in work.row(&work.control, first + i).chunks_exact(work.nu) {
                    data.ctrl_mut().copy_from_slice(command);
                    for _ in 0..work.substeps {
                        data.step();
                    }
                }
            }
        };
        if threads == 1 {
            step(0, &mut self.data);
            return;
        }
        std::thread::scope(|scope| {
            for (chunk, data) in self.data.chunks_mut(share).enumerate() {
                scope.spawn(move || step(chunk * share, data));
            }
        });
    }

    #[cfg(test)]
    fn qpos(&self, i: usize) -> Vec<f64> {
        self.data[i].qpos().to_vec()
    }
}
