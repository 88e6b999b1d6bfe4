//! What a call asks for: worlds, settings, truths, and names that mean nothing.

use crate::cli_support::Workplace;
use serde_json::Value;

use super::{SMALL, compare, done, result, said};

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
