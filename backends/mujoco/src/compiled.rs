//! MuJoCo's compilation of a document.

use std::borrow::Cow;

use asid_core::{Error, Layout, Result, Scene};
use mujoco_rs::wrappers::mj_editing::{MjSpec, MjsBody};
use mujoco_rs::wrappers::mj_model::MjModel;

use crate::{contact, ffi};

/// Data shared by all batches of one compiled scene.
pub struct Compiled {
    /// The document.
    pub scene: Scene,
    /// MuJoCo's model of it.
    pub model: MjModel,
    /// Names and indices.
    pub layout: Layout,
}

/// Compiles a scene with MuJoCo.
///
/// `simple` allows MuJoCo's shortcuts for bodies whose inertia happens to be diagonal. A batch that
/// moves centres of mass must not use them, because the sparsity of the inertia matrix is fixed at
/// compilation.
///
/// # Errors
/// [`Error::Scene`] with MuJoCo's message in one line.
pub fn compile(scene: &Scene, simple: bool) -> Result<MjModel> {
    if scene.xml().contains('\0') {
        return Err(refused(scene, "the document holds a NUL character"));
    }
    let xml = with_models_found(scene)?;
    let mut spec = MjSpec::from_xml_string(&xml).map_err(|e| refused(scene, &e))?;
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
    if !contact::is_possible(&model) {
        ffi::disable_contacts(&mut model);
    }
    Ok(model)
}

/// The document with the paths of attached models from the scene's folder on: MuJoCo opens them while
/// it parses, when it does not know the folder yet.
fn with_models_found(scene: &Scene) -> Result<Cow<'_, str>> {
    let Some(folder) = scene.directory().filter(|_| scene.xml().contains("<model")) else {
        return Ok(Cow::Borrowed(scene.xml()));
    };
    let document = asid_documents::xml::parse(scene.name(), scene.xml())?;
    let models = document.descendants().filter(|n| n.has_tag_name("model"));
    let mut files: Vec<_> = models.filter_map(|n| n.attribute_node("file")).collect();
    files.sort_by_key(|file| std::cmp::Reverse(file.range_value().start));
    let mut xml = scene.xml().to_owned();
    for file in files {
        let path = folder.join(file.value());
        let path = path.display().to_string();
        let path = path.replace('&', "&amp;").replace('<', "&lt;");
        xml.replace_range(file.range_value(), &path.replace('"', "&quot;"));
    }
    Ok(Cow::Owned(xml))
}

fn forbid_simple(body: &mut MjsBody) {
    for child in body.body_iter_mut() {
        child.set_simple(false);
        forbid_simple(child);
    }
}

/// Error for a document that cannot be used, with the reason in one line.
pub fn refused(scene: &Scene, message: &(impl ToString + ?Sized)) -> Error {
    Error::Scene {
        scene: scene.name().to_owned(),
        message: asid_documents::guard::one_line(&message.to_string()),
    }
}
