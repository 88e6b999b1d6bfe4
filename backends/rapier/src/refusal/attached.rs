//! Documents that a document attaches: what MuJoCo takes over from them is checked as well.

use std::path::Path;

use asid_core::{Result, Scene};
use roxmltree::Node;

use super::{check_document, refuse};

/// Checks the documents that a document attaches, and those that they attach.
pub(super) fn check(scene: &Scene) -> Result<()> {
    if !scene.xml().contains("<attach") {
        return Ok(());
    }
    let document = roxmltree::Document::parse(scene.xml())
        .map_err(|e| refuse(scene, format!("cannot read it: {e}")))?;
    let folder = scene.directory().unwrap_or(Path::new(""));
    let all = || document.descendants();
    let assets = all().filter(|n| n.parent().is_some_and(|p| p.has_tag_name("asset")));
    for model in assets.filter(|n| n.has_tag_name("model")) {
        let attaches = all().filter(|n| n.has_tag_name("attach"));
        let bodies: Vec<&str> = attaches
            .filter(|n| n.attribute("model") == model.attribute("name"))
            .filter_map(|n| n.attribute("body"))
            .collect();
        let Some(file) = model.attribute("file").filter(|_| !bodies.is_empty()) else {
            continue;
        };
        let attached = Scene::from_file(&folder.join(file))?;
        check_document(&attached, Some(&bodies))?;
        check(&attached)?;
    }
    Ok(())
}

/// Whether MuJoCo takes over an element of a document of which it attaches some bodies.
///
/// The document's options stay behind, and so do its other bodies.
pub(super) fn is_taken(node: &Node<'_, '_>, bodies: &[&str]) -> bool {
    let within = |tag: &str| node.ancestors().any(|a| a.has_tag_name(tag));
    let in_bodies = node.ancestors().any(|a| {
        a.has_tag_name("body") && a.attribute("name").is_some_and(|n| bodies.contains(&n))
    });
    !within("option") && (in_bodies || !within("worldbody"))
}
