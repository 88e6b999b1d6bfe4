//! The project's engines as plugins: a loaded engine reads the same as a linked one, and all are in
//! one table.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;
mod plugin_support;

use std::path::{Path, PathBuf};
use std::process::Command;

use cli_support::Workplace;
use serde_json::Value;

/// The engine that is linked in with every set of features that CI builds.
const LINKED: &str = if cfg!(feature = "mujoco") {
    "mujoco"
} else {
    "rapier"
};

fn build(package: &str, library: &str) -> PathBuf {
    let made = plugin_support::build(&[package]).remove(0);
    let name = format!(
        "{}{library}{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    made.with_file_name(name)
}

fn rows(place: &Workplace, arguments: &[&str]) -> Vec<Value> {
    let output = place.run(arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    result["rows"].as_array().unwrap().clone()
}

#[test]
fn loaded_and_linked_engines_give_identical_figures() {
    let place = Workplace::new();
    let shell = build(
        &format!("asid-{LINKED}-plugin"),
        &format!("asid_engine_{LINKED}"),
    );
    let loaded = format!("{LINKED}@plugin");
    let call = [
        "--plugin",
        shell.to_str().unwrap(),
        "conformance",
        "--json",
        "--quiet",
    ];
    let engines = ["--backend", LINKED, "--backend", &loaded];
    let rows = rows(&place, &[&call[..], &engines].concat());
    let of = |engine: &str| -> Vec<(String, Option<u64>, String)> {
        rows.iter()
            .filter(|r| r["engine"] == engine)
            .map(|r| {
                (
                    r["check"].as_str().unwrap().to_owned(),
                    r["value"].as_f64().map(f64::to_bits),
                    r["outcome"].as_str().unwrap().to_owned(),
                )
            })
            .collect()
    };
    let (linked, loaded) = (of(LINKED), of(&loaded));
    assert!(linked.len() > 100, "{} rows", linked.len());
    assert_eq!(linked, loaded);
    assert!(linked.iter().all(|(_, _, outcome)| outcome != "fail"));
}

/// Builds the test engine of the ABI with one fault.
fn faulty(place: &Workplace, fault: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("backends/abi");
    let library = place.path("libfaulty.so");
    let built = Command::new(std::env::var("CC").unwrap_or_else(|_| "cc".into()))
        .args(["-std=c99", "-shared", "-fPIC", "-I"])
        .arg(here.join("include"))
        .arg(format!("-D{fault}"))
        .arg(here.join("tests/wrong.c"))
        .arg("-o")
        .arg(&library)
        .status()
        .unwrap();
    assert!(built.success());
    library
}

/// Runs a call that must fail with `status`, and returns its one line.
fn one_line(place: &Workplace, arguments: &[&str], status: i32) -> String {
    let output = place.run(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(status), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

#[test]
fn a_plugin_that_crashes_has_a_last_word() {
    let place = Workplace::new();
    let library = faulty(&place, "ROLLOUT_CRASHES");
    let file = library.to_str().unwrap();
    let call = [
        "conformance",
        "--quiet",
        "--check",
        "dynamics/pendulum-energy",
        "--plugin",
    ];
    assert_eq!(
        one_line(&place, &[&call[..], &[file]].concat(), 1),
        format!("asid: plugin {file}: rollout: crashed, and this program with it\n")
    );
}

#[test]
fn a_library_that_is_cut_short_has_a_last_word() {
    let place = Workplace::new();
    let library = faulty(&place, "NO_FAULT");
    let whole = std::fs::read(&library).unwrap();
    std::fs::write(&library, &whole[..9000.min(whole.len() / 2)]).unwrap();
    let file = library.to_str().unwrap();
    // The system's loader refuses such a file or crashes.
    let output = place.run(&["list", "--plugin", file]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(matches!(output.status.code(), Some(1 | 2)), "{said}");
    assert!(
        said.starts_with(&format!("asid: plugin {file}: ")),
        "{said}"
    );
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn an_engine_in_rust_conforms_as_a_plugin() {
    let place = Workplace::new();
    let library = build("asid-plugin-engine-rust", "free_flight");
    let call = [
        "--plugin",
        library.to_str().unwrap(),
        "conformance",
        "--json",
        "--quiet",
    ];
    let rows = rows(&place, &call);
    assert!(rows.iter().all(|r| r["engine"] == "free-flight"));
    let passed = rows.iter().filter(|r| r["outcome"] == "pass").count();
    assert!(passed > 50, "{passed} pass");
}
