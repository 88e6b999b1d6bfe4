//! Exploration that discriminates between rival explanations, and the loop from a task's runs
//! through their diagnosis back to the task.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // not every test needs all of it
mod cli_support;

mod plugin_support;
#[allow(dead_code)] // not every test needs all of it
mod task_support;

use std::sync::Arc;

use asid::algorithms::explore::{Discriminating, Rival};
use asid::core::registry::{BackendEntry, all};
use asid::core::{Explorer as _, Model, Problem};
use asid::effects::EffectEntry;
use cli_support::{Workplace, names, tiny};
use serde_json::Value;

/// A puck that slides with this friction.
fn puck(problem: &Problem<'_>, model: &Arc<dyn Model>, friction: f64) -> Rival {
    Rival {
        label: format!("friction {friction}"),
        model: Arc::clone(model),
        parameters: problem.parameters.to_vec(),
        theta: vec![friction, 0.002],
        weight: 0.5,
    }
}

/// Calls `check` with the shuffleboard on the first engine.
fn on_the_shuffleboard(check: impl Fn(&Problem<'_>, &Arc<dyn Model>)) {
    let task = task_support::task("shuffleboard");
    let backend = (all::<BackendEntry>()[0].make)().unwrap();
    task_support::on_engine(&*backend, &*task, &task.parameters(), 0, check);
}

#[test]
fn rivals_differ_only_where_the_puck_slides_and_the_plan_makes_it_slide() {
    on_the_shuffleboard(|problem, model| {
        let protocol = problem.task.exploration();
        let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
        let still = vec![0.0; protocol.horizon * protocol.action.len()];
        let ahead: Vec<f64> = (0..protocol.horizon)
            .flat_map(|_| protocol.action.iter().enumerate())
            .map(|(i, c)| if i == 0 { c.range[1] } else { 0.0 })
            .collect();
        let plans = [still, ahead];

        // The same explanation twice cannot be distinguished by any plan.
        let same = [0.02, 0.02].map(|f| puck(problem, model, f));
        let mut explorer = Discriminating::new(same.to_vec()).unwrap();
        let none = explorer.divergence(problem, &start, &plans).unwrap();
        assert!(none.iter().all(|d| *d < 1e-20), "{none:?}");

        // Two frictions differ once the puck slides. With more friction it slides less far, by a
        // share of its path that is many times the tracking noise of 2 mm.
        explorer.rivals = [0.012, 0.03].map(|f| puck(problem, model, f)).to_vec();
        let apart = explorer.divergence(problem, &start, &plans).unwrap();
        assert!(apart[0] < 0.1 && apart[1] > 100.0, "{apart:?}");

        // Half of the squared distance in units of the noise, weighted by both weights.
        explorer.rivals[0].weight = 0.9;
        explorer.rivals[1].weight = 0.1;
        let weighted = explorer.divergence(problem, &start, &plans).unwrap();
        assert!((weighted[1] / apart[1] - 0.09 / 0.25).abs() < 1e-9);

        explorer.iterations = 2;
        explorer.population = 8;
        let mut explored = explorer.explore(problem, Some(&start)).unwrap();
        let curve = explored.curve.clone();
        let plan: Vec<f64> = (0..protocol.horizon)
            .flat_map(|h| {
                let mut action = vec![0.0; protocol.action.len()];
                explored.policy.act(h, &[], &mut action).unwrap();
                action
            })
            .collect();
        let best = explorer.divergence(problem, &start, &[plan]).unwrap()[0];
        assert!(best > 10.0 && best >= curve[0].mean, "{best} {curve:?}");
        assert!(explored.objective.contains("friction 0.012"));
    });
}

#[test]
fn one_explanation_cannot_be_told_apart() {
    on_the_shuffleboard(|problem, model| {
        let one = vec![puck(problem, model, 0.02)];
        let error = Discriminating::new(one).err().unwrap().to_string();
        assert!(error.contains("at least two"), "{error}");
    });
}

/// Options that leave a catalogue of two effects, which keeps a test short.
fn two_effects() -> Vec<&'static str> {
    let kept = ["actuator-bias", "sensor-bias"];
    all::<EffectEntry>()
        .iter()
        .map(|e| e.name)
        .filter(|n| !kept.contains(n))
        .flat_map(|n| ["--without", n])
        .collect()
}

