//! The scorer shares no code with what it scores.

#[path = "../../tests/manifests/mod.rs"]
mod manifests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use manifests::{assert_unused, dependencies, manifests};

/// Crates that answer or make cases; the scorer must not depend on them.
const STRANGERS: [&str; 3] = ["asid-diagnosis", "asid-withheld", "asid-algorithms"];

#[test]
fn the_scorer_knows_neither_the_diagnosis_nor_the_generator() {
    // Indirect dependencies count as well.
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
        let next = dependencies(&manifest).into_iter();
        for next in next.filter(|n| n.starts_with("asid-")) {
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
    assert_unused(root, "asid-scorer", |folder| folder == root);
}
