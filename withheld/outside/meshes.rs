//! Leaves out the meshes of a model of other authors, unless a body gets its mass from them.
//!
//! A mesh is a file beside the model, and a study does not carry it. It gives a body its look, its
//! contacts and, without an `<inertial>`, its mass. Without meshes such a machine touches with its
//! other geoms alone.

use crate::document::Element;

/// Removes all meshes from the bodies of a model.
///
/// A body without an `<inertial>` and without a joint of its own loses the mass of its meshes. A
/// body fixed to the ground needs no mass; a fixed part of a moving body stays without its own
/// mass.
///
/// # Errors
/// Returns a sentence on the first mesh that gives its mass to a body with a joint.
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
