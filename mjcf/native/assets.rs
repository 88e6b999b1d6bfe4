//! Where a document finds its meshes and textures from another folder.

use std::path::{Component, Path, PathBuf};

use super::Writer;

impl Writer<'_, '_> {
    /// Lets the compiler look for assets where the scene has them.
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

/// The way from a folder to a file or another folder: up and down, or the whole path where they share nothing. The folder need
/// not exist yet.
#[must_use]
pub fn way(folder: &Path, to: &Path) -> PathBuf {
    relative(&absolute(folder), &absolute(to))
}

/// A path from the root of the file system, links resolved as far as it exists.
fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() {
        Path::new(".")
    } else {
        path
    };
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    // What is to be made lies in what there is.
    match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) if parent != path => absolute(parent).join(name),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
    }
}

/// The way from one folder to another, both absolute.
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
