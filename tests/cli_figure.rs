//! Figures through the real binary.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // not every test needs all of it
mod cli_support;

use std::process::Output;

use cli_support::{ENGINE, Workplace, tiny};
use serde_json::Value;

fn figure(place: &Workplace, name: &str, arguments: &[&str], out: &str) -> Output {
    let common = ["compare", "--figure", name, "--quiet", "--out", out];
    place.run(&tiny(&[&common, arguments].concat()))
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn result(place: &Workplace, out: &str) -> Value {
    serde_json::from_str(&place.read(&format!("{out}/result.json"))).unwrap()
}

/// Asserts that the page and the picture are well-formed documents.
fn drawn(place: &Workplace, out: &str) {
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..roxmltree::ParsingOptions::default()
    };
    for file in ["report.html", "picture.svg"] {
        let text = place.read(&format!("{out}/{file}"));
        roxmltree::Document::parse_with_options(&text, options).unwrap();
    }
}

/// A rod that is not touched tells hardly anything: the expected and the actual posterior are about
/// the prior. On an engine with soft contacts its rest depends on its mass a little.
#[test]
fn explorers_are_ranked_by_what_identification_makes_of_the_same_episodes() {
    let place = Workplace::new();
    let explorers = [
        "random",
        "fisher-cem",
        "fisher-cem:fisher.form=one-step",
        "task-ppo",
    ];
    let mut arguments = vec!["rod-balancing", "--episodes", "1"];
    arguments.extend(explorers.iter().flat_map(|e| ["--explorer", e]));
    let output = figure(&place, "explorers", &arguments, "a");
    assert!(output.status.success(), "{}", said(&output));
    drawn(&place, "a");
    let rows: Vec<Vec<String>> = place
        .read("a/episodes.csv")
        .lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect();
    let names: Vec<&str> = rows[1..].iter().map(|r| &*r[1]).collect();
    assert_eq!(names, ["random", "fisher-cem", "fisher-cem one-step"]);
    // All methods have the same truth.
    assert!(rows[1..].iter().all(|r| r[4] == rows[1][4]));
    let shipped = result(&place, "a")["notes"].to_string();
    assert!(
        shipped.contains("Left out: task-ppo on rod-balancing"),
        "{shipped}"
    );
    let random: Vec<f64> = rows[1][6..10].iter().map(|x| x.parse().unwrap()).collect();
    let [expected, actual, _, contact] = random[..] else {
        panic!("{random:?}")
    };
    assert_eq!(contact, 0.0);
    assert!((0.5..1.01).contains(&expected), "{random:?}");
    assert!(actual > 0.5, "{random:?}");
    let table = place.read("a/table.md");
    assert!(
        table.contains("| rod-balancing: mass_offset | random | 1 |"),
        "{table}"
    );
}

/// Levels are comparisons that are kept. If one of them is there already, the figure uses it as it
/// is.
#[test]
fn a_curve_of_difficulty_goes_on_with_the_levels_that_are_there() {
    let place = Workplace::new();
    let levels = ["rod-balancing", "--levels", "ledge_width=0.06,0.01"];
    let methods = ["--method", "dr", "--method", "oracle", "--seeds", "1"];
    let arguments = [&levels[..], &methods, &["--condition", "left"]].concat();
    let run = |out: &str| {
        let output = figure(&place, "difficulty", &arguments, out);
        assert!(output.status.success(), "{}", said(&output));
    };
    run("a");
    drawn(&place, "a");
    let numbers = result(&place, "a")["numbers"].clone();
    assert_eq!(numbers.as_array().unwrap().len(), 4);
    assert_eq!(place.read("a/difficulty.csv").lines().count(), 5);
    // What is left if the figure is stopped after the first level.
    let kept = "b/levels/ledge_width=0.06";
    std::fs::create_dir_all(place.path("b/levels")).unwrap();
    std::fs::rename(place.path("a/levels/ledge_width=0.06"), place.path(kept)).unwrap();
    let cell = format!("{kept}/cells/rod-balancing.left.dr.matched.{ENGINE}.0.json");
    let before = std::fs::metadata(place.path(&cell))
        .unwrap()
        .modified()
        .unwrap();
    run("b");
    let after = std::fs::metadata(place.path(&cell))
        .unwrap()
        .modified()
        .unwrap();
    assert_eq!(before, after);
    assert_eq!(result(&place, "b")["numbers"], numbers);
    assert_eq!(
        place.read("a/difficulty.csv"),
        place.read("b/difficulty.csv")
    );
    // A finished figure is never changed.
    let again = figure(&place, "difficulty", &arguments, "b");
    assert_eq!(again.status.code(), Some(2));
    assert!(
        said(&again).contains("already holds another run"),
        "{}",
        said(&again)
    );
}

