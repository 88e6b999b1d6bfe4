//! MuJoCo's model behind the contract.

use std::sync::Arc;

use asid_core::{BatchConfig, Model, Result, Scene, Simulator};
use asid_core::{Layout, Target};
use mujoco_rs::mujoco_c::mjtEnableBit;

use crate::compiled::{Compiled, compile, refused};
use crate::layout::layout;
use crate::parameter::Plan;
use crate::simulator::MujocoSimulator;
use crate::target::Column;

/// A scene compiled by MuJoCo.
pub struct MujocoModel {
    compiled: Arc<Compiled>,
}

impl MujocoModel {
    /// Compiles a scene.
    ///
    /// # Errors
    /// [`asid_core::Error::Scene`] with MuJoCo's message where it refuses the document. Also for
    /// sleeping trees, whose bookkeeping is not part of a state, and for actuators with several
    /// inputs: a batch cannot hold either.
    pub fn load(scene: &Scene) -> Result<Self> {
        let model = compile(scene, true)?;
        if model.opt().enableflags & mjtEnableBit::mjENBL_SLEEP as i32 != 0 {
            return Err(refused(
                scene,
                "sleeping is enabled, but a sleeping simulation cannot be restored exactly; remove sleep=\"enable\" from <flag>",
            ));
        }
        let layout = layout(scene.name(), &model)?;
        Ok(Self {
            compiled: Arc::new(Compiled {
                scene: scene.clone(),
                model,
                layout,
            }),
        })
    }
}

impl Model for MujocoModel {
    fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    fn engine(&self) -> String {
        format!("mujoco {}", crate::VERSION)
    }

    fn remembers_commands(&self) -> bool {
        let model = &self.compiled.model;
        let buffers = model.actuator_historyadr();
        model.na() > 0 || buffers.iter().any(|at| *at >= 0)
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        Ok(Column::resolve(&self.compiled, target)?.nominal)
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        let plan = Plan::new(&self.compiled, &config.targets)?;
        Ok(Box::new(MujocoSimulator::new(
            self.compiled.clone(),
            plan,
            config,
        )?))
    }
}
