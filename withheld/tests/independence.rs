//! The generator shares no code with what it measures.

#[path = "../../tests/manifests/mod.rs"]
mod manifests;

use std::collections::BTreeSet;
use std::path::Path;

use manifests::{assert_unused, dependencies};

/// Permitted dependencies of the generator: the engines, and crates that are not about robotics.
const ALLOWED: [&str; 12] = [
    "mujoco-rs",
    "nalgebra",
    "rand",
    "rand_chacha",
    "rapier3d",
    "rayon",
    "roxmltree",
    "serde",
    "serde_json",
    "sha2",
    "tempfile",
    "thiserror",
];

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
    assert_unused(root, "asid-withheld", |folder| {
        folder == root || folder.starts_with(root.join("withheld"))
    });
}

#[test]
fn the_reader_of_manifests_finds_dependencies_of_all_kinds() {
    let text = "[package]\nname = \"a\"\n[dependencies]\nb.workspace = true\nc = \"1\"\n[dev-dependencies]\nd = { path = \"d\" }\n[lints]\ne = 1\n[target.'cfg(unix)'.dependencies]\nf = \"1\"\n";
    let expected: BTreeSet<String> = ["b", "c", "d", "f"].map(str::to_owned).into();
    assert_eq!(dependencies(text), expected);
}
