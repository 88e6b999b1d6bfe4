//! The scorer shares no code with what it scores.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Crates that answer cases, or make them: the scorer may know none of them.
const STRANGERS: [&str; 3] = ["asid-diagnosis", "asid-withheld", "asid-algorithms"];

/// The workspace's crates that a manifest depends on, tests and building included.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut inside = false;
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']).ends_with("dependencies")
                && line != "[workspace.dependencies]";
        } else if inside && line.starts_with("asid-") {
            let name = line.split(['=', '.', ' ']).next().unwrap_or_default();
            found.insert(name.to_owned());
        }
    }
    found
}

fn manifests(folder: &Path, found: &mut Vec<PathBuf>) {
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
fn the_scorer_knows_neither_the_diagnosis_nor_the_generator() {
    // What its dependencies depend on counts as well.
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("a root");
    let mut files = Vec::new();
    manifests(root, &mut files);
    let text = |path: &PathBuf| std::fs::read_to_string(path).expect("a manifest");
    let named = |name: &str| {
        let own = format!("name = \"{name}\"");
        files.iter().map(text).find(|t| t.lines().any(|l| l == own))
    };
    let mut reached = BTreeSet::from(["asid-scorer".to_owned()]);
    let mut open = vec!["asid-scorer".to_owned()];
    while let Some(name) = open.pop() {
        let manifest = named(&name).unwrap_or_else(|| panic!("no crate `{name}`"));
        for next in dependencies(&manifest) {
            if reached.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    assert!(reached.contains("asid-effects"), "{reached:?}");
    for stranger in STRANGERS {
        assert!(
            !reached.contains(stranger),
            "the scorer reaches {stranger}: {reached:?}"
        );
    }
}

#[test]
fn the_command_line_alone_depends_on_the_scorer() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("a root");
    let mut files = Vec::new();
    manifests(root, &mut files);
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a manifest");
        let allowed = path.parent() == Some(root);
        let uses = dependencies(&text).contains("asid-scorer");
        assert!(
            allowed || !uses,
            "{} depends on asid-scorer",
            path.display()
        );
    }
}
