//! Engines of the project as plugins: what is loaded reads the same as what is linked
//! in, and all stand in one table.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;
mod plugin_support;

use std::path::PathBuf;

use cli_support::Workplace;
use serde_json::Value;

/// The engine that is linked in under every set of features that CI builds.
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