#[test]
fn what_cannot_be_drawn_is_refused_in_one_line_and_nothing_is_written() {
    let place = Workplace::new();
    for (name, arguments, expected) in [
        ("curves", &[][..], "learned-model"),
        ("explorers", &["--explorer", "fisher-cme"], "fisher-cem"),
        ("explorers", &["--explorer", "random:hold=2"], "hold"),
        (
            "distractors",
            &["--explorer", "task-ppo"],
            "task-ppo:policy=FILE",
        ),
        ("difficulty", &["laptop-articulation"], "angle_tolerance"),
        (
            "difficulty",
            &["rod-balancing", "--levels", "ledge=1"],
            "ledge_width",
        ),
        (
            "difficulty",
            &["rod-balancing", "--levels", "ledge_width=9"],
            "0.004 to 0.1 m",
        ),
        ("difficulty", &["rod-balancing", "shuffleboard"], "one task"),
    ] {
        let output = figure(&place, name, arguments, "out");
        let text = said(&output);
        assert!(!output.status.success(), "{name} {arguments:?}");
        assert!(
            text.contains(expected) && text.lines().count() == 1,
            "{name} {arguments:?}: {text}"
        );
    }
    assert!(place.names().is_empty());
}

#[test]
fn options_that_a_figure_does_not_use_are_refused_by_name() {
    let place = Workplace::new();
    let unused: [(&str, &[&str]); 22] = [
        ("patches", &["rod-balancing"]),
        ("laptop", &["--world", "perturbed"]),
        ("laptop", &["--condition", "left"]),
        ("explorers", &["--method", "asid"]),
        ("explorers", &["--seeds", "3"]),
        ("explorers", &["--truth", "mass_offset=0.02"]),
        ("explorers", &["--preset", "published"]),
        ("explorers", &["--model", "scene.xml"]),
        ("explorers", &["--real-model", "scene.xml"]),
        ("explorers", &["--real-backend", "rapier"]),
        ("explorers", &["--real-effect", "mass@ball:factor=2"]),
        ("explorers", &["--levels", "ledge_width=0.06"]),
        ("explorers", &["--submit", "slurm"]),
        ("explorers", &["--identifier", "reps"]),
        ("explorers", &["--solver", "cem"]),
        ("explorers", &["--train"]),
        ("explorers", &["--shard", "1/2"]),
        ("explorers", &["--table", "1"]),
        ("explorers", &["--merge", "a"]),
        ("difficulty", &["--explorer", "random"]),
        ("difficulty", &["--episodes", "2"]),
        ("difficulty", &["--shard", "1/2"]),
    ];
    for (name, arguments) in unused {
        let output = figure(&place, name, arguments, "out");
        let text = said(&output);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{name} {arguments:?}: {text}"
        );
        let option = if arguments[0].starts_with("--") {
            arguments[0]
        } else {
            "TASK"
        };
        let expected = format!("{option}: the figure `{name}` does not use it");
        assert!(
            text.contains(&expected) && text.lines().count() == 1,
            "{name} {arguments:?}: {text}"
        );
    }
    let engines = ["--backend", "rapier", "--backend", "mujoco"];
    let text = said(&figure(&place, "explorers", &engines, "out"));
    assert!(
        text.contains("--backend: ") && text.contains("one engine"),
        "{text}"
    );
    assert!(place.names().is_empty());
}

#[test]
fn counts_of_episodes_are_at_least_one() {
    let place = Workplace::new();
    for count in ["0", "-2", "many", "99999999999999999999"] {
        let output = figure(&place, "laptop", &["--episodes", count], "out");
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(
            text.contains("--episodes") && text.contains("at least 1") && text.lines().count() == 1,
            "{text}"
        );
    }
    assert!(place.names().is_empty());
}

/// One episode is no evidence about the paper's claim. An explorer named twice plays once, and two
/// with the same values have a name each.
#[test]
fn few_episodes_make_no_verdict_and_explorers_count_once_by_names_of_their_own() {
    let place = Workplace::new();
    let explorers = [
        "random",
        "fisher-cem:iterations=2",
        "random",
        "fisher-cem:prior_samples=2",
    ];
    let mut arguments = vec!["rod-balancing", "rod-balancing", "--episodes", "1"];
    arguments.extend(explorers.iter().flat_map(|e| ["--explorer", e]));
    let output = figure(&place, "explorers", &arguments, "a");
    assert!(output.status.success(), "{}", said(&output));
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(told.contains("too few episodes to tell: "), "{told}");
    assert!(
        place
            .read("a/report.html")
            .contains("too few episodes to tell")
    );
    let page = said(&place.run(&["report", "a"]));
    assert!(
        page.contains("folder of a figure") && page.contains("a/report.html"),
        "{page}"
    );
    let result = result(&place, "a");
    assert_eq!(result["claims"][0]["verdict"], "too-few-episodes");
    let numbers = result["numbers"].as_array().unwrap();
    assert!(
        numbers.iter().all(|n| n["n"].as_u64() <= Some(1)),
        "{numbers:?}"
    );
    let episodes = place.read("a/episodes.csv");
    let names: Vec<&str> = episodes
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(1).unwrap())
        .collect();
    let expected = [
        "random",
        "fisher-cem iterations=2",
        "fisher-cem prior_samples=2",
    ];
    assert_eq!(names, expected);
}

