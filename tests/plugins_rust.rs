//! Plugins in Rust, built and loaded as their authors would: a task, an explorer, an effect, and a
//! program that links one.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;
mod plugin_support;

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use cli_support::Workplace;
use serde_json::Value;

/// The libraries of the task, the explorer and the effect.
static LIBRARIES: LazyLock<Vec<PathBuf>> =
    LazyLock::new(|| plugin_support::build(&["payload-swing", "multisine", "magnetic-catch"]));

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// `--plugin FILE` for each library.
fn all() -> Vec<&'static str> {
    LIBRARIES
        .iter()
        .flat_map(|l| ["--plugin", text(l)])
        .collect()
}

/// Returns the standard output of a command that succeeds.
fn done(output: Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Settings for a short search of an exploration.
const QUICK: [&str; 2] = ["--set", "explorer.iterations=2"];

#[test]
fn the_list_tells_where_everything_comes_from() {
    let place = Workplace::new();
    let listed = done(place.run(&[&all()[..], &["list", "--json"]].concat()));
    let rows: Vec<Value> = serde_json::from_str(&listed).unwrap();
    let origin = |name: &str| {
        let row = rows.iter().find(|r| r["name"] == name).unwrap();
        row["origin"].as_str().unwrap().to_owned()
    };
    let file = |i: usize| std::fs::canonicalize(&LIBRARIES[i]).unwrap();
    assert_eq!(origin("rod-balancing"), "built in");
    assert_eq!(origin("payload-swing"), text(&file(0)));
    assert_eq!(origin("multisine"), text(&file(1)));
    assert_eq!(origin("magnetic-catch"), text(&file(2)));
}

#[test]
fn a_loaded_task_runs_like_a_built_in_one_and_its_settings_repeat_the_run() {
    let place = Workplace::new();
    // A truth of the task's own: at the light end of the prior the peak depends on the damping.
    let run = ["run", "payload-swing", "--seed", "1", "--quiet", "--out"];
    let light = ["--set", "condition=\"light\""];
    let plugin = ["--plugin", text(&LIBRARIES[0])];
    done(place.run(&[&run[..], &["a"], &plugin[..], &light, &QUICK].concat()));
    let result: Value = serde_json::from_str(&place.read("a/result.json")).unwrap();
    let mass = &result["parameters"][0];
    let [estimate, truth] = ["estimate", "truth"].map(|key| mass[key].as_f64().unwrap());
    assert!((estimate / truth - 1.0).abs() < 0.03, "{mass}");
    let width = mass["interval95"][1].as_f64().unwrap() - mass["interval95"][0].as_f64().unwrap();
    assert!(width > 0.0 && width < 0.05, "{mass}");
    assert_eq!(result["downstream"]["success"], true);
    // Without naming the plugin again.
    let again = ["--config", "a/config.toml", "--quiet", "--out", "b"];
    let again = [&run[..2], &again].concat();
    done(place.run(&[&again[..], &["--trust-plugins"]].concat()));
    let again: Value = serde_json::from_str(&place.read("b/result.json")).unwrap();
    assert_eq!(again["parameters"], result["parameters"]);
}

/// Returns the one line on standard error of a refused call.
fn refused(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

#[test]
fn plugins_of_a_configuration_run_only_where_they_are_trusted_and_the_ones_that_were_recorded() {
    let place = Workplace::new();
    let suffix = std::env::consts::DLL_SUFFIX;
    let library = place.path(&format!("swing{suffix}"));
    std::fs::copy(&LIBRARIES[0], &library).unwrap();
    let call = [
        "compare",
        "payload-swing",
        "--method",
        "dr",
        "--seeds",
        "1",
        "--quiet",
        "--out",
    ];
    let quick = [
        "--set",
        "solver.iterations=1",
        "--set",
        "solver.population=2",
    ];
    done(place.run(&[&call[..], &["a", "--plugin", text(&library)], &quick].concat()));
    assert!(place.read("a/config.toml").contains("#sha256="));
    let again = ["compare", "--config", "a/config.toml", "--quiet", "--out"];
    let said = refused(&place.run(&[&again[..], &["b"]].concat()));
    assert!(
        said.contains("a/config.toml: names plugins") && said.contains("--trust-plugins"),
        "{said}"
    );
    done(place.run(&[&again[..], &["b", "--trust-plugins"]].concat()));
    // Naming the file means to trust it.
    done(place.run(&[&again[..], &["c", "--plugin", text(&library)]].concat()));
    // Another library in its place: nothing of it runs.
    std::fs::write(&library, std::fs::read(&LIBRARIES[1]).unwrap()).unwrap();
    let said = refused(&place.run(&[&again[..], &["d", "--trust-plugins"]].concat()));
    assert!(
        said.contains("is not the library that a/config.toml was made with"),
        "{said}"
    );
    assert!(!place.path("d").exists());
}

#[test]
fn loaded_explorer_and_effect_work_with_a_loaded_task() {
    let place = Workplace::new();
    let arguments = [
        "run",
        "payload-swing",
        "--explorer",
        "multisine",
        "--set",
        "explorer.highest=4",
        "--set",
        "identifier.iterations=1",
        "--real-effect",
        "magnetic-catch@shoulder:depth=0.05,place=0.1",
        "--quiet",
        "--out",
        "a",
    ];
    done(place.run(&[&arguments[..], &all()].concat()));
    let config = place.read("a/config.toml");
    for part in ["libpayload_swing", "libmultisine", "libmagnetic_catch"] {
        assert!(config.contains(part), "{config}");
    }
    let policy: Value = serde_json::from_str(&place.read("a/policy.json")).unwrap();
    assert_eq!(policy["actions"].as_array().unwrap().len(), 20);
}

#[test]
fn a_wrong_setting_of_a_loaded_explorer_is_a_wrong_call() {
    let place = Workplace::new();
    let call = [
        "run",
        "payload-swing",
        "--explorer",
        "multisine",
        "--set",
        "explorer.amplitude=2",
    ];
    let output = place.run(&[&all()[..], &call].concat());
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains("explorer.amplitude: must be above 0"),
        "{said}"
    );
}

#[test]
fn folders_are_searched_and_a_name_that_is_taken_gets_a_suffix() {
    let place = Workplace::new();
    let library = &LIBRARIES[0];
    let suffix = std::env::consts::DLL_SUFFIX;
    for folder in ["listed", "data/asid/plugins"] {
        std::fs::create_dir_all(place.path(folder)).unwrap();
        std::fs::copy(library, place.path(&format!("{folder}/swing{suffix}"))).unwrap();
    }
    let run = |arguments: &[&str]| {
        let mut command = place.asid(arguments);
        command
            .env("ASID_PLUGIN_PATH", place.path("listed"))
            .env("XDG_DATA_HOME", place.path("data"));
        done(command.output().unwrap())
    };
    let rows: Vec<Value> = serde_json::from_str(&run(&["list", "--json"])).unwrap();
    let find = |name: &str| rows.iter().find(|r| r["name"] == name).unwrap();
    let origin = |name| find(name)["origin"].as_str().unwrap().to_owned();
    assert!(origin("payload-swing").contains("listed"));
    assert!(origin("payload-swing@plugin").contains("data"));
    let about = find("payload-swing@plugin")["about"].as_str().unwrap();
    assert!(about.contains("`payload-swing` is taken"), "{about}");
    let doctor = run(&["doctor"]);
    assert!(
        doctor.contains("ASID_PLUGIN_PATH") && doctor.contains("data/asid/plugins"),
        "{doctor}"
    );
    let mut export = place.asid(&["export", "payload-swing@plugin", "--out", "scene.xml"]);
    let export = export.env("ASID_PLUGIN_PATH", place.path("listed"));
    let said = export
        .env("XDG_DATA_HOME", place.path("data"))
        .output()
        .unwrap();
    let said = String::from_utf8(said.stderr).unwrap();
    for from in [
        "from ASID_PLUGIN_PATH: task `payload-swing`",
        "from the user's data folder: task `payload-swing@plugin`",
    ] {
        assert!(said.contains(from), "{said}");
    }
    assert!(place.read("scene.xml").contains("payload"));
    // The same file named twice is one plugin.
    let named = place.path(&format!("listed/swing{suffix}"));
    let rows = run(&["list", "--plugin", text(&named)]);
    assert!(!rows.contains("@plugin2"), "{rows}");
}

#[test]
fn a_program_that_links_a_plugin_has_the_whole_command_line() {
    let program = plugin_support::build(&["my-asid"]).remove(0);
    let mut command = std::process::Command::new(program);
    // The program is built next to the tests and needs their native libraries, without a path to
    // them.
    let libraries = [("MUJOCO_DYNAMIC_LINK_DIR", ""), ("LIBTORCH", "lib")];
    let folders = libraries.iter().filter_map(|(variable, below)| {
        let folder = std::env::var_os(variable)?;
        Some(Path::new(&folder).join(below))
    });
    let folders = std::env::join_paths(folders).unwrap();
    command.arg("list").env("LD_LIBRARY_PATH", folders);
    let listed = done(command.output().unwrap());
    assert!(
        listed.contains("[linked in: payload-swing 0.1.0]"),
        "{listed}"
    );
    assert!(listed.contains("rod-balancing"), "{listed}");
}
