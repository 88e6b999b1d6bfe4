//! Comparisons of methods with the real binary.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;

use std::path::Path;
use std::process::Output;
use std::sync::OnceLock;

use cli_support::{Workplace, tiny};
use serde_json::Value;

/// Files that do not depend on how a comparison was run.
const SAME: [&str; 5] = [
    "result.json",
    "runs.json",
    "table.md",
    "report.html",
    "config.toml",
];

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Compares methods on rod balancing in a folder.
fn compare(place: &Workplace, arguments: &[&str], out: &str) -> Output {
    let common = ["compare", "rod-balancing", "--quiet", "--out", out];
    place.run(&tiny(&[&common, arguments].concat()))
}

fn done(place: &Workplace, arguments: &[&str], out: &str) {
    let output = compare(place, arguments, out);
    assert!(output.status.success(), "{}", said(&output));
}

fn result(place: &Workplace, out: &str) -> Value {
    serde_json::from_str(&place.read(&format!("{out}/result.json"))).unwrap()
}

/// Copies a folder recursively.
fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for name in cli_support::names(from) {
        let (from, to) = (from.join(&name), to.join(&name));
        if from.is_dir() {
            copy_folder(&from, &to);
        } else {
            std::fs::copy(&from, &to).unwrap();
        }
    }
}

/// One seed of each method, in the condition `left`.
const SMALL: [&str; 4] = ["--condition", "left", "--seeds", "1"];

#[test]
fn every_method_has_a_row_of_its_own_with_its_parts_settings_and_commit() {
    let place = Workplace::new();
    let methods = ["asid", "random", "dr", "oracle", "mine=random+cem+cem"];
    let named = methods.iter().flat_map(|m| ["--method", m]);
    let arguments: Vec<&str> = SMALL.into_iter().chain(named).collect();
    done(&place, &arguments, "a");
    let result = result(&place, "a");
    let rows = result["rows"].as_array().unwrap();
    let parts: Vec<[&str; 4]> = rows
        .iter()
        .map(|r| ["method", "explorer", "identifier", "solver"].map(|k| r[k].as_str().unwrap()))
        .collect();
    assert_eq!(
        parts,
        [
            ["asid", "fisher-cem", "reps", "cem"],
            ["random", "random", "reps", "cem"],
            ["dr", "none", "none", "cem"],
            ["oracle", "none", "truth", "cem"],
            ["mine", "random", "cem", "cem"],
        ]
    );
    let mut hashes = Vec::new();
    for row in rows {
        for key in [
            "task", "metric", "std", "iqm", "paper", "commit", "seeds", "median",
        ] {
            assert!(row.get(key).is_some(), "{key}");
        }
        assert_eq!(row["world"], "matched");
        assert_eq!(row["n"], 1);
        let hash = row["settings"].as_str().unwrap();
        assert!(!hashes.contains(&hash), "each has other settings");
        hashes.push(hash);
        // The settings behind the hash are there.
        assert!(
            place
                .read(&format!("a/settings/{hash}.toml"))
                .contains("solver")
        );
        // A row with exploration reports its identification, the others report none.
        let identified = row["identification"].as_array().unwrap().len();
        let explores = row["explorer"] != "none";
        assert_eq!(identified, usize::from(explores), "{}", row["method"]);
    }
    assert_eq!(rows[0]["published"]["table"], 1);
    assert_eq!(rows[2]["paper"], 26.69);
    let page = place.read("a/report.html");
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..roxmltree::ParsingOptions::default()
    };
    roxmltree::Document::parse_with_options(&page, options).unwrap();
}

