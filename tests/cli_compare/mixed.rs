//! What does not belong together is neither merged nor mixed in a folder.

use crate::cli_support::{ENGINE, Workplace, tiny};
use serde_json::Value;

use super::{compare, done, result, said};

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
        let cell = &format!("a/cells/rod-balancing.left.dr.matched.{ENGINE}.0.json");
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
