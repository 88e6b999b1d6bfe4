//! Lets this crate's tests and examples find libmujoco at run time.
//!
//! `mujoco-rs` links the library in `MUJOCO_DYNAMIC_LINK_DIR`, but cargo does not pass its link
//! arguments on to dependent crates. This script therefore sets the rpath for this package; the
//! root package sets it for the `asid` binary. Without the variable the loader's own search path
//! decides.

// A build script talks to cargo through its standard output.
#![allow(clippy::print_stdout)]

use std::env;
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=MUJOCO_DYNAMIC_LINK_DIR");
    let Some(folder) = env::var_os("MUJOCO_DYNAMIC_LINK_DIR") else {
        return;
    };
    if let Ok(folder) = PathBuf::from(folder).canonicalize() {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
    }
}
