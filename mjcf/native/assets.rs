//! Paths from another folder to a document's meshes and textures.

use std::path::{Component, Path, PathBuf};

use super::Writer;

impl Writer<'_, '_> {
    /// Sets the compiler's asset folders to where the scene has its assets.
    pub(super) fn write_assets(&mut self, folder: &Path) {
        let Some(home) = self.scene.directory() else {
            return;
        };
        if !self.scene.xml().contains("file=") {
            return;
        }
        let assets = self.elements.compiler("assetdir");
        for attribute in ["meshdir", "texturedir"] {
            let said = self.elements.compiler(attribute).or(assets).unwrap_or("");
            let from = absolute(&home.join(said));
            let path = relative(&absolute(folder), &from);
            let path = path.to_string_lossy().into_owned();
            match self.elements.compilers.last().copied() {
                Some(node) => self.markup.set(node, attribute, path),
                None => {
                    let path = crate::markup::escaped(&path);
                    let root = self.elements.root;
                    self.markup
                        .append(root, &format!("  <compiler {attribute}=\"{path}\"/>\n"));
                }
            }
        }
    }
}

/// The relative path from a folder to a file or another folder.
///
/// It is the whole path where the two share nothing. The folder need not exist yet.
#[must_use]
pub fn way(folder: &Path, to: &Path) -> PathBuf {
    relative(&absolute(folder), &absolute(to))
}

/// The absolute path, with links resolved as far as it exists.
fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() {
        Path::new(".")
    } else {
        path
    };
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    // A missing entry lies in a folder that exists.
    match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) if parent != path => absolute(parent).join(name),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
    }
}

/// The relative path from one absolute folder to another.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let (a, b): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (from.components().collect(), to.components().collect());
    let shared = a.iter().zip(&b).take_while(|(x, y)| x == y).count();
    // Nothing in common but the root, or another drive: the whole path.
    if shared <= 1 {
        return to.to_owned();
    }
    let up = std::iter::repeat_n(Component::ParentDir, a.len() - shared);
    let way: PathBuf = up.chain(b[shared..].iter().copied()).collect();
    if way.as_os_str().is_empty() {
        PathBuf::from(".")
    } else {
        way
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_between_folders_goes_up_and_down() {
        let way = |a: &str, b: &str| relative(Path::new(a), Path::new(b));
        assert_eq!(
            way("/home/a/out", "/home/a/robot/meshes"),
            Path::new("../robot/meshes")
        );
        assert_eq!(way("/home/a", "/home/a"), Path::new("."));
        assert_eq!(way("/home/a", "/home/a/b"), Path::new("b"));
        assert_eq!(way("/home/a", "/opt/b"), Path::new("/opt/b"));
    }
}