/// Symptom: runs of a table had an `expected_std` several times below that of other runs. Cause:
/// without the fits of `expected.rounds` it was the deviation that explorers are paid for.
#[test]
fn a_deviation_is_expected_of_a_run_only_where_it_was_fitted() {
    let place = Workplace::new();
    let fits = tiny(&["compare", "rod-balancing", "--quiet"]);
    for (out, rounds) in [("none", "expected.rounds=0"), ("one", "expected.rounds=1")] {
        let own = ["--method", "random", "--set", rounds, "--out", out];
        let output = place.run(&[&fits[..], &SMALL, &own].concat());
        assert!(output.status.success(), "{}", said(&output));
        let cell = place.read(&format!(
            "{out}/cells/rod-balancing.left.random.matched.rapier.0.json"
        ));
        let cell: Value = serde_json::from_str(&cell).unwrap();
        let expected = &cell["parameters"][0]["expected_std"];
        assert_eq!(expected.is_number(), out == "one", "{expected}");
        let row = &result(&place, out)["rows"][0]["identification"][0];
        assert_eq!(row["median_expected_std"].is_number(), out == "one");
    }
}

/// Reference of the tests of interruptions and of shares: two seeds of a method that explores and
/// of one that does not.
const PAIR: [&str; 8] = [
    "--method",
    "random",
    "--method",
    "dr",
    "--condition",
    "left",
    "--seeds",
    "2",
];

/// The undisturbed comparison of [`PAIR`], on one thread, in `whole`.
fn whole() -> &'static Workplace {
    static WHOLE: OnceLock<Workplace> = OnceLock::new();
    WHOLE.get_or_init(|| {
        let place = Workplace::new();
        done(&place, &[&PAIR[..], &["--threads", "1"]].concat(), "whole");
        place
    })
}

fn assert_as_whole(place: &Workplace, folder: &str) {
    for file in SAME {
        let there = place.read(&format!("{folder}/{file}"));
        let expected = whole().read(&format!("whole/{file}"));
        assert!(there == expected, "{file} of {folder} differs");
    }
}

/// The comparison is killed once a cell is there, and continued with three threads.
#[test]
fn an_interrupted_comparison_goes_on_and_ends_with_the_same_bytes_at_any_threads() {
    let place = Workplace::new();
    let common = ["compare", "rod-balancing", "--quiet", "--threads", "1"];
    let mut child = place
        .asid(&tiny(&[&common[..], &PAIR, &["--out", "a"]].concat()))
        .spawn()
        .unwrap();
    let first = place.path("a/cells/rod-balancing.left.random.matched.rapier.0.json");
    while !first.exists() {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it was killed"
        );
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!place.path("a/result.json").exists());
    let before = std::fs::metadata(&first).unwrap().modified().unwrap();
    // By its own configuration, from the same folder.
    let again = ["compare", "--config", "a/config.toml", "--out", "a"];
    let again = place.run(&[&again[..], &["--quiet", "--threads", "3"]].concat());
    assert!(again.status.success(), "{}", said(&again));
    assert_as_whole(&place, "a");
    let after = std::fs::metadata(&first).unwrap().modified().unwrap();
    assert_eq!(before, after, "a finished cell is not run again");
    // Nothing is left to do.
    done(&place, &PAIR, "a");
    assert_as_whole(&place, "a");
    let times: Value = serde_json::from_str(&place.read("a/times.json")).unwrap();
    assert_eq!(times["cells"].as_array().unwrap().len(), 4);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_comparison_with_the_way_to_go_on() {
    let place = Workplace::new();
    let arguments = [
        "--method",
        "dr",
        "--condition",
        "left",
        "--seeds",
        "40",
        "--threads",
        "1",
    ];
    for (signal, line, status) in [
        ("INT", "asid: stopped; ", 130),
        ("TERM", "asid: stopped; ", 1),
        ("USR1", "runs that have begun are finished", 1),
    ] {
        let common = ["compare", "rod-balancing", "--quiet", "--out", signal];
        let mut command = place.asid(&tiny(&[&common[..], &arguments].concat()));
        let child = command
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        while !place.path(&format!("{signal}/cells")).exists() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        let pid = child.id().to_string();
        std::process::Command::new("kill")
            .args([&format!("-{signal}"), &pid])
            .status()
            .unwrap();
        let output = child.wait_with_output().unwrap();
        let text = said(&output);
        assert_eq!(output.status.code(), Some(status), "{text}");
        let goes_on =
            format!("`asid compare --config {signal}/config.toml --out {signal}` goes on with it");
        assert!(text.contains(line) && text.contains(&goes_on), "{text}");
        let names = cli_support::names(&place.path(&format!("{signal}/cells")));
        assert!(
            !names.is_empty() && names.iter().all(|n| !n.starts_with('.')),
            "{names:?}"
        );
    }
}

