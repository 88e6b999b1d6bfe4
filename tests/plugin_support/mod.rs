//! Builds plugins for tests that load them.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds packages of this workspace as their authors would, next to the program under
/// test, and returns what they make: shared libraries and programs, in the order of `packages`.
pub fn build(packages: &[&str]) -> Vec<PathBuf> {
    let program = Path::new(env!("CARGO_BIN_EXE_asid"));
    let folder = program.parent().unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["build", "--quiet", "--target-dir"])
        .arg(folder.parent().unwrap());
    if !cfg!(debug_assertions) {
        cargo.arg("--release");
    }
    for package in packages {
        cargo.args(["--package", package]);
    }
    let output = cargo.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{packages:?} are not built: {said}"
    );
    packages
        .iter()
        .map(|package| made(folder, package))
        .collect()
}

/// The library or the program of a package.
fn made(folder: &Path, package: &str) -> PathBuf {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = folder.join(format!("{prefix}{}{suffix}", package.replace('-', "_")));
    if library.exists() {
        return library;
    }
    folder.join(format!("{package}{}", std::env::consts::EXE_SUFFIX))
}
