//! `asid config` prints a complete configuration that can be read back.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // not every test needs all of it
mod cli_support;

use asid::core::registry::{TaskEntry, all};
use cli_support::Workplace;
use toml::Table;

/// What `asid config` prints.
fn printed(place: &Workplace, arguments: &[&str]) -> String {
    let output = place.run(&[&["config"], arguments].concat());
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Asserts that a page has all of some texts.
fn assert_tells(page: &str, texts: &[&str]) {
    for told in texts {
        assert!(page.contains(told), "`{told}` is not in\n{page}");
    }
}

#[test]
fn what_is_printed_for_a_task_is_read_back_as_the_same() {
    let place = Workplace::new();
    for task in all::<TaskEntry>() {
        let page = printed(&place, &[task.name]);
        let settings: Table = page.parse().unwrap();
        assert_eq!(settings["task"].as_str(), Some(task.name));
        place.write("settings.toml", &page);
        let again = printed(&place, &[task.name, "--config", "settings.toml"]);
        assert_eq!(page, again, "{}", task.name);
    }
}

#[test]
fn settings_stand_under_their_meanings_and_follow_the_options() {
    let place = Workplace::new();
    let options = ["--world", "perturbed", "--set", "explorer.iterations=7"];
    let page = printed(&place, &[&["rod-balancing"], &options[..]].concat());
    assert_tells(
        &page,
        &[
            "# Refits of the distribution.\niterations = 7\n",
            "One of one-step, trajectory.\nform = ",
            "[real.perturbation]",
            "# Time constant of a first-order lag between commands and servos, s.",
            "width of the ledge",
        ],
    );
}

#[test]
fn several_models_identify_where_the_world_deviates_by_chance() {
    let place = Workplace::new();
    let perturbed = ["--world", "perturbed"];
    let as_it_is = ["--set", "model_errors.members=0"];
    let without_scatter = ["--identifier", "gauss-newton"];
    for (options, members) in [
        (vec![], 0),
        (perturbed.to_vec(), 16),
        ([perturbed, as_it_is].concat(), 0),
        ([perturbed, without_scatter].concat(), 0),
    ] {
        let page = printed(&place, &[&["rod-balancing"], &options[..]].concat());
        let settings: Table = page.parse().unwrap();
        let set = settings["model_errors"]["members"].as_integer();
        assert_eq!(set, Some(members), "{options:?}");
    }
}

#[test]
fn what_is_printed_for_a_study_is_read_back_as_the_same() {
    let place = Workplace::new();
    place.write("study.toml", "model = \"robot.xml\"\ntrain = [\"*.csv\"]\n");
    let options = ["--set", "search.depth=2", "--set", "minutes=3.0"];
    let page = printed(&place, &[&["study.toml"], &options[..]].concat());
    assert_tells(
        &page,
        &[
            "study = \"study.toml\"",
            "minutes = 3.0",
            "depth = 2",
            "false_alarms = 0.01",
        ],
    );
    let unexplained = page
        .split("\n\n")
        .filter(|part| part.contains(" = ") && !part.contains('#'));
    assert_eq!(unexplained.count(), 0, "{page}");
    place.write("settings.toml", &page);
    let again = printed(&place, &["study.toml", "--config", "settings.toml"]);
    assert_eq!(page, again);
}

#[test]
fn settings_of_each_command_on_a_study_stand_under_their_meanings() {
    let place = Workplace::new();
    let study = env!("CARGO_MANIFEST_DIR").to_owned() + "/studies/servo-pendulum";
    let explore = printed(&place, &[&study, "--of", "explore"]);
    assert_tells(
        &explore,
        &["# Length of the motion, s.", "[design]", "knots = "],
    );
    let identify = printed(&place, &[&study, "--of", "identify"]);
    assert_tells(
        &identify,
        &["[gauss_newton]", "# Most iterations from each start."],
    );
    // A model has no logs: it can only be explored.
    let model = printed(&place, &[&(study + "/nominal.xml")]);
    assert_tells(&model, &["asid explore", "[design]"]);
}

#[test]
fn an_unknown_task_is_refused_with_the_near_ones() {
    let place = Workplace::new();
    let output = place.run(&["config", "rod-balancin"]);
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(
        error.contains("`rod-balancing`") && error.lines().count() == 1,
        "{error}"
    );
}
