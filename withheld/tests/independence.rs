//! The stick shares no code with what it measures.

use std::collections::BTreeSet;
use std::path::Path;

/// What the generator may depend on: the engine, and crates of no robotics.
const ALLOWED: [&str; 11] = [
    "mujoco-rs",
    "nalgebra",
    "rand",
    "rand_chacha",
    "rayon",
    "roxmltree",
    "serde",
    "serde_json",
    "sha2",
    "tempfile",
    "thiserror",
];

/// Names of the dependencies of a manifest, those of tests and of building included.
fn dependencies(manifest: &str) -> BTreeSet<String> {
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

/// All manifests of the workspace but those below build folders.
fn manifests(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
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

#[test]
fn the_generator_depends_on_no_crate_of_the_workspace() {
    let own = dependencies(include_str!("../Cargo.toml"));
    let allowed: BTreeSet<String> = ALLOWED.map(str::to_owned).into();
    let more: Vec<&String> = own.difference(&allowed).collect();
    assert!(more.is_empty(), "withheld/ depends on {more:?}");
}

#[test]
fn no_crate_but_the_command_line_and_the_scorer_depends_on_the_generator() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("a root");
    let mut all = Vec::new();
    manifests(root, &mut all);
    assert!(all.len() > 10);
    for path in all {
        let text = std::fs::read_to_string(&path).expect("a manifest");
        let folder = path.parent().expect("a folder");
        let allowed = folder == root || folder.starts_with(root.join("withheld"));
        let uses = dependencies(&text).contains("asid-withheld");
        assert!(
            allowed || !uses,
            "{} depends on asid-withheld",
            path.display()
        );
    }
}

#[test]
fn the_reader_of_manifests_finds_dependencies_of_all_kinds() {
    let text = "[package]\nname = \"a\"\n[dependencies]\nb.workspace = true\nc = \"1\"\n[dev-dependencies]\nd = { path = \"d\" }\n[lints]\ne = 1\n[target.'cfg(unix)'.dependencies]\nf = \"1\"\n";
    let expected: BTreeSet<String> = ["b", "c", "d", "f"].map(str::to_owned).into();
    assert_eq!(dependencies(text), expected);
}
