//! Meshes of a model that others wrote: they are left out where no mass is drawn from them.
//!
//! A mesh is a file beside the model, which a study does not carry. What it is there for is its look, its contacts and, where
//! a body has no `<inertial>`, its mass. Without meshes such a machine touches with its other geoms alone.

use crate::document::Element;

/// Leaves out the meshes of bodies that have an `<inertial>`, and of parts that no joint of their own moves: what stands
/// on the ground has no use for a mass, and a fixed part of a moving body is there without its own.
///
/// # Errors
/// A sentence on the first mesh that a body with a joint has its mass from.
pub(super) fn leave_out(document: &mut Element) -> Result<(), String> {
    match document.find_mut("worldbody", None) {
        Some(world) => clear(world),
        None => Ok(()),
    }
}

fn clear(body: &mut Element) -> Result<(), String> {
    let has = |tags: &[&str]| body.children.iter().any(|c| tags.contains(&c.tag.as_str()));
    let needed = has(&["joint", "freejoint"]) && !has(&["inertial"]);
    if let Some(mesh) = body.children.iter().find(|c| needed && is_mesh(c)) {
        let name = |e: &Element| e.get("name").unwrap_or("without a name").to_owned();
        return Err(format!(
            "<geom> `{}` in body `{}` is a mesh, whose file the generator does not copy, and the body has no <inertial>",
            name(mesh),
            name(body),
        ));
    }
    body.children.retain(|c| !is_mesh(c));
    let mut inside = body.children.iter_mut().filter(|c| c.tag == "body");
    inside.try_for_each(clear)
}

fn is_mesh(element: &Element) -> bool {
    element.tag == "geom" && (element.get("type") == Some("mesh") || element.get("mesh").is_some())
}
