//! Comparisons that are stopped, continued or shared by processes end with the same bytes.

use std::sync::OnceLock;

use crate::cli_support::{ENGINE, Workplace, tiny};
use serde_json::Value;

use super::{SAME, compare, copy_folder, done, result, said};

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
    let first = format!("a/cells/rod-balancing.left.random.matched.{ENGINE}.0.json");
    let first = place.path(&first);
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

/// Cells whose conditions set the hidden truth alone share the plan of their exploration. A cell
/// that takes it over has the result and the cost of one that makes it.
#[test]
fn a_cell_that_shares_its_plan_is_the_cell_that_makes_it() {
    let place = Workplace::new();
    let of = |conditions: &[&str], out: &str| {
        let conditions = conditions.iter().flat_map(|c| ["--condition", c]);
        let common = ["--method", "asid", "--seeds", "1", "--threads", "1"];
        let arguments: Vec<&str> = common.into_iter().chain(conditions).collect();
        done(&place, &arguments, out);
        place.read(&format!(
            "{out}/cells/rod-balancing.right.asid.matched.{ENGINE}.0.json"
        ))
    };
    assert_eq!(of(&["left", "right"], "shared"), of(&["right"], "alone"));
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
        let names = crate::cli_support::names(&place.path(&format!("{signal}/cells")));
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
