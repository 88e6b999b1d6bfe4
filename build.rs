//! Lets the built programs find the native libraries where `cargo xtask setup`
//! (or the user) put them: an rpath for each feature that links one.
//!
//! A folder that is not there adds nothing: the linker's own search then holds.

// A build script speaks to cargo through its standard output.
#![allow(clippy::print_stdout)]

use std::env;
use std::path::PathBuf;

fn main() {
    if env::var_os("CARGO_FEATURE_MUJOCO").is_some() {
        rpath("MUJOCO_DYNAMIC_LINK_DIR", "");
    }
    if env::var_os("CARGO_FEATURE_TORCH").is_some() {
        rpath("LIBTORCH", "lib");
    }
    println!("cargo:rerun-if-changed=build.rs");
}

/// Adds the folder `below` of what `variable` names to the run-time search path.
fn rpath(variable: &str, below: &str) {
    println!("cargo:rerun-if-env-changed={variable}");
    let Some(value) = env::var_os(variable) else {
        return;
    };
    if let Ok(folder) = PathBuf::from(value).join(below).canonicalize() {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
    }
}
