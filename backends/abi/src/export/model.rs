//! Functions of the table that work on an engine and on its compiled scenes.

use std::path::PathBuf;
use std::sync::Mutex;

use asid_core::{BatchConfig, Error, Result, Scene, Target};

use super::handles::{BATCHES, BatchEntry, MODELS, ModelEntry};
use super::{Export, guard};
use crate::layout::LayoutTable;
use crate::slices;
use crate::table::{self, Code};
use crate::text;

/// `load`.
pub unsafe extern "C" fn load<E: Export>(
    scene: *const table::Scene,
    model: *mut *mut table::Model,
    error: *mut table::Error,
) -> Code {
    let body = || {
        // SAFETY: the host passes a scene and a place for the handle.
        let (scene, place) = unsafe { (read_scene(scene)?, &mut *model) };
        let loaded = E::backend()?.load(&scene)?;
        *place = MODELS.insert(ModelEntry {
            layout: LayoutTable::new(loaded.layout()),
            model: loaded,
        });
        Ok(())
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// The scene in this side's form.
///
/// # Safety
/// `scene` points to a structure as the header describes it.
unsafe fn read_scene(scene: *const table::Scene) -> Result<Scene> {
    // SAFETY: as the caller promises.
    let (name, xml, directory) = unsafe {
        let scene = &*scene;
        let directory = match scene.directory.is_null() {
            true => None,
            false => Some(PathBuf::from(text::read(scene.directory, "the directory")?)),
        };
        (
            text::read(scene.name, "the scene's name")?,
            text::read(scene.xml, "the document")?,
            directory,
        )
    };
    Ok(Scene::from_xml(&name, &xml, &[])?.in_directory(directory))
}

/// `destroy_model`.
pub unsafe extern "C" fn destroy(model: *mut table::Model) {
    let body = || {
        drop(MODELS.remove(model));
        Ok(())
    };
    // SAFETY: no error is written.
    unsafe { guard(std::ptr::null_mut(), body) };
}

/// `layout`.
pub unsafe extern "C" fn layout(model: *const table::Model) -> *const table::Layout {
    // The entry keeps its address until the model is destroyed.
    MODELS
        .get(model)
        .map_or(std::ptr::null(), |m| std::ptr::from_ref(m.layout.table()))
}

/// `nominal`.
pub unsafe extern "C" fn nominal(
    model: *const table::Model,
    target: *const table::Target,
    value: *mut f64,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let entry = MODELS.get(model)?;
        // SAFETY: the host passes a target and a place for the value.
        let (target, place) = unsafe { (read_target(&*target)?, &mut *value) };
        *place = entry.model.nominal(&target)?;
        Ok(())
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}

/// Reads a target.
///
/// # Safety
/// The names are null or zero-terminated.
unsafe fn read_target(target: &table::Target) -> Result<Target> {
    // SAFETY: as the caller promises.
    unsafe {
        Ok(Target {
            element: text::read(target.element, "the target's element")?,
            name: text::read(target.name, "the target's name")?,
            attribute: text::read(target.attribute, "the target's attribute")?,
            index: usize::try_from(target.index).unwrap_or(usize::MAX),
        })
    }
}

/// `make_batch`.
pub unsafe extern "C" fn make_batch(
    model: *const table::Model,
    config: *const table::BatchConfig,
    batch: *mut *mut table::Batch,
    error: *mut table::Error,
) -> Code {
    let body = || {
        let entry = MODELS.get(model)?;
        // SAFETY: the host passes a configuration with `target_count` targets, and
        // a place for the handle.
        let (config, place) = unsafe {
            let config = &*config;
            let targets = slices::read(config.targets, config.target_count, "the targets")?
                .iter()
                .map(|t| read_target(t))
                .collect::<Result<Vec<_>>>()?;
            let number = |n: u64, what: &str| {
                usize::try_from(n).map_err(|_| Error::Config {
                    key: what.into(),
                    message: format!("{n} is too many"),
                })
            };
            let config = BatchConfig {
                size: number(config.batch_size, "size")?,
                threads: number(config.threads, "threads")?,
                targets,
            };
            (config, &mut *batch)
        };
        let simulator = entry.model.simulator(&config)?;
        *place = BATCHES.insert(BatchEntry {
            simulator: Mutex::new(Some(simulator)),
            layout: entry.model.layout().clone(),
            columns: config.targets.len(),
        });
        Ok(())
    };
    // SAFETY: the host's error structure.
    unsafe { guard(error, body) }
}
