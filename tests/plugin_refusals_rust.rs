//! Faulty plugins, each actually built: one line names the file and the reason, with a matching
//! exit status. No plugin crashes the program.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;
mod plugin_support;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use cli_support::Workplace;

/// The task of the examples, and the plugin with only failing parts.
static LIBRARIES: LazyLock<Vec<PathBuf>> =
    LazyLock::new(|| plugin_support::build(&["payload-swing", "faulty-plugin"]));

/// Settings under which everything but the explorer is quick.
const TINY: [&str; 14] = [
    "--set",
    "identifier.iterations=1",
    "--set",
    "identifier.population=8",
    "--set",
    "identifier.sampling.rounds=1",
    "--set",
    "identifier.sampling.draws=8",
    "--set",
    "solver.iterations=1",
    "--set",
    "solver.population=2",
    "--set",
    "solver.belief_samples=1",
];

/// The one line on standard error of a command, and its exit status.
fn line(output: &Output) -> (String, Option<i32>) {
    let said = String::from_utf8_lossy(&output.stderr)
        .trim_end()
        .to_owned();
    assert_eq!(said.lines().count(), 1, "not one line: {said}");
    (said, output.status.code())
}

/// Runs a task with both plugins.
fn run(arguments: &[&str]) -> (String, Option<i32>) {
    let place = Workplace::new();
    let plugins = LIBRARIES
        .iter()
        .flat_map(|l| ["--plugin", l.to_str().unwrap()]);
    let all: Vec<&str> = ["run", "--quiet"].into_iter().chain(plugins).collect();
    line(&place.run(&[&all, arguments].concat()))
}

fn faulty_says(arguments: &[&str], reason: &str) {
    let (said, status) = run(arguments);
    assert!(said.starts_with("asid: plugin "), "{said}");
    assert!(
        said.contains("libfaulty_plugin") && said.contains(reason),
        "{said}"
    );
    assert_eq!(status, Some(1), "{said}");
}

#[test]
fn a_tasks_failures_end_as_one_line() {
    for (task, reason) in [
        ("make-panics", "panicked: the task cannot be made"),
        ("outcome-panics", "panicked: the outcome of several lines"),
        (
            "outcome-is-nan",
            "the task's outcome, metric and cost, is NaN",
        ),
        ("metric-is-nan", "the task's metric is NaN"),
        ("attempt-panics", "panicked: no torque for the attempt"),
        ("attempt-fails", "the motor is too weak"),
        ("commands-panic", "panicked: no commands today"),
        (
            "locate-is-long",
            "reading of the start has 2 values where its start has 1",
        ),
    ] {
        faulty_says(
            &[&[task, "--explorer", "random"], &TINY[..]].concat(),
            reason,
        );
    }
}

#[test]
fn an_algorithms_panics_end_as_one_line() {
    for (explorer, reason) in [
        ("explore-panics", "panicked: nothing to explore"),
        (
            "explore-panics-in-a-thread",
            "panicked: nothing in the thread",
        ),
        ("act-panics", "panicked: no action comes to mind"),
    ] {
        faulty_says(&["payload-swing", "--explorer", explorer], reason);
    }
    let (identifier, solver) = TINY.split_at(8);
    let random = ["payload-swing", "--explorer", "random"];
    let panics = ["--identifier", "identify-panics"];
    faulty_says(
        &[&random[..], &panics, solver].concat(),
        "panicked: no posterior",
    );
    let panics = ["--solver", "solve-panics"];
    faulty_says(
        &[&random[..], &panics, identifier].concat(),
        "panicked: no solution",
    );
}

#[test]
fn what_an_identifier_hands_back_is_looked_at_before_it_is_used() {
    let (_, solver) = TINY.split_at(8);
    for (identifier, reason) in [
        (
            "identifies-without-starts",
            "returned 0 starts for 1 episodes",
        ),
        ("identifies-short-starts", "entries of a start for"),
        ("identifies-without-marginals", "returned 0 marginals for"),
        ("identifies-without-samples", "the posterior has no samples"),
        ("identifies-negative-weights", "is -0.5, below 0"),
        ("identifies-weights-that-do-not-sum", "sum to 2, not to 1"),
        ("identifies-few-weights", "returned 1 weights for 2 samples"),
        ("identifies-long-samples", "entries of a sample for"),
        ("identifies-nan-residual", "the residual is NaN"),
        ("identifies-negative-misfit", "the misfit is -1, below 0"),
    ] {
        let call = [
            "payload-swing",
            "--explorer",
            "random",
            "--identifier",
            identifier,
        ];
        faulty_says(&[&call, solver].concat(), reason);
    }
}

#[test]
fn an_effects_failures_end_as_one_line() {
    for (effect, reason) in [
        ("force-panics", "panicked: no force"),
        ("force-is-nan", "the force of an effect is NaN"),
    ] {
        let call = [
            "payload-swing",
            "--explorer",
            "random",
            "--real-effect",
            effect,
        ];
        faulty_says(&[&call, &TINY[..]].concat(), reason);
    }
}

#[test]
fn whoever_panics_is_blamed() {
    let explorer = ["--explorer", "explore-makes-the-task-panic"];
    // The task of another plugin, called through this program.
    let (said, status) = run(&[&["payload-swing"], &explorer[..]].concat());
    assert!(
        said.contains("libpayload_swing") && said.contains("panicked: index out of bounds"),
        "{said}"
    );
    assert_eq!(status, Some(1));
    // A task of this program.
    let (said, status) = run(&[&["rod-balancing"], &explorer[..]].concat());
    assert!(
        said.starts_with("asid: internal error: index out of bounds"),
        "{said}"
    );
    assert_eq!(status, Some(1));
}

