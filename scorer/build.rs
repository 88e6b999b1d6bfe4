//! Lets this crate's tests find libtorch in builds with the feature `torch`: an rpath to
//! `$LIBTORCH/lib`.
//!
//! If LIBTORCH is not set (`LIBTORCH_USE_PYTORCH=1`, or a system-wide libtorch), nothing is added
//! and the loader's own search path decides.

// A build script talks to cargo through its standard output.
#![allow(clippy::print_stdout)]

use std::env;
use std::path::{Path, absolute};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=LIBTORCH");
    if env::var_os("CARGO_FEATURE_TORCH").is_none() {
        return;
    }
    let Some(value) = env::var_os("LIBTORCH").filter(|v| !v.is_empty()) else {
        return;
    };
    if let Ok(folder) = absolute(Path::new(&value).join("lib")) {
        println!("cargo:rustc-link-arg=-Wl,-rpath,{}", folder.display());
    }
}
