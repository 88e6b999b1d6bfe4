//! Lets the built programs find the native libraries where `cargo xtask setup`
//! (or the user) put them: an rpath for each feature that links one. Where a
//! variable is not set, the loader's own search path holds.
//!
//! With `ASID_RELOCATABLE` set, the programs look beside themselves instead, as those in a package do.
//!
//! It also notes the commit that is built, for results to carry.

// A build script speaks to cargo through its standard output.
#![allow(clippy::print_stdout)]

use std::env;
use std::path::{Path, absolute};
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_MUJOCO").is_some() {
        rpath("MUJOCO_DYNAMIC_LINK_DIR", "");
    }
    if env::var_os("CARGO_FEATURE_TORCH").is_some() {
        rpath("LIBTORCH", "lib");
    }
    commit();
}

/// Sets `ASID_GIT` to the short hash of the commit, or to nothing outside a repository.
fn commit() {
    println!("cargo:rerun-if-changed=.git/HEAD");
    println!("cargo:rerun-if-changed=.git/logs/HEAD");
    let hash = Command::new("git")
        .args(["rev-parse", "--short=12", "HEAD"])
        .output()
        .ok()
        .filter(|out| out.status.success())
        .and_then(|out| String::from_utf8(out.stdout).ok())
        .unwrap_or_default();
    println!("cargo:rustc-env=ASID_GIT={}", hash.trim());
}

/// Adds the folder `below` of what `variable` names to the run-time search path.
fn rpath(variable: &str, below: &str) {
    println!("cargo:rerun-if-env-changed={variable}");
    println!("cargo:rerun-if-env-changed=ASID_RELOCATABLE");
    if env::var_os("ASID_RELOCATABLE").is_some() {
        println!("cargo:rustc-link-arg=-Wl,-rpath,$ORIGIN");
        return;
    }
    let Some(value) = env::var_os(variable).filter(|v| !v.is_empty()) else {
        return;
    };
    if let Ok(folder) = absolute(Path::new(&value).join(below)) {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
    }
}