#[test]
fn episodes_of_a_map_of_pushes_have_a_truth_of_their_own() {
    let place = Workplace::new();
    let explorer = ["--quick", "--explorer", "random"];
    let output = figure(&place, "generalization", &explorer, "a");
    assert!(output.status.success(), "{}", said(&output));
    drawn(&place, "a");
    let text = place.read("a/pushes.csv");
    let seeds: Vec<(&str, &str)> = text
        .lines()
        .skip(1)
        .map(|line| {
            let mut cells = line.split(',');
            (cells.next().unwrap(), cells.next().unwrap())
        })
        .collect();
    let mut once = seeds.clone();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), seeds.len());
    let two = ["--explorer", "random", "--explorer", "fisher-cem"];
    let refused = figure(&place, "generalization", &two, "b");
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        said(&refused).contains("shows one explorer"),
        "{}",
        said(&refused)
    );
}

/// Symptom: the seed of a run's configuration changed nothing in a figure. Cause: its episodes
/// counted up from that of `--seed` alone.
#[test]
fn episodes_count_up_from_the_seed_of_the_settings() {
    let place = Workplace::new();
    let one = ["--explorer", "random", "--episodes", "1", "--set", "seed=7"];
    let output = figure(&place, "distractors", &one, "a");
    assert!(output.status.success(), "{}", said(&output));
    let balls = place.read("a/balls.csv");
    let rows = balls.lines().skip(1);
    let seeds: Vec<&str> = rows.map(|line| line.split(',').nth(1).unwrap()).collect();
    assert!(
        !seeds.is_empty() && seeds.iter().all(|s| *s == "7"),
        "{balls}"
    );
}

/// Symptom: a method that could not be run was missing in a curve without a word.
#[test]
fn a_curve_of_difficulty_tells_of_methods_that_were_left_out() {
    let place = Workplace::new();
    let levels = ["rod-balancing", "--levels", "ledge_width=0.06,0.01"];
    // Nothing ships for this explorer.
    let methods = ["--method", "x=task-ppo+reps+cem", "--method", "dr"];
    let runs = ["--seeds", "1", "--condition", "left"];
    let output = figure(
        &place,
        "difficulty",
        &[&levels[..], &methods, &runs].concat(),
        "a",
    );
    assert!(output.status.success(), "{}", said(&output));
    let result = result(&place, "a");
    let notes = result["notes"].as_array().unwrap();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(
        notes[0]
            .as_str()
            .unwrap()
            .starts_with("Left out: x on rod-balancing"),
        "{notes:?}"
    );
}

#[test]
fn a_wrong_setting_of_an_explorer_is_told_of_before_any_episode() {
    let place = Workplace::new();
    let arguments = ["compare", "--figure", "laptop", "--explorer", "random"];
    let wrong = ["--explorer", "random:foo=1", "--out", "out"];
    let output = place.run(&[&arguments[..], &wrong].concat());
    let text = said(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("foo") && !text.contains("episodes"), "{text}");
    assert!(place.names().is_empty());
}

#[cfg(not(feature = "torch"))]
#[test]
fn without_libtorch_the_figure_of_learned_models_says_so() {
    let place = Workplace::new();
    let output = figure(&place, "learned-model", &[], "a");
    let text = said(&output);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text.contains("libtorch") && text.lines().count() == 1,
        "{text}"
    );
    assert!(place.names().is_empty());
}

/// A ball that nobody touches lies still, and the simulator knows that. The figure shows how far a
/// model that learned from few episodes lets the ball drift.
#[cfg(feature = "torch")]
#[test]
fn learned_models_are_held_against_the_simulator() {
    let place = Workplace::new();
    let sources = ["--explorer", "fisher-cem", "--explorer", "random"];
    let arguments = [&sources[..], &["--episodes", "3"]].concat();
    let output = figure(&place, "learned-model", &arguments, "a");
    assert!(output.status.success(), "{}", said(&output));
    drawn(&place, "a");
    let result = result(&place, "a");
    let numbers = result["numbers"].as_array().unwrap();
    let of = |model: &str, quantity: &str| {
        let holds = |n: &&Value| n["explorer"] == model && n["quantity"] == quantity;
        numbers.iter().find(holds).unwrap()["value"]
            .as_f64()
            .unwrap()
    };
    let error = "left alone outside: error of the ball's place";
    assert!(of("simulator, fitted", error) < 1e-6);
    let learned = of("learned from fisher-cem", error);
    assert!(learned > 1e-4, "{learned}");
    // The simulator's error counts as the tracker's noise, 2 mm.
    let ratio = "left alone outside: error over that of the fitted simulator";
    let expected = learned / 2e-3;
    assert!((of("learned from fisher-cem", ratio) / expected - 1.0).abs() < 1e-9);
}
