//! Hashes of files by what they hold.
//!
//! A model may consist of several files: those that it includes, those of its meshes, height fields
//! and textures, and the model that it refines. All of them count.

use std::path::{Path, PathBuf};

use asid_core::Scene;
use asid_documents::{toml_text, xml};
use sha2::{Digest, Sha256};

/// Key under which a refined model names the model that it refines.
const MODEL: &str = "model";

/// Longest chain of refined models of refined models that is followed: as many as can be opened.
const MAX_DEPTH: usize = 8;

/// Text between the path of a recorded plugin and its SHA-256.
pub const PLUGIN_HASH: &str = "#sha256=";

/// Length of a hash in hexadecimal digits: 64 bits distinguish all settings that a person makes.
pub(crate) const DIGITS: usize = 16;

/// The first `DIGITS` hexadecimal digits of SHA-256.
#[must_use]
pub fn digest(bytes: &[u8]) -> String {
    let all: String = Sha256::digest(bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    all[..DIGITS].to_owned()
}

/// Hash of a file as `sha256:…`; `None` where it cannot be read.
pub(crate) fn of_file(path: &Path) -> Option<String> {
    let bytes = std::fs::read(path).ok()?;
    Some(format!("sha256:{}", digest(&bytes)))
}

/// Hash of a model's file; that of a refined model covers the model it refines.
pub(crate) fn of_model(path: &Path) -> Option<String> {
    of_chain(path, MAX_DEPTH)
}

/// As [`of_model`], at most `depth` refined models deep.
fn of_chain(path: &Path, depth: usize) -> Option<String> {
    if path.extension().is_none_or(|e| e != "toml") {
        return of_document(path);
    }
    let text = std::fs::read_to_string(path).ok()?;
    let Ok(mut table) = toml_text::read::<toml::Table>(&text) else {
        return of_file(path);
    };
    if let Some(toml::Value::String(model)) = table.get_mut(MODEL)
        && depth > 0
    {
        let named = path.parent().unwrap_or(Path::new("")).join(&*model);
        if let Some(contents) = of_chain(&named, depth - 1) {
            *model = contents;
        }
    }
    Some(format!("sha256:{}", digest(table.to_string().as_bytes())))
}

/// Hash of an MJCF document: of its text with all that it includes, followed by the hashes of its
/// assets. A document of one file has that file's hash.
fn of_document(path: &Path) -> Option<String> {
    let Ok(scene) = Scene::from_file(path) else {
        return of_file(path);
    };
    let mut whole = scene.xml().to_owned();
    let mut open = assets(&scene);
    let mut seen: Vec<PathBuf> = Vec::new();
    while let Some(file) = open.pop() {
        let file = file.canonicalize().unwrap_or(file);
        if seen.contains(&file) {
            continue;
        }
        // A model that is attached has assets of its own.
        let attached = file.extension().is_some_and(|e| e == "xml");
        match attached.then(|| Scene::from_file(&file)) {
            Some(Ok(scene)) => {
                whole += &digest(scene.xml().as_bytes());
                open.extend(assets(&scene));
            }
            _ => whole += &of_file(&file).unwrap_or_default(),
        }
        seen.push(file);
    }
    Some(format!("sha256:{}", digest(whole.as_bytes())))
}

/// The files that a document names, its includes apart, as far as they exist.
fn assets(scene: &Scene) -> Vec<PathBuf> {
    let Ok(document) = xml::parse(scene.name(), scene.xml()) else {
        return Vec::new();
    };
    let base = scene.directory().unwrap_or(Path::new(""));
    let mut folders = vec![base.to_owned()];
    for compiler in document
        .descendants()
        .filter(|n| n.has_tag_name("compiler"))
    {
        let named = ["assetdir", "meshdir", "texturedir"];
        let named = named.iter().filter_map(|key| compiler.attribute(*key));
        folders.extend(named.map(|folder| base.join(folder)));
    }
    // `file`, and `fileright` to `fileback` of the sides of a cube.
    let attributes = document.descendants().flat_map(|n| n.attributes());
    let files = attributes.filter(|a| a.name().starts_with("file"));
    files
        .flat_map(|a| folders.iter().map(move |folder| folder.join(a.value())))
        .filter(|file| file.is_file())
        .collect()
}