#[test]
fn shares_in_one_folder_or_merged_give_the_bytes_of_one_process() {
    let place = Workplace::new();
    done(&place, &[&PAIR[..], &["--shard", "1/2"]].concat(), "all");
    assert!(!place.path("all/result.json").exists());
    // The same share on its own, and the other share in both ways.
    copy_folder(&place.path("all"), &place.path("1-2"));
    let second = [&PAIR[..], &["--shard", "2/2"]].concat();
    done(&place, &second, "2-2");
    done(&place, &second, "all");
    assert_as_whole(&place, "all");
    let merged = place.run(&["compare", "--merge", "1-2", "2-2", "--out", "merged"]);
    assert!(merged.status.success(), "{}", said(&merged));
    assert_as_whole(&place, "merged");
    let page = place.run(&["report", "merged"]);
    assert_eq!(page.status.code(), Some(2));
    assert!(
        said(&page).contains("folder of a comparison")
            && said(&page).contains("merged/report.html"),
        "{}",
        said(&page)
    );
    let other = compare(&place, &["--method", "dr", "--shard", "1/2"], "all");
    assert_eq!(other.status.code(), Some(2));
    assert!(
        said(&other).contains("another comparison"),
        "{}",
        said(&other)
    );
}

/// Symptom: a share that had left a method out said that it was stopped, and failed. Cause: the
/// runs of that method that were not even tried counted as missing.
#[test]
fn a_share_that_leaves_a_method_out_is_done() {
    let place = Workplace::new();
    // Nothing ships for this explorer.
    let methods = ["--method", "x=task-ppo+reps+cem", "--method", "dr"];
    let runs = ["--condition", "left", "--seeds", "4", "--threads", "1"];
    for (share, out) in [("1/2", "a"), ("2/2", "b")] {
        let arguments = [&methods[..], &runs, &["--shard", share]].concat();
        done(&place, &arguments, out);
    }
    let merged = place.run(&["compare", "--merge", "a", "b", "--out", "all"]);
    assert!(merged.status.success(), "{}", said(&merged));
    let result = result(&place, "all");
    assert_eq!(result["rows"][0]["n"], 4);
    assert_eq!(result["omitted"][0]["method"], "x");
}

#[test]
fn options_that_a_merge_does_not_use_are_refused_by_name() {
    let place = Workplace::new();
    for (arguments, option) in [
        (&["rod-balancing", "--merge", "a", "b"][..], "TASK"),
        (&["--merge", "a", "b", "--seeds", "7"], "--seeds"),
        (&["--merge", "a", "b", "--shard", "1/2"], "--shard"),
        (
            &["--merge", "a", "b", "--set", "solver.iterations=1"],
            "--set",
        ),
    ] {
        let output = place.run(&[&["compare"], arguments].concat());
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(
            text.contains(&format!("{option}: a merge does not use it"))
                && text.lines().count() == 1,
            "{text}"
        );
    }
    assert!(place.names().is_empty());
}

