//! A refined model in place of a task's scene, on the command line.

#![allow(clippy::unwrap_used)]

mod cli_support;

use cli_support::{Workplace, tiny};
use serde_json::Value;

/// Runs a command that must succeed.
fn done(place: &Workplace, arguments: &[&str]) {
    let output = place.run(arguments);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
}

/// Runs a command that must be refused with one line that holds all of `expected`.
fn refused(place: &Workplace, arguments: &[&str], expected: &[&str]) {
    let before = place.names();
    let output = place.run(arguments);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {line}");
    assert_eq!(line.lines().count(), 1, "{arguments:?}: {line}");
    for text in expected {
        assert!(
            line.contains(text),
            "{arguments:?}: `{text}` is not in: {line}"
        );
    }
    assert_eq!(place.names(), before, "{arguments:?} left something");
}

/// A number of a folder's result.json.
fn figure(place: &Workplace, folder: &str, pointer: &str) -> f64 {
    let result: Value =
        serde_json::from_str(&place.read(&format!("{folder}/result.json"))).unwrap();
    result.pointer(pointer).unwrap().as_f64().unwrap()
}

/// Writes the scene of a task and a refined model of it.
///
/// The refined model has dry friction in a joint, and gravity tilted by 0.1 rad, so that what lies
/// on the table slides in -y.
fn refined(place: &Workplace, task: &str) {
    done(place, &["export", task, "--out", "scene.xml"]);
    place.write(
        "refined.toml",
        "model = \"scene.xml\"\n\
         [[effect]]\neffect = \"gravity-tilt\"\nparameters = { roll = 0.1 }\n\
         [[effect]]\neffect = \"coulomb-friction\"\nsite = \"joint1\"\nparameters = { force = 2 }\n",
    );
}

#[test]
fn the_effects_of_a_refined_model_are_in_the_simulator_and_its_config_repeats_it() {
    let place = Workplace::new();
    refined(&place, "shuffleboard");
    let solve = [
        "solve",
        "shuffleboard",
        "--posterior",
        "prior",
        "--threads",
        "1",
    ];
    let solve = |more: &[&str]| done(&place, &tiny(&[&solve[..], more].concat()));
    solve(&["--out", "plain"]);
    // The exported scene gives the same result as the task's scene.
    solve(&["--out", "same", "--model", "scene.xml"]);
    solve(&["--out", "other", "--model", "refined.toml"]);
    solve(&["--out", "again", "--config", "other/config.toml"]);
    let value = |folder: &str| figure(&place, folder, "/expected/value");
    assert_eq!(value("plain").to_bits(), value("same").to_bits());
    assert!((value("plain") - value("other")).abs() > 1e-3);
    assert_eq!(value("other").to_bits(), value("again").to_bits());
    assert!(
        place
            .read("other/config.toml")
            .contains("model = \"refined.toml\"")
    );
}

#[test]
fn the_episode_of_a_refined_real_world_is_played_and_explained_by_the_same_model() {
    let place = Workplace::new();
    refined(&place, "shuffleboard");
    let truth = [
        "--truth",
        "sliding_friction=0.02",
        "--truth",
        "torsional_friction=0.002",
    ];
    let explore = [
        "explore",
        "shuffleboard",
        "--real-model",
        "refined.toml",
        "--out",
        "real",
    ];
    done(&place, &tiny(&[&explore[..], &truth].concat()));
    let log = place.path("real/real.csv");
    let task = asid_tasks::shuffleboard::Shuffleboard::new(asid_tasks::shuffleboard::Zone::Near);
    let plant = asid_mjcf::Plant::of(asid_core::Task::scene(&task.unwrap())).unwrap();
    let episode = asid::logs::episode::read(&log, &plant.layout).unwrap();
    assert_eq!(episode.rows(), 101);
    let log = log.display().to_string();
    let identify = |out: &str, more: &[&str]| {
        let all = ["identify", "shuffleboard", "--log", &log, "--out", out];
        done(&place, &tiny(&[&all[..], more].concat()));
        figure(&place, out, "/residual")
    };
    let (plain, refined) = (
        identify("plain", &[]),
        identify("refined", &["--model", "refined.toml"]),
    );
    assert!(plain > 3.0 * refined, "{plain} {refined}");
}

#[test]
fn models_that_cannot_stand_for_the_simulator_are_refused_in_one_line() {
    let place = Workplace::new();
    done(&place, &["export", "rod-balancing", "--out", "scene.xml"]);
    for (name, text, expected) in [
        ("torn.toml", "model = ", "no refined model"),
        ("lost.toml", "model = \"none.xml\"", "none.xml"),
        (
            "nowhere.toml",
            "model = \"scene.xml\"\n[[effect]]\neffect = \"viscous-friction\"\nsite = \"joint9\"\n\
             parameters = { damping = 1 }",
            "joint9",
        ),
        (
            "unheard.toml",
            "model = \"scene.xml\"\n[[effect]]\neffect = \"viscos-friction\"\nsite = \"joint1\"",
            "viscous-friction",
        ),
        (
            "element.toml",
            "model = \"scene.xml\"\n[[parameter]]\ntarget = \"joint/joint9/damping\"\nvalue = 1",
            "joint9",
        ),
        (
            "ball.xml",
            "<mujoco><worldbody><body name=\"rod\"><freejoint/><geom size=\"0.1\"/></body></worldbody></mujoco>",
            "actuators",
        ),
    ] {
        place.write(name, text);
        for command in [
            &["run", "rod-balancing", "--out", "out"][..],
            &[
                "solve",
                "rod-balancing",
                "--posterior",
                "prior",
                "--out",
                "out",
            ],
            &[
                "compare",
                "rod-balancing",
                "--seeds",
                "1",
                "--quiet",
                "--out",
                "out",
            ],
        ] {
            let arguments = tiny(&[command, &["--model", name]].concat());
            refused(&place, &arguments, &[expected]);
        }
        refused(
            &place,
            &tiny(&["run", "rod-balancing", "--out", "out", "--real-model", name]),
            &[expected],
        );
    }
}
