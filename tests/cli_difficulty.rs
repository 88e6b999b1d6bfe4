//! The difficulty of a task on the command line, in its folder and in its report.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // not every test needs all of it
mod cli_support;

use cli_support::Workplace;
use toml::Table;

/// Explores at random, which is quick, and returns the settings that it wrote.
fn explored(place: &Workplace, out: &str, options: &[&str]) -> Table {
    let mut arguments = vec!["explore", "sphere-distractors", "--explorer", "random"];
    arguments.extend(["--truth", "rolling_friction=0.002", "--quiet", "--out", out]);
    arguments.extend(options);
    let output = place.run(&arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {error}");
    place.read(&format!("{out}/config.toml")).parse().unwrap()
}

fn number(config: &Table, section: &str, key: &str) -> f64 {
    config[section][key].as_float().unwrap()
}

#[test]
fn a_preset_and_single_values_reach_the_trackers_and_the_config_repeats_them() {
    let place = Workplace::new();
    let set = [
        "--preset",
        "published",
        "--set",
        "difficulty.goal_radius=0.03",
    ];
    let config = explored(&place, "a", &set);
    for (key, value) in [
        ("goal_radius", 0.03),
        ("hand_speed", 0.75),
        ("tracker_noise", 0.01),
        ("tracker_rate", 10.0),
        ("contact_time", 0.03),
    ] {
        assert_eq!(number(&config, "difficulty", key), value, "{key}");
    }
    assert_eq!(number(&config, "noise", "ball_pos"), 0.01);
    assert_eq!(number(&config, "noise", "distractor_3_pos"), 0.01);
    // A run with its own configuration repeats it to the byte.
    let again = explored(&place, "b", &["--config", "a/config.toml"]);
    assert_eq!(again, config);
    assert_eq!(place.read("a/real.csv"), place.read("b/real.csv"));
    // Another difficulty has its own noise, and a preset on the command line overrides the file.
    let finer = [
        "--config",
        "a/config.toml",
        "--set",
        "difficulty.tracker_noise=0.004",
    ];
    let finer = explored(&place, "c", &finer);
    assert_eq!(number(&finer, "noise", "ball_pos"), 0.004);
    assert_eq!(number(&finer, "difficulty", "goal_radius"), 0.03);
    let own = explored(
        &place,
        "d",
        &["--config", "a/config.toml", "--preset", "default"],
    );
    assert_eq!(number(&own, "difficulty", "goal_radius"), 0.05);
    assert_eq!(number(&own, "noise", "ball_pos"), 0.002);
    // Explicit noise overrides that of the difficulty.
    let said = ["--preset", "published", "--set", "noise.ball_pos=0.003"];
    let said = explored(&place, "e", &said);
    assert_eq!(number(&said, "noise", "ball_pos"), 0.003);
    assert_eq!(number(&said, "noise", "distractor_1_pos"), 0.01);
}

/// A ball has no heading and may be read only ten times a second. The report still shows its path
/// and those of the balls beside it.
#[test]
fn reports_show_where_the_balls_went() {
    let place = Workplace::new();
    explored(&place, "a", &["--preset", "published"]);
    let log = place.read("a/real.csv");
    let column = log
        .lines()
        .next()
        .unwrap()
        .split(',')
        .position(|c| c == "distractor_2_pos.0");
    let cells: Vec<&str> = log
        .lines()
        .skip(1)
        .map(|l| l.split(',').nth(column.unwrap()).unwrap())
        .collect();
    let present = cells.iter().filter(|c| !c.is_empty()).count();
    assert_eq!((cells.len(), present), (101, 21));
    let page = place.read("a/report.html");
    for text in [
        "The predicted episode",
        "The ball moved by",
        "the distractor 3 moved by",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(!page.contains("No view from above"));
}

#[test]
fn difficulties_that_cannot_be_are_refused_in_a_line() {
    let place = Workplace::new();
    for (task, options, expected) in [
        (
            "rod-balancing",
            ["--set", "difficulty.ledge_width=3"],
            "0.004 to 0.1 m",
        ),
        (
            "rod-balancing",
            ["--set", "difficulty.ledge_widht=0.02"],
            "`ledge_width`",
        ),
        (
            "rod-balancing",
            ["--set", "difficulty.xyz=1"],
            "`hand_speed`",
        ),
        (
            "rod-balancing",
            ["--set", "difficulty.tracker_rate=20"],
            "10 Hz",
        ),
        (
            "rod-balancing",
            ["--set", "difficulty.ledge_width=wide"],
            "finite number",
        ),
        ("sphere-free", ["--preset", "hard"], "`published`"),
    ] {
        let arguments = [&["run", task, "--out", "out"], &options[..]].concat();
        let output = place.run(&arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(
            error.contains(expected) && error.trim().lines().count() == 1,
            "{error}"
        );
    }
    assert!(place.names().is_empty());
}

#[test]
fn an_exported_scene_is_that_of_the_difficulty() {
    let place = Workplace::new();
    let set = ["--set", "difficulty.ledge_width=0.02"];
    let export = ["export", "rod-balancing", "--out", "rod.xml", "--json"];
    let output = place.run(&[&export[..], &set[..]].concat());
    assert!(output.status.success());
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a summary");
    assert_eq!(summary["file"], "rod.xml");
    assert!(place.read("rod.xml").contains(r#"size="0.01 0.05 0.075""#));
}