#[test]
fn comparisons_merge_only_where_they_belong_together() {
    let place = Workplace::new();
    let dr = ["--method", "dr", "--seeds", "2"];
    for (seed, condition, out) in [("0", "left", "a"), ("2", "left", "b"), ("0", "middle", "c")] {
        done(
            &place,
            &[&dr[..], &["--condition", condition, "--seed", seed]].concat(),
            out,
        );
    }
    let merged = place.run(&[
        "compare", "--merge", "a", "b", "c", "a", "--out", "all", "--json",
    ]);
    assert!(merged.status.success(), "{}", said(&merged));
    let all: Value = serde_json::from_slice(&merged.stdout).unwrap();
    let rows = all["rows"].as_array().unwrap();
    assert_eq!(
        (rows.len(), &rows[0]["n"], &rows[1]["n"]),
        (2, &4.into(), &2.into())
    );
    // Mean and success rate are those of the values.
    let values: Vec<f64> = rows[0]["values"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect();
    let mean = values.iter().sum::<f64>() / 4.0;
    assert!((rows[0]["mean"].as_f64().unwrap() - mean).abs() < 1e-12);
    let interval = &rows[0]["interval95"];
    assert!(interval[0].as_f64() <= Some(mean) && Some(mean) <= interval[1].as_f64());

    done(
        &place,
        &[
            &dr[..],
            &[
                "--condition",
                "right",
                "--set",
                "solver.cem.elite_fraction=0.5",
            ],
        ]
        .concat(),
        "d",
    );
    for (change, reason) in [
        ("\"value\": ", "another outcome"),
        ("\"git\": \"", "commit"),
        ("\"engine\": \"", "was made on"),
        ("\"settings\": \"", "other settings of dr"),
    ] {
        let cell = "a/cells/rod-balancing.left.dr.matched.rapier.0.json";
        let text = place.read(cell);
        let other = format!("x-{}", change.trim_matches(['"', ':', ' ']));
        std::fs::create_dir_all(place.path(&format!("{other}/cells"))).unwrap();
        std::fs::copy(
            place.path("a/config.toml"),
            place.path(&format!("{other}/config.toml")),
        )
        .unwrap();
        place.write(
            &cell.replacen('a', &other, 1),
            &text.replacen(change, &format!("{change}1"), 1),
        );
        let refused = place.run(&["compare", "--merge", "a", &other, "--out", "twice"]);
        assert_eq!(refused.status.code(), Some(2));
        let message = said(&refused);
        assert!(
            message.contains(reason) && message.lines().count() == 1,
            "{message}"
        );
    }
    let refused = place.run(&["compare", "--merge", "a", "d", "--out", "twice"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("solver.cem"), "{}", said(&refused));
    assert!(!place.path("twice").exists());
}

#[test]
fn a_folder_of_other_settings_is_not_mixed_with() {
    let place = Workplace::new();
    let dr = ["--method", "dr", "--condition", "left", "--seeds", "1"];
    done(&place, &dr, "a");
    let other = compare(
        &place,
        &[&dr[..], &["--set", "solver.cem.elite_fraction=0.5"]].concat(),
        "a",
    );
    assert_eq!(other.status.code(), Some(2));
    let text = said(&other);
    assert!(
        text.contains("solver.cem = - there, { elite_fraction = 0.5 } here"),
        "{text}"
    );
    assert!(text.lines().count() == 1, "{text}");
    // More seeds extend the comparison.
    done(
        &place,
        &["--method", "dr", "--condition", "left", "--seeds", "2"],
        "a",
    );
    assert_eq!(result(&place, "a")["rows"][0]["n"], 2);
    // A folder with something else is never changed.
    std::fs::create_dir(place.path("run")).unwrap();
    place.write("run/config.toml", "task = 'rod-balancing'");
    let taken = compare(&place, &dr, "run");
    assert_eq!(taken.status.code(), Some(2));
    assert!(
        said(&taken).contains("choose another --out"),
        "{}",
        said(&taken)
    );
}

/// Symptom: a job array of other settings, or its printed script alone, replaced the settings of a
/// comparison that was there. Cause: they were written without a look at the folder.
#[test]
fn a_job_array_of_other_settings_or_its_printed_script_changes_no_comparison() {
    let place = Workplace::new();
    let array = |out: &str, more: &[&str]| {
        let call = [
            "compare",
            "rod-balancing",
            "--method",
            "dr",
            "--condition",
            "left",
            "--submit",
            "slurm",
            "--out",
            out,
        ];
        let mut command = place.asid(&tiny(&[&call[..], more].concat()));
        // No scheduler is found: the folder is left as it was submitted.
        command.env("PATH", "").output().unwrap()
    };
    let printed = array("b", &["--print-script"]);
    assert!(printed.status.success(), "{}", said(&printed));
    assert!(printed.stdout.starts_with(b"#!/bin/bash"));
    assert!(place.names().is_empty(), "{:?}", place.names());

    let submitted = array("a", &[]);
    assert!(said(&submitted).contains("sbatch"), "{}", said(&submitted));
    let settings = place.read("a/config.toml");
    let other = ["--set", "solver.cem.elite_fraction=0.5"];
    for more in [&other[..], &[&other[..], &["--print-script"]].concat()] {
        let refused = array("a", more);
        assert_eq!(refused.status.code(), Some(2));
        assert!(
            said(&refused).contains("choose another --out"),
            "{}",
            said(&refused)
        );
        assert_eq!(place.read("a/config.toml"), settings);
    }
}

/// Symptom: a table called a world matched in which a sensor drifted. Cause: only a single run told
/// such a world from the matched one.
#[test]
fn a_world_of_ones_own_is_called_custom_and_never_matched() {
    let place = Workplace::new();
    let drift = ["--real-effect", "sensor-drift@rod_pos:z=0.05"];
    let dr = [&["--method", "dr"][..], &SMALL, &drift].concat();
    done(&place, &dr, "a");
    assert_eq!(result(&place, "a")["rows"][0]["world"], "custom");
    assert!(place.read("a/table.md").contains("World: custom."));
    let refused = compare(&place, &[&dr[..], &["--world", "matched"]].concat(), "b");
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        said(&refused).contains("a matched world is the simulator itself"),
        "{}",
        said(&refused)
    );
}

/// Symptom: `--set seed=5` and `--set condition=middle` beside the configuration of a comparison
/// changed nothing. Cause: the plan of the configuration won over the settings of the call.
#[test]
fn settings_of_a_call_win_over_the_plan_of_a_configuration() {
    let place = Workplace::new();
    done(&place, &[&["--method", "dr"][..], &SMALL].concat(), "a");
    let own = ["--set", "seed=5", "--set", "condition=middle"];
    let again = [
        "compare",
        "--config",
        "a/config.toml",
        "--quiet",
        "--out",
        "b",
    ];
    let output = place.run(&[&again[..], &own].concat());
    assert!(output.status.success(), "{}", said(&output));
    let row = &result(&place, "b")["rows"][0];
    assert_eq!(row["seeds"], serde_json::json!([5]));
    assert_eq!(row["condition"], "middle");
}

/// Symptom: after a call with fewer seeds nothing told that the other runs were in no table any
/// more.
#[test]
fn runs_that_a_call_does_not_name_are_told_of_and_stay() {
    let place = Workplace::new();
    let seeds = |n: &'static str| ["--method", "dr", "--condition", "left", "--seeds", n];
    done(&place, &seeds("3"), "a");
    let fewer = compare(&place, &seeds("1"), "a");
    assert!(fewer.status.success(), "{}", said(&fewer));
    assert!(
        said(&fewer).contains("2 runs in a are of"),
        "{}",
        said(&fewer)
    );
    assert_eq!(result(&place, "a")["rows"][0]["n"], 1);
    let all = compare(&place, &seeds("3"), "a");
    assert!(said(&all).is_empty(), "{}", said(&all));
    assert_eq!(result(&place, "a")["rows"][0]["n"], 3);
}

#[test]
fn the_oracle_knows_a_truth_that_is_drawn_from_the_whole_prior() {
    let place = Workplace::new();
    done(
        &place,
        &["--method", "oracle", "--condition", "prior", "--seeds", "2"],
        "a",
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
}

#[test]
fn what_names_nothing_or_would_misname_a_row_is_refused_in_one_line() {
    let place = Workplace::new();
    for (arguments, expected) in [
        (&["--method", "asidd"][..], "asid"),
        (&["--method", "x=randm+reps+cem"], "random"),
        (&["--condition", "lefft"], "left"),
        (
            &["--explorer", "random"],
            "--method NAME=explorer+identifier+solver",
        ),
        (
            &["--set", "explorer.name=random"],
            "--method NAME=explorer+identifier+solver",
        ),
        (&["--set", "explorer.iteratoins=3"], "iteratoins"),
        (&["--table", "4"], "tables 1, 2 and 3"),
        (&["--shard", "3/2"], "i/n"),
        (&["--seeds", "0"], "at least 1"),
        (&["--seeds", "-3"], "at least 1"),
        (&["--backend", "rapierr"], "rapier"),
    ] {
        let output = place.run(&[&["compare", "rod-balancing"], arguments].concat());
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
        assert!(
            text.contains(expected) && text.lines().count() == 1,
            "{arguments:?}: {text}"
        );
    }
    assert!(place.names().is_empty());
}

#[test]
fn a_method_that_cannot_be_run_is_left_out_with_the_reason_and_stops_no_other() {
    let place = Workplace::new();
    let listed = String::from_utf8(place.run(&["list", "--json"]).stdout).unwrap();
    let all: Value = serde_json::from_str(&listed).unwrap();
    let there = |name: &str| {
        let rows = all.as_array().or(all["rows"].as_array()).unwrap();
        rows.iter()
            .any(|r| r["kind"] == "explorer" && r["name"] == name && r["available"] == true)
    };
    let Some(lacking) = ["maxmi", "max"].into_iter().find(|m| !there(m)) else {
        return;
    };
    let left = ["--condition", "left", "--seeds", "2", "--method", lacking];
    done(&place, &[&left[..], &["--method", "dr"]].concat(), "a");
    let result = result(&place, "a");
    assert_eq!(result["rows"].as_array().unwrap().len(), 1);
    let omitted = &result["omitted"];
    assert_eq!(omitted.as_array().unwrap().len(), 1);
    assert_eq!(omitted[0]["method"], lacking);
    assert!(
        omitted[0]["reason"]
            .as_str()
            .unwrap()
            .contains("this build is without it")
    );
    assert!(
        place
            .read("a/table.md")
            .contains(&format!("> Left out: {lacking} on rod-balancing"))
    );
    // Without the other method there is nothing to compare.
    let alone = compare(&place, &left, "b");
    assert_eq!(alone.status.code(), Some(2));
    assert!(
        said(&alone).contains("this build is without it"),
        "{}",
        said(&alone)
    );
}

#[test]
fn a_quick_look_is_marked_in_every_output_and_has_other_settings() {
    let place = Workplace::new();
    let dr = ["--method", "dr", "--condition", "left"];
    done(
        &place,
        &[&dr[..], &["--quick", "--seeds", "1"]].concat(),
        "quick",
    );
    done(&place, &[&dr[..], &["--seeds", "1"]].concat(), "full");
    assert_eq!(result(&place, "quick")["quick"], true);
    for file in ["table.md", "report.html"] {
        assert!(
            place.read(&format!("quick/{file}")).contains("quick look"),
            "{file}"
        );
        assert!(
            !place.read(&format!("full/{file}")).contains("quick look"),
            "{file}"
        );
    }
    let hash = |out: &str| result(&place, out)["rows"][0]["settings"].clone();
    assert_ne!(hash("quick"), hash("full"));
}
