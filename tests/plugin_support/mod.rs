//! Builds plugins for tests that load them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// Features of the root package that bring in native libraries, and the whole workspace with them.
const NATIVE: [(&str, bool); 3] = [
    ("mujoco", cfg!(feature = "mujoco")),
    ("torch", cfg!(feature = "torch")),
    ("logs", cfg!(feature = "logs")),
];

/// Returns the cargo arguments that select what to build.
///
/// With all features it is the workspace that these tests are part of, whose crates are all built
/// already. Single packages would compile all of them once more with other features.
fn selection(packages: &[&str]) -> Vec<String> {
    if NATIVE.iter().all(|(_, is_on)| *is_on) {
        let names = NATIVE.map(|(name, _)| name).join(",");
        return vec!["--workspace".into(), format!("--features={names}")];
    }
    packages.iter().map(|p| format!("--package={p}")).collect()
}

/// Environment variable that is set if the caller has already built everything, as
/// `cargo xtask test` does.
///
/// On file systems without links, each cargo call writes the libraries and the program anew. A
/// parallel test then finds none for a moment.
const BUILT: &str = "ASID_TESTS_PLUGINS_ARE_BUILT";

/// Builds packages of this workspace as their authors would, next to the program under test.
///
/// Returns the resulting shared libraries and programs in the order of `packages`.
pub fn build(packages: &[&str]) -> Vec<PathBuf> {
    let program = Path::new(env!("CARGO_BIN_EXE_asid"));
    let folder = program.parent().unwrap();
    if std::env::var_os(BUILT).is_none() {
        build_once(packages, folder.parent().unwrap());
    }
    packages
        .iter()
        .map(|package| made(folder, package))
        .collect()
}

/// Calls cargo once for each selection, because a library that a test has loaded must not be
/// replaced.
fn build_once(packages: &[&str], target: &Path) {
    static DONE: Mutex<BTreeSet<Vec<String>>> = Mutex::new(BTreeSet::new());
    let mut done = DONE.lock().unwrap();
    if !done.insert(selection(packages)) {
        return;
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["build", "--quiet", "--target-dir"])
        .arg(target);
    if !cfg!(debug_assertions) {
        cargo.arg("--release");
    }
    let output = cargo.args(selection(packages)).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{packages:?} are not built: {said}"
    );
}

/// Returns the library or the program of a package.
fn made(folder: &Path, package: &str) -> PathBuf {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = folder.join(format!("{prefix}{}{suffix}", package.replace('-', "_")));
    if library.exists() {
        return library;
    }
    folder.join(format!("{package}{}", std::env::consts::EXE_SUFFIX))
}
