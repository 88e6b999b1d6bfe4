//! The workspace's manifests for tests of independence: read as text, so that no crate is needed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Names of the dependencies of a manifest, including those of tests and build scripts.
pub fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut inside = false;
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']).ends_with("dependencies")
                && line != "[workspace.dependencies]";
        } else if inside && !line.is_empty() && !line.starts_with('#') {
            let name = line.split(['=', '.', ' ']).next().unwrap_or_default();
            found.insert(name.trim_matches('"').to_owned());
        }
    }
    found
}

/// Collects all manifests below a folder, except those in build folders.
pub fn manifests(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            manifests(&path, found);
        } else if name == "Cargo.toml" {
            found.push(path);
        }
    }
}

/// Asserts that no manifest of the workspace names a crate, except in folders that may.
pub fn assert_unused(root: &Path, name: &str, may: impl Fn(&Path) -> bool) {
    let mut all = Vec::new();
    manifests(root, &mut all);
    assert!(all.len() > 10);
    for path in all {
        let text = std::fs::read_to_string(&path).expect("a manifest");
        let uses = dependencies(&text).contains(name);
        let allowed = may(path.parent().expect("a folder"));
        assert!(allowed || !uses, "{} depends on {name}", path.display());
    }
}
