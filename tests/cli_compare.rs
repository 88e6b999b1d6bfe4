//! Comparisons of methods through the real binary.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;

use cli_support::{Workplace, tiny};
use serde_json::Value;

fn compare(place: &Workplace, condition: &str, seed: &str, out: &str) -> std::process::Output {
    place.run(&tiny(&[
        "compare",
        "rod-balancing",
        "--method",
        "dr",
        "--condition",
        condition,
        "--seed",
        seed,
        "--seeds",
        "2",
        "--quiet",
        "--out",
        out,
    ]))
}

#[test]
fn a_comparison_sums_up_its_runs_and_merges_with_others() {
    let place = Workplace::new();
    for (condition, seed, out) in [("left", "0", "a"), ("left", "2", "b"), ("middle", "0", "c")] {
        let output = compare(&place, condition, seed, out);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    let merged = place.run(&[
        "compare", "--merge", "a", "b", "c", "--out", "all", "--json",
    ]);
    assert!(
        merged.status.success(),
        "{}",
        String::from_utf8_lossy(&merged.stderr)
    );
    let result: Value = serde_json::from_slice(&merged.stdout).unwrap();
    let rows = result["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2);
    let left = &rows[0];
    assert_eq!(left["condition"], "left");
    assert_eq!(left["n"], 4);
    // Mean and success rate are those of the values.
    let values: Vec<f64> = left["values"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect();
    let mean = values.iter().sum::<f64>() / 4.0;
    assert!((left["mean"].as_f64().unwrap() - mean).abs() < 1e-12);
    let interval = &left["interval95"];
    assert!(interval[0].as_f64() <= Some(mean) && Some(mean) <= interval[1].as_f64());
    for key in [
        "task",
        "method",
        "backend",
        "metric",
        "std",
        "iqm",
        "success_rate",
        "paper",
    ] {
        assert!(left.get(key).is_some(), "{key}");
    }
    let page = place.read("all/report.html");
    roxmltree::Document::parse_with_options(
        &page,
        roxmltree::ParsingOptions {
            allow_dtd: true,
            ..roxmltree::ParsingOptions::default()
        },
    )
    .unwrap();
    let twice = place.run(&["compare", "--merge", "a", "a", "--out", "twice"]);
    assert_eq!(twice.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&twice.stderr).contains("in more than one folder"));
    assert!(!place.path("twice").exists());
}

#[test]
fn the_oracle_knows_a_truth_that_is_drawn_from_the_whole_prior() {
    let place = Workplace::new();
    let output = place.run(&tiny(&[
        "compare",
        "rod-balancing",
        "--method",
        "oracle",
        "--condition",
        "prior",
        "--seeds",
        "2",
        "--quiet",
        "--out",
        "a",
    ]));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let runs: Value = serde_json::from_str(&place.read("a/runs.json")).unwrap();
    let truths: Vec<f64> = runs
        .as_array()
        .unwrap()
        .iter()
        .map(|run| {
            assert_eq!(
                (run["method"].as_str(), run["condition"].as_str()),
                (Some("oracle"), Some("prior"))
            );
            let p = &run["parameters"][0];
            assert_eq!(p["estimate"], p["truth"]);
            assert_eq!(p["std"], 0.0);
            p["truth"].as_f64().unwrap()
        })
        .collect();
    assert!(truths[0] != truths[1] && truths.iter().all(|t| t.abs() <= 0.1));
    assert!(
        place
            .read("a/config.toml")
            .contains("condition = \"prior\"")
    );
}

#[test]
fn unknown_methods_and_conditions_list_the_near_ones() {
    let place = Workplace::new();
    for (flag, name, expected) in [
        ("--method", "asidd", "asid"),
        ("--condition", "lefft", "left"),
    ] {
        let output = place.run(&["compare", "rod-balancing", flag, name]);
        assert_eq!(output.status.code(), Some(2));
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            text.contains(expected) && text.lines().count() == 1,
            "{text}"
        );
    }
    assert!(place.names().is_empty());
}
