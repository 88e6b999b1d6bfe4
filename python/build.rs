//! Lets the module find MuJoCo in the package that contains it.

// A build script talks to cargo through its standard output.
#![allow(clippy::print_stdout)]

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var_os("CARGO_FEATURE_MUJOCO").is_some() {
        // The wheel has the library beside the program, in asid/bin.
        println!("cargo:rustc-cdylib-link-arg=-Wl,-rpath,$ORIGIN/bin");
    }
}
