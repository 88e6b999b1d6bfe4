//! `asid conformance` with the real binary: rows, files, exit status and plugins.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;

use std::process::Output;

use cli_support::Workplace;
use serde_json::Value;

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn rows_are_those_of_the_contract_at_any_number_of_threads() {
    let place = Workplace::new();
    let rows = |threads: &str| {
        let call = ["conformance", "--backend", "rapier", "--json", "--quiet"];
        let chosen = ["--check", "dynamics/", "--check", "contact/rest-height"];
        let output = place.run(&[&call[..], &chosen, &["--threads", threads]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_str::<Value>(&stdout(&output)).unwrap()
    };
    let result = rows("1");
    assert_eq!(result, rows("3"));
    assert_eq!(result["schema"], 1);
    let rows = result["rows"].as_array().unwrap();
    let outcomes = ["pass", "fail", "not-claimed", "known-deviation"];
    for row in rows {
        assert_eq!(row["engine"], "rapier");
        assert!(row["tolerance"].is_number() && row["unit"].is_string());
        assert!(
            row["value"].is_number() || row["outcome"] == "not-claimed",
            "{row}"
        );
        assert!(outcomes.contains(&row["outcome"].as_str().unwrap()));
        assert!(row["reason"].as_str().unwrap().len() > 10);
    }
    let mesh = rows
        .iter()
        .find(|r| r["check"] == "contact/rest-height-of-a-mesh");
    assert_eq!(mesh.unwrap()["outcome"], "not-claimed");
}

#[test]
fn the_folder_repeats_the_call_and_reads_offline() {
    let place = Workplace::new();
    let first = place.run(&[
        "conformance",
        "--backend",
        "rapier",
        "--check",
        "friction/",
        "--out",
        "first",
    ]);
    assert!(first.status.success(), "{}", stderr(&first));
    assert!(stdout(&first).contains("rapier: "), "{}", stdout(&first));
    let again = place.run(&[
        "conformance",
        "--config",
        "first/config.toml",
        "--out",
        "again",
    ]);
    assert!(again.status.success(), "{}", stderr(&again));
    assert_eq!(
        place.read("first/result.json"),
        place.read("again/result.json")
    );
    let page = place.read("first/report.html");
    let page = page.strip_prefix("<!DOCTYPE html>").unwrap();
    let document = roxmltree::Document::parse(page).unwrap();
    assert!(document.descendants().any(|n| n.has_tag_name("svg")));
    let fetches = |node: &roxmltree::Node<'_, '_>| {
        let refers = |name: &&str| node.attribute(*name).is_some_and(|v| v.contains("://"));
        ["src", "href"].iter().any(refers)
    };
    assert!(!document.descendants().any(|node| fetches(&node)));
}

#[test]
fn what_is_not_there_is_a_wrong_call() {
    let place = Workplace::new();
    for (call, said) in [
        (
            ["--check", "friction/stoping-distance"],
            "friction/stopping-distance",
        ),
        (["--check", "frictoin/"], "`friction/`"),
        (["--check", "pendulum-enery"], "`dynamics/pendulum-energy`"),
        (
            ["--check", "nothing like it"],
            "known: `dynamics/`, `joints/`",
        ),
        (["--backend", "rapir"], "rapier"),
        (["--threads", "0"], "whole number"),
        (["--plugin", "no.so"], "no.so"),
    ] {
        let output = place.run(&[&["conformance"][..], &call].concat());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(said), "{}", stderr(&output));
        assert_eq!(stderr(&output).lines().count(), 1);
        assert!(stderr(&output).len() < 600, "{}", stderr(&output));
    }
}

#[test]
fn checks_and_their_scenes_are_printed_without_rows() {
    let place = Workplace::new();
    let output = place.run(&["conformance", "--list", "--check", "pendulum-energy"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let listed = stdout(&output);
    assert!(listed.starts_with("dynamics/pendulum-energy\n    needs ARTICULATION\n"));
    assert_eq!(listed.lines().count(), 3, "{listed}");
    let output = place.run(&["conformance", "--list", "--json"]);
    let listed: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(
        listed.as_array().unwrap().len(),
        asid_conformance::checks().count()
    );

    let call = ["conformance", "--backend", "rapier", "--scene", "--check"];
    let output = place.run(&[&call[..], &["dynamics/pendulum-energy"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let printed = stdout(&output);
    let document = printed.split_once("-->").unwrap().1;
    let document = roxmltree::Document::parse(document.trim()).unwrap();
    assert!(document.root_element().has_tag_name("mujoco"));
}

/// An engine in C with nine tenths of gravity. It is alone in the table if only its file is named.
/// The rows that detect the fault and the exit status report it.
#[cfg(unix)]
#[test]
fn a_wrong_plugin_fails_alone() {
    let place = Workplace::new();
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let source = std::fs::read_to_string(root.join("plugins/engine-c/engine.c")).unwrap();
    let right = "gravity[i] + (wrench[i]";
    assert_eq!(source.matches(right).count(), 1, "the example has changed");
    place.write(
        "engine.c",
        &source.replace(right, "0.9 * gravity[i] + (wrench[i]"),
    );
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let built = std::process::Command::new(compiler)
        .current_dir(place.path("."))
        .args(["-O2", "-shared", "-fPIC", "-I"])
        .arg(root.join("backends/abi/include"))
        .args(["engine.c", "-o", "libcrooked.so", "-lm"])
        .output()
        .unwrap();
    assert!(built.status.success(), "{}", stderr(&built));

    let output = place.run(&["conformance", "--plugin", "./libcrooked.so", "--out", "out"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    let last = said.lines().last().unwrap();
    assert!(
        last.contains("fail") && last.contains("dynamics/free-fall"),
        "{said}"
    );
    let result: Value = serde_json::from_str(&place.read("out/result.json")).unwrap();
    let rows = result["rows"].as_array().unwrap();
    assert!(rows.iter().all(|row| row["engine"] == "flight"));
    let failed = |check: &str| {
        let row = rows.iter().find(|row| row["check"] == check).unwrap();
        row["outcome"] == "fail"
    };
    assert!(failed("dynamics/free-fall-velocity") && failed("parameters/gravity"));
    assert!(!failed("state/restored-continues") && !failed("forces/force-over-mass"));
    assert!(place.read("out/report.html").contains("What fails"));
}