/// Compiles C to a shared library in a folder.
fn compile(folder: &Path, name: &str, source: &str) -> PathBuf {
    let (file, library) = (
        folder.join(format!("{name}.c")),
        folder.join(format!("lib{name}.so")),
    );
    std::fs::write(&file, source).unwrap();
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let mut command = Command::new(compiler);
    command
        .args(["-shared", "-fPIC", "-o"])
        .arg(&library)
        .arg(&file);
    assert!(
        command.status().unwrap().success(),
        "{name} is not compiled"
    );
    library
}

/// The head of the constant that a Rust plugin exports, in C.
fn declaration(magic: &str, size: &str, fingerprint: &str) -> String {
    format!(
        r#"#include <stddef.h>
static size_t exported(void) {{ return 1; }}
struct {{ char magic[8]; size_t size; const char *fingerprint; size_t (*exported)(void); char rest[200]; }}
asid_rust_plugin = {{ "{magic}", {size}, "{fingerprint}", exported, {{ 0 }} }};"#
    )
}

#[test]
fn what_was_built_otherwise_is_refused_before_it_is_used() {
    let place = Workplace::new();
    let folder = place.path("");
    let other = "compiler=rustc 1.80.0 (051478957 2024-07-21)\\ntarget=x\\nasid=0.0.1\\nsources=0";
    for (name, source, reason) in [
        (
            "compiler",
            declaration("ASIDRUST", "232", other),
            "was built by rustc 1.80.0 (051478957 2024-07-21), this asid by rustc",
        ),
        (
            "cut",
            declaration("ASIDRUST", "24", other),
            "is cut off: 24 bytes where",
        ),
        (
            "null",
            declaration("ASIDRUST", "232", "").replace("\"\", exported", "0, exported"),
            "is cut off",
        ),
        (
            "magic",
            declaration("NONSENSE", "232", other),
            "is not that of asid",
        ),
        (
            "empty",
            "int nothing;".to_owned(),
            "is a library but no plugin: it exports neither an engine",
        ),
    ] {
        let library = compile(&folder, name, &source);
        let (said, status) = line(&place.run(&["list", "--plugin", library.to_str().unwrap()]));
        assert!(
            said.starts_with(&format!("asid: plugin {}", library.display())),
            "{said}"
        );
        assert!(said.contains(reason), "{said}");
        assert_eq!(status, Some(2), "{said}");
    }
}

#[test]
fn the_sources_must_be_the_same_too() {
    let place = Workplace::new();
    // A real plugin with one changed digit in the hash of the sources.
    let mut bytes = std::fs::read(&LIBRARIES[0]).unwrap();
    let key = b"\nsources=";
    let mut changed = 0;
    for i in 0..bytes.len() - key.len() {
        if bytes[i..].starts_with(key) {
            let digit = &mut bytes[i + key.len()];
            *digit = if *digit == b'0' { b'1' } else { b'0' };
            changed += 1;
        }
    }
    assert!(changed > 0);
    place.write("libother.so", "");
    std::fs::write(place.path("libother.so"), bytes).unwrap();
    let (said, status) = line(&place.run(&["list", "--plugin", "libother.so"]));
    assert!(
        said.contains("libother.so: was built from asid 0.1.0 ("),
        "{said}"
    );
    assert!(said.contains("rebuild the plugin"), "{said}");
    assert_eq!(status, Some(2));
}

#[test]
fn files_that_are_no_libraries_are_refused() {
    let place = Workplace::new();
    place.write("libtext.so", "not a library");
    for (file, reason) in [
        ("libtext.so", "is not a library that can be loaded"),
        ("absent.so", "no such file"),
        (".", "is a folder"),
    ] {
        let (said, status) = line(&place.run(&["--plugin", file, "list"]));
        assert!(
            said.starts_with(&format!("asid: plugin {file}: {reason}")),
            "{said}"
        );
        assert_eq!(status, Some(2));
    }
    place.write("run.toml", "plugins = [\"absent.so\"]");
    let (said, status) = line(&place.run(&[
        "run",
        "rod-balancing",
        "--config",
        "run.toml",
        "--trust-plugins",
    ]));
    assert!(said.contains("plugin absent.so: no such file"), "{said}");
    assert_eq!(status, Some(2));
}

#[test]
fn what_is_found_in_a_folder_is_refused_with_a_warning_and_a_row() {
    let place = Workplace::new();
    std::fs::create_dir(place.path("plugins")).unwrap();
    place.write("plugins/libtext.so", "not a library");
    let with_path = |arguments: &[&str]| {
        let mut command = place.asid(arguments);
        command.env("ASID_PLUGIN_PATH", "plugins").output().unwrap()
    };
    let output = with_path(&["export", "rod-balancing", "--out", "scene.xml"]);
    let (said, status) = line(&output);
    assert!(
        said.starts_with("asid: warning: plugin plugins/libtext.so: is not a library"),
        "{said}"
    );
    assert_eq!(status, Some(0));
    let output = with_path(&["list", "--json"]);
    assert!(output.status.success() && output.stderr.is_empty());
    let rows: Vec<serde_json::Value> = serde_json::from_slice(&output.stdout).unwrap();
    let row = rows.iter().find(|r| r["kind"] == "plugin").unwrap();
    assert_eq!(row["name"], "plugins/libtext.so");
    assert_eq!(row["available"], false);
    let why = row["why"].as_str().unwrap();
    assert!(
        why.starts_with("refused: ") && why.contains("not a library"),
        "{why}"
    );
}
