//! A scene compiled by MuJoCo.

use std::sync::Arc;

use asid_core::{BatchConfig, Error, Model, Result, Scene, Simulator};
use asid_core::{Layout, Target};
use mujoco_rs::mujoco_c::mjtEnableBit;
use mujoco_rs::wrappers::mj_editing::{MjSpec, MjsBody};
use mujoco_rs::wrappers::mj_model::MjModel;

use crate::ffi;
use crate::layout::layout;
use crate::parameter::Plan;
use crate::simulator::MujocoSimulator;
use crate::target::Column;

/// What all batches of one compiled scene share.
pub struct Compiled {
    /// The document.
    pub scene: Scene,
    /// MuJoCo's model of it.
    pub model: MjModel,
    /// Names and places.
    pub layout: Layout,
}

/// A scene compiled by MuJoCo.
pub struct MujocoModel {
    compiled: Arc<Compiled>,
}

impl MujocoModel {
    /// Compiles a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] with MuJoCo's message where it refuses the document, and
    /// for what a batch cannot hold: sleeping trees (their bookkeeping is not
    /// part of a state) and actuators with several inputs.
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

/// Compiles a scene with MuJoCo.
///
/// `simple` allows MuJoCo's shortcuts for bodies whose inertia happens to be
/// diagonal. A batch that moves centres of mass must do without: the sparsity
/// of the inertia matrix is fixed when the model is compiled.
///
/// # Errors
/// [`Error::Scene`] with MuJoCo's message in one line.
pub fn compile(scene: &Scene, simple: bool) -> Result<MjModel> {
    if scene.xml().contains('\0') {
        return Err(refused(scene, "the document holds a NUL character"));
    }
    let mut spec = MjSpec::from_xml_string(scene.xml()).map_err(|e| refused(scene, &e))?;
    if let Some(folder) = scene.directory().and_then(|d| d.to_str())
        && !folder.is_empty()
    {
        spec.set_modelfiledir(folder);
    }
    if !simple {
        forbid_simple(spec.world_body_mut());
    }
    let mut model = spec.compile().map_err(|e| refused(scene, &e))?;
    ffi::disable_autoreset(&mut model);
    Ok(model)
}

fn forbid_simple(body: &mut MjsBody) {
    for child in body.body_iter_mut() {
        child.set_simple(false);
        forbid_simple(child);
    }
}

fn refused(scene: &Scene, message: &(impl ToString + ?Sized)) -> Error {
    Error::Scene {
        scene: scene.name().to_owned(),
        message: ffi::one_line(&message.to_string()),
    }
}
