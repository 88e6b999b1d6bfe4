//! Lets this crate's programs and tests find libmujoco and libtorch at run time.
//!
//! The crates that link the libraries take them from the folders that two variables name, but cargo
//! does not pass their link arguments on to dependent crates. This script therefore sets the rpath
//! for this package; the root package sets it for the `asid` binary. Without the variables the
//! loader's own search path decides.

// A build script talks to cargo through its standard output.
#![allow(clippy::print_stdout)]

use std::env;
use std::path::Path;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    rpath("MUJOCO_DYNAMIC_LINK_DIR", "");
    if env::var_os("CARGO_FEATURE_PEERS").is_some() {
        rpath("LIBTORCH", "lib");
    }
}

/// Adds the subfolder `below` of the folder that `variable` names to the run-time search path.
fn rpath(variable: &str, below: &str) {
    println!("cargo:rerun-if-env-changed={variable}");
    let Some(value) = env::var_os(variable).filter(|v| !v.is_empty()) else {
        return;
    };
    if let Ok(folder) = Path::new(&value).join(below).canonicalize() {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
    }
}