/// Symptom: where the search used up its time, the task was not tried again. Cause: the end of the
/// time was taken for an interruption.
#[test]
fn a_task_is_tried_again_when_the_time_of_the_search_is_up() {
    let place = Workplace::new();
    let call = [
        "diagnose",
        "--task",
        "shuffleboard",
        "--minutes",
        "1e-4",
        "--runs",
        "2",
        "--seeds",
        "1",
        "--set",
        "logs=exploration",
        "--out",
        "a",
    ];
    let output = place.run(&tiny(&[&call[..], &two_effects()[..]].concat()));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    assert!(errors.contains("the time is up"), "{errors}");
    let result: Value = serde_json::from_str(&place.read("a/result.json")).unwrap();
    let trials = result["real_world"]["trials"].as_array().unwrap();
    assert_eq!(trials[0]["values"].as_array().unwrap().len(), 1);
}

/// The task is a plugin's, a pendulum: diagnoses of one joint take seconds.
#[test]
fn a_task_is_run_diagnosed_and_run_again() {
    let place = Workplace::new();
    let without = two_effects();
    let libraries = plugin_support::build(&["payload-swing"]);
    let call = [
        "--plugin",
        libraries[0].to_str().unwrap(),
        "diagnose",
        "--task",
        "payload-swing",
        "--minutes",
        "60",
        "--runs",
        "2",
        "--experiments",
        "1",
        "--seeds",
        "1",
        "--real-effect",
        "actuator-bias@motor:bias=0.5",
        "--set",
        "logs=exploration",
        "--set",
        "search.depth=1",
        "--set",
        "search.raced=2",
        "--set",
        "search.finished=1",
        "--out",
        "a",
    ];
    let output = place.run(&tiny(&[&call[..], &without[..]].concat()));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let result: Value = serde_json::from_str(&place.read("a/result.json")).unwrap();
    assert_eq!(
        result["verdict"]["effects"][0], "actuator-bias@motor",
        "{result:#}"
    );
    let world = &result["real_world"];
    assert_eq!(world["effects"][0], "actuator-bias@motor:bias=0.5");
    assert!(
        world["experiments"]
            .as_str()
            .unwrap()
            .contains("actuator-bias@motor")
    );
    let trials = world["trials"].as_array().unwrap();
    let told: Vec<&str> = trials
        .iter()
        .map(|t| {
            assert_eq!(t["values"].as_array().unwrap().len(), 1);
            t["simulator"].as_str().unwrap()
        })
        .collect();
    assert_eq!(
        told,
        [
            "the model as given",
            "the model as given",
            "the refined model"
        ]
    );
    assert_eq!(
        names(&place.path("a")),
        [
            "config.toml",
            "evidence.json",
            "model.xml",
            "next.csv",
            "refined.toml",
            "report.html",
            "result.json",
            "test-1.csv",
            "trace.json",
            "train-1.csv",
            "train-2.csv"
        ]
    );
    let page = place.read("a/report.html");
    assert!(page.contains("The task, before and after"));

    // The folder's settings repeat the run.
    let again = [
        "diagnose",
        "--trust-plugins",
        "--config",
        "a/config.toml",
        "--out",
        "b",
    ];
    let again = place.run(&again);
    assert!(
        again.status.success(),
        "{}",
        String::from_utf8_lossy(&again.stderr)
    );
    // Everything but the elapsed time is the same.
    let [first, second] = ["a", "b"].map(|folder| {
        let text = place.read(&format!("{folder}/result.json"));
        let mut result: serde_json::Value = serde_json::from_str(&text).unwrap();
        let result = result.as_object_mut().unwrap();
        assert!(result.remove("seconds").unwrap().as_f64().unwrap() > 0.0);
        result.remove("seconds_to_first_table");
        result.clone()
    });
    assert_eq!(first, second);
    assert_eq!(place.read("a/config.toml"), place.read("b/config.toml"));
}

#[test]
fn a_study_has_no_machine_that_could_be_run() {
    let place = Workplace::new();
    let output = place.run(&["diagnose", "study", "--runs", "3"]);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{line}");
    assert!(
        line.contains("--task") && line.lines().count() == 1,
        "{line}"
    );
    let output = place.run(&["diagnose", "--task", "shuffleboard", "--runs", "1"]);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{line}");
    assert!(line.contains("--runs"), "{line}");
    assert!(place.names().is_empty());
}
