//! The machine in 3-D in the reports: the data, and what a browser shows of them.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // A test that is skipped says so.

mod browser_support;
#[path = "cli_support/mod.rs"]
#[allow(dead_code)]
mod cli_support;
#[path = "diagnosis/world.rs"]
#[allow(dead_code)]
mod world;

use cli_support::{Workplace, tiny};
use serde_json::Value;
use world::{Truth, write_study};

/// Size limit of a report, bytes.
const LARGEST: u64 = 3_000_000;

fn ok(place: &Workplace, arguments: &[&str]) {
    let done = place.run(arguments);
    assert!(
        done.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&done.stderr)
    );
}

/// Asserts that a folder's report is drawn in both themes, moves with the slider, and has no
/// errors.
///
/// `machines` are the beginnings of the names in the legend.
fn looks_right(place: &Workplace, folder: &str, machines: &[&str]) {
    let page = place.path(folder).join("report.html");
    let size = std::fs::metadata(&page).unwrap().len();
    assert!(size < LARGEST, "{folder}: {size} bytes");
    let Some(browser) = browser_support::browser() else {
        return;
    };
    for dark in [false, true] {
        let seen = browser_support::seen(&browser, &page, dark);
        let number = |key: &str| {
            seen[key]
                .as_f64()
                .unwrap_or_else(|| panic!("{key}: {seen}"))
        };
        assert_eq!(seen["wrong"], Value::Array(Vec::new()), "{folder}: {seen}");
        // A blank canvas has one colour. The curved surfaces of a machine and the soft lines of the
        // grid have many.
        assert!(number("colours") > 50.0, "{folder}: {seen}");
        // A motion is visible if it changes more than a thousandth of the picture.
        assert!(
            number("moved") > number("pixels") / 1000.0,
            "{folder}: {seen}"
        );
        assert_eq!(
            number("same"),
            0.0,
            "{folder}: the slider came back: {seen}"
        );
        assert!(
            number("turned") > number("pixels") / 100.0,
            "{folder}: {seen}"
        );
        assert!(
            number("lines") > 0.0 && seen["lines"] == seen["linesMoved"],
            "{folder}: {seen}"
        );
        let clicked = number("clicked") / number("end");
        assert!((0.4..0.8).contains(&clicked), "{folder}: {clicked}");
        // The corner shows the page's background.
        let bright: f64 = seen["corner"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .sum();
        assert!(
            if dark { bright < 150.0 } else { bright > 600.0 },
            "{folder}: {seen}"
        );
        let legend = seen["legend"].as_array().unwrap();
        for machine in machines {
            let entry = legend
                .iter()
                .find(|e| e["name"].as_str().unwrap().starts_with(machine));
            let entry = entry.unwrap_or_else(|| panic!("{folder}: no {machine} in {seen}"));
            assert!(
                entry["changed"].as_f64().unwrap() > 20.0,
                "{folder}: {entry}"
            );
        }
        for episode in seen["episodes"].as_array().unwrap() {
            assert!(
                episode["moved"].as_f64().unwrap() > 100.0,
                "{folder}: {episode}"
            );
            // The selected episode shows what its name says.
            for part in ["missing force", "real"] {
                let named = episode["name"].as_str().unwrap().contains(part);
                let there = episode["legend"].as_str().unwrap().contains(part);
                assert!(there || !named, "{folder}: {episode}");
            }
        }
    }
}

/// The view in a folder's `trace.json`.
fn view(place: &Workplace, folder: &str) -> Value {
    let trace: Value = serde_json::from_str(&place.read(&format!("{folder}/trace.json"))).unwrap();
    trace["view"].clone()
}

#[test]
fn a_diagnosis_shows_the_log_both_models_and_the_force_that_is_missing() {
    let place = Workplace::new();
    write_study(&place.path("study"), Truth::Coulomb(1.2));
    ok(&place, &["diagnose", "study", "--quiet", "--out", "out"]);
    let view = view(&place, "out");
    let takes = view["takes"].as_array().unwrap();
    let origins = |take: &Value| -> Vec<String> {
        let machines = take["machines"].as_array().unwrap().iter();
        machines
            .map(|m| m["origin"].as_str().unwrap().to_owned())
            .collect()
    };
    assert_eq!(origins(&takes[0]), ["real", "nominal", "before", "after"]);
    assert_eq!(takes[0]["what"], "held out");
    let with_force = takes
        .iter()
        .find(|t| !t["forces"].as_array().unwrap().is_empty())
        .unwrap();
    let force = &with_force["forces"][0];
    assert_eq!(
        (&force["dof"], &force["axis"][0]),
        (&"rail".into(), &1.0.into())
    );
    let sum = |key: &str| -> f64 {
        let values = force[key].as_array().unwrap().iter();
        values.map(|x| x.as_f64().unwrap().powi(2)).sum()
    };
    // The missing force of the refined model is a small part of that of the nominal one.
    assert!(
        sum("after") < 0.2 * sum("before"),
        "{} {}",
        sum("after"),
        sum("before")
    );
    looks_right(
        &place,
        "out",
        &["real", "nominal model", "identified model"],
    );
    // The report is written anew from its files, byte for byte.
    let page = place.read("out/report.html");
    ok(&place, &["report", "out"]);
    assert!(place.read("out/report.html") == page);
}

#[test]
fn a_run_shows_the_real_episode_and_its_replays() {
    let place = Workplace::new();
    ok(
        &place,
        &tiny(&["run", "rod-balancing", "--quiet", "--out", "out"]),
    );
    let view = view(&place, "out");
    let take = &view["takes"][0];
    assert_eq!(take["machines"].as_array().unwrap().len(), 3);
    // The rod lies on the table.
    let touching = take["machines"][2]["touching"].as_array().unwrap();
    assert!(
        touching.iter().any(|n| n.as_u64().unwrap() > 0),
        "{touching:?}"
    );
    looks_right(&place, "out", &["real", "before", "contact points"]);
}

#[test]
fn an_exploration_shows_what_the_simulator_expects() {
    let place = Workplace::new();
    let quick: Vec<&str> = (cli_support::TINY.iter())
        .filter(|s| s.starts_with("explorer."))
        .flat_map(|s| ["--set", s])
        .collect();
    let arguments = [
        &["explore", "rod-balancing", "--quiet", "--out", "task"][..],
        &quick,
    ]
    .concat();
    ok(&place, &arguments);
    assert_eq!(
        view(&place, "task")["takes"][0]["machines"][0]["origin"],
        "predicted"
    );
    looks_right_without_plots(&place, "task");
}

/// Like [`looks_right`], for a page without plots over time.
fn looks_right_without_plots(place: &Workplace, folder: &str) {
    let Some(browser) = browser_support::browser() else {
        return;
    };
    let seen = browser_support::seen(&browser, &place.path(folder).join("report.html"), false);
    assert_eq!(seen["wrong"], Value::Array(Vec::new()), "{seen}");
    assert!(seen["colours"].as_f64().unwrap() > 50.0, "{seen}");
    assert!(seen["moved"].as_f64().unwrap() > 100.0, "{seen}");
}
