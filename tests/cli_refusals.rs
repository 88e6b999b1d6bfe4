//! Bad input: one clear line on standard error, exit status 2, and no files.

#![allow(clippy::unwrap_used)]

mod cli_support;

use cli_support::{Workplace, tiny};

/// Asserts that a command is refused with a line that contains all of `expected`.
fn refused(place: &Workplace, arguments: &[&str], expected: &[&str]) {
    let before = place.names();
    let output = place.run(arguments);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {line}");
    assert_eq!(line.lines().count(), 1, "{arguments:?}: {line}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    for text in expected {
        assert!(
            line.contains(text),
            "{arguments:?}: `{text}` is not in: {line}"
        );
    }
    assert_eq!(place.names(), before, "{arguments:?} left something");
}

/// Asserts that a run with these options is refused.
fn refused_run(place: &Workplace, options: &[&str], expected: &[&str]) {
    // If it is not refused, it ends soon.
    let mut arguments = tiny(&["run", "rod-balancing"]);
    if !options.contains(&"--out") {
        arguments.extend(["--out", "out"]);
    }
    arguments.extend(options);
    refused(place, &arguments, expected);
}

#[test]
fn unknown_names_list_the_near_ones() {
    let place = Workplace::new();
    refused(
        &place,
        &["run", "rod-balancin"],
        &["task", "`rod-balancing`"],
    );
    refused(&place, &["rum", "rod-balancing"], &["'rum'", "'run'"]);
    for (option, name, near) in [
        ("--backend", "rapeer", "`rapier`"),
        ("--real-backend", "rapeer", "`rapier`"),
        ("--explorer", "fishercem", "`fisher-cem`"),
        ("--identifier", "rep", "`reps`"),
        ("--solver", "xyz", "`cem`"),
        ("--truth", "mass_ofset=0.1", "`mass_offset`"),
        ("--sed", "1", "'--seed'"),
        // A TOML file, which repeats a run, cannot hold it.
        (
            "--seed",
            "9223372036854775808",
            "from 0 to 9223372036854775807",
        ),
    ] {
        refused_run(&place, &[option, name], &[near]);
    }
    for (setting, near) in [
        ("explorr.std=1", "`explorer`"),
        ("explorer.iteration=1", "`iterations`"),
        ("explorer.fisher.objective=best", "`a-optimal`"),
        ("noise.rodpos=1", "`rod_pos`"),
        ("parameter.mass_ofset.range=[0,1]", "`mass_offset`"),
        ("real.bakend=rapier", "`backend`"),
    ] {
        refused_run(&place, &["--set", setting], &[near]);
    }
}

#[test]
fn settings_that_make_no_sense_are_named() {
    let place = Workplace::new();
    refused_run(&place, &["--set", "explorer.iterations"], &["KEY=VALUE"]);
    refused_run(&place, &["--truth", "mass_offset"], &["NAME=VALUE"]);
    refused_run(&place, &["--truth", "mass_offset=nan"], &["finite"]);
    refused_run(&place, &["--seed", "-1"], &["'-1'", "--seed"]);
    refused_run(&place, &["--threads", "abc"], &["'abc'", "--threads"]);
    for (key, values) in [
        ("explorer.std", ["nan", "inf", "abc", "-1"]),
        ("explorer.iterations", ["0", "-3", "1.5", "abc"]),
        ("explorer.cem.elite_fraction", ["nan", "7", "0", "abc"]),
        ("identifier.sampling.widen", ["nan", "-inf", "0", "true"]),
        ("identifier.sampling.draws", ["0", "-1", "nan", "abc"]),
        ("identifier.reps.epsilon", ["0", "-1", "nan", "abc"]),
        ("solver.population", ["0", "-1", "nan", "abc"]),
        ("solver.cem.smoothing", ["nan", "1", "-1", "abc"]),
        ("noise.rod_pos", ["nan", "0", "-1", "abc"]),
        ("seed", ["-1", "nan", "1.5", "abc"]),
    ] {
        for value in values {
            refused_run(&place, &["--set", &format!("{key}={value}")], &[key]);
        }
    }
    // A message names a key as the user sets it, wherever its value is checked.
    for (key, value) in [("ppo.gamma", "2"), ("ppo.minibatch", "1")] {
        let key = format!("explorer.{key}");
        let setting = format!("{key}={value}");
        let run = ["run", "rod-balancing", "--explorer", "fisher-ppo"];
        let arguments = [&run[..], &["--set", &setting]].concat();
        refused(&place, &arguments, &[&key]);
    }
}

#[test]
fn unknowns_that_cannot_be_identified_are_refused() {
    let place = Workplace::new();
    for (setting, expected) in [
        ("range=[0.1,-0.1]", "upside down"),
        ("range=[nan,0.1]", "finite"),
        ("range=[0.1,0.1]", "empty"),
        ("range=5", "parameter.mass_offset"),
        ("scale=log", "positive"),
        ("enabled=false", "switched off"),
        ("target=rubbish", "element/name/attribute"),
        ("target=geom/nothing/pos/1", "unknown geom `nothing`"),
        ("target=geom/rod_mass/pos/9", "index 9"),
        ("target=geom/rod_mass/colour", "`colour`"),
        // An existing geom that touches nothing.
        (
            "target=geom/link1_shape/friction/0",
            "geom/link1_shape/friction/0",
        ),
    ] {
        refused_run(
            &place,
            &["--set", &format!("parameter.mass_offset.{setting}")],
            &[expected],
        );
    }
}

#[test]
fn files_of_settings_are_read_with_care() {
    let place = Workplace::new();
    refused_run(&place, &["--config", "none.toml"], &["none.toml"]);
    refused_run(&place, &["--config", "."], &["directory"]);
    place.write("bad.toml", "seed = 1\nbackend == \"rapier\"\n");
    refused_run(&place, &["--config", "bad.toml"], &["bad.toml", "line 2"]);
    place.write("other.toml", "task = \"shuffleboard\"\n");
    refused_run(&place, &["--config", "other.toml"], &["shuffleboard"]);
    place.write("nan.toml", "[explorer]\nstd = nan\n");
    refused_run(
        &place,
        &["--config", "nan.toml"],
        &["explorer.std", "finite"],
    );
}

#[test]
fn a_folder_that_cannot_take_a_result_is_refused_before_work() {
    let place = Workplace::new();
    place.write("file", "");
    refused_run(&place, &["--out", "file"], &["file"]);
    refused_run(&place, &["--out", "file/below"], &["file/below"]);
    refused_run(&place, &["--out", "."], &["not empty"]);
    std::fs::create_dir(place.path("old")).unwrap();
    place.write("old/result.json", "{}");
    refused_run(&place, &["--out", "old"], &["another run"]);
    assert_eq!(place.read("old/result.json"), "{}");
    // The kernel's file system accepts no new folders from any user.
    if std::path::Path::new("/proc/self").exists() {
        refused_run(&place, &["--out", "/proc/asid"], &["cannot be written"]);
    }
    place.write("scene.xml", "mine");
    refused(
        &place,
        &["export", "rod-balancing", "--out", "scene.xml"],
        &["exists already"],
    );
    assert_eq!(place.read("scene.xml"), "mine");
    // Only tasks have difficulties.
    let export = ["export", "scene.xml", "--out", "plain.xml"];
    refused(
        &place,
        &[&export[..], &["--preset", "published"]].concat(),
        &["scene.xml", "--preset"],
    );
    refused(&place, &["report", "old"], &["finished run"]);
    refused(&place, &["report", "nowhere"], &["nowhere"]);
}

#[test]
fn models_of_the_real_world_must_fit_the_task() {
    let place = Workplace::new();
    refused_run(
        &place,
        &["--real-model", "none.xml"],
        &["none.xml", "no such file"],
    );
    for (name, text, expected) in [
        ("torn.xml", "<mujoco><worldbody>", "well-formed"),
        ("robot.xml", "<robot name=\"r\"/>", "<mujoco>"),
        (
            "ball.xml",
            "<mujoco><worldbody><body name=\"rod\"><freejoint/><geom size=\"0.1\"/></body></worldbody></mujoco>",
            "actuators",
        ),
    ] {
        place.write(name, text);
        refused_run(&place, &["--real-model", name], &[name, expected]);
    }
    assert!(
        place
            .run(&["export", "rod-balancing", "--out", "scene.xml"])
            .status
            .success()
    );
    let renamed = place.read("scene.xml").replace("rod_free", "rod_loose");
    place.write("renamed.xml", &renamed);
    refused_run(
        &place,
        &["--real-model", "renamed.xml"],
        &["renamed.xml", "`rod_free`", "`rod_loose`"],
    );
}

#[test]
fn bad_logs_name_row_and_column() {
    let place = Workplace::new();
    let identify = |text: &str, expected: &[&str]| {
        place.write("log.csv", text);
        refused(
            &place,
            &tiny(&[
                "identify",
                "rod-balancing",
                "--log",
                "log.csv",
                "--out",
                "out",
            ]),
            expected,
        );
    };
    refused(&place, &["identify", "rod-balancing"], &["--log"]);
    refused(
        &place,
        &["identify", "rod-balancing", "--log", "none.csv"],
        &["none.csv"],
    );
    let actuators: Vec<String> = (1..=7)
        .map(|i| format!("joint{i}"))
        .chain(["finger_left".into(), "finger_right".into()])
        .map(|name| format!("ctrl.{name}"))
        .collect();
    let sensors = "rod_pos.0,rod_pos.1,rod_pos.2,rod_quat.0,rod_quat.1,rod_quat.2,rod_quat.3";
    let header = format!("time,{},{sensors}", actuators.join(","));
    let row = |time: &str, x: &str| format!("{time},0,0,0,0,0,0,0,0,0,{x},0,0.02,1,0,0,0");
    identify("", &["log.csv"]);
    identify("time,angle\n0,1\n", &["`ctrl.joint1`"]);
    identify(
        &format!("time,{}\n0,0,0,0,0,0,0,0,0,0\n", actuators.join(",")),
        &["no column of a sensor"],
    );
    // A column that the model does not know is ignored.
    identify(
        &format!("{header},rod_spin\n{},1\n", row("0", "0.5")),
        &["rows of data at different times: 1,"],
    );
    identify(
        &format!("{header}\n{}\n", row("0", "0.5")),
        &["different times: 1,"],
    );
    identify(
        &format!("{header}\n{}\n{}\n", row("0", "0.5"), row("0.02", "abc")),
        &["row 3", "`rod_pos.0`", "`abc`"],
    );
    identify(
        &format!("{header}\n{}\n{}\n", row("0.1", "0.5"), row("0.1", "0.5")),
        &["different times: 1,"],
    );
    identify(
        &format!(
            "{header}\n{}\n{}\n{}\n{}\n",
            row("0", "0.5"),
            row("0.02", "0.5"),
            row("0.04", "0.5"),
            row("1e6", "0.5")
        ),
        &["time steps"],
    );
    identify(
        &format!("{header}\n{}\n{}\n", row("0", ""), row("0.1", "")),
        &["no row", "rod_pos"],
    );
    let position_only = header.replace(",rod_quat.0,rod_quat.1,rod_quat.2,rod_quat.3", "");
    let short = |time: &str| row(time, "0.5").trim_end_matches(",1,0,0,0").to_owned();
    identify(
        &format!("{position_only}\n{}\n{}\n", short("0"), short("0.1")),
        &["`rod_quat`"],
    );
}

#[test]
fn posteriors_must_be_of_the_task() {
    let place = Workplace::new();
    let solve = |expected: &[&str]| {
        refused(
            &place,
            &tiny(&["solve", "rod-balancing", "--posterior", "p", "--out", "out"]),
            expected,
        );
    };
    refused(&place, &["solve", "rod-balancing"], &["--posterior"]);
    solve(&["p/posterior.json"]);
    std::fs::create_dir(place.path("p")).unwrap();
    solve(&["p/posterior.json"]);
    place.write("p/posterior.json", "{");
    solve(&["not a posterior"]);
    let posterior = |name: &str, sample: &str, weight: &str| {
        format!(
            "{{\"marginals\":[{{\"name\":\"{name}\",\"unit\":\"m\",\"estimate\":0,\"std\":0.01,\"interval95\":[-0.02,0.02]}}],\
             \"samples\":[{sample}],\"weights\":[{weight}]}}"
        )
    };
    place.write("p/posterior.json", &posterior("friction", "[0.3]", "1"));
    solve(&["friction", "mass_offset", "p/config.toml"]);
    place.write(
        "p/posterior.json",
        &posterior("mass_offset", "[0.3, 1]", "1"),
    );
    solve(&["sample 0"]);
    place.write("p/posterior.json", &posterior("mass_offset", "[0.3]", "-1"));
    solve(&["weights"]);
    place.write("p/posterior.json", &posterior("mass_offset", "[0.01]", "1"));
    place.write("p/result.json", "{\"task\":\"shuffleboard\"}");
    solve(&["shuffleboard", "rod-balancing"]);
}

#[test]
fn start_poses_belong_to_the_stages_that_are_told_them() {
    let place = Workplace::new();
    let explore = |setting: &str, expected: &[&str]| {
        refused(
            &place,
            &tiny(&["explore", "rod-balancing", "--out", "out", "--set", setting]),
            expected,
        );
    };
    explore("start.z=1", &["`z`", "`x`"]);
    explore("start.x=nan", &["start.x", "finite"]);
    explore("start.x=abc", &["start.x", "finite"]);
    explore("start.x=55", &["start.x", "range"]);
    refused_run(&place, &["--set", "start.x=0.5"], &["no start pose"]);
}

#[cfg(not(feature = "mujoco"))]
#[test]
fn an_engine_left_out_says_how_to_get_it() {
    let place = Workplace::new();
    refused_run(
        &place,
        &["--backend", "mujoco"],
        &["mujoco", "cargo xtask setup", "--features mujoco"],
    );
}

#[test]
fn a_policy_is_a_file_of_the_explorer_that_plays_it() {
    let place = Workplace::new();
    place.write("p.safetensors", "no network");
    let run = |explorer: &str, file: &str, expected: &[&str]| {
        let arguments = [
            "run",
            "rod-balancing",
            "--explorer",
            explorer,
            "--policy",
            file,
        ];
        refused(&place, &arguments, expected);
    };
    let random = ["--policy", "`random` plays no trained policy"];
    run("random", "p.safetensors", &random);
    run("maxmi", "nowhere.safetensors", &["nowhere.safetensors"]);
    let broken = ["p.safetensors", "no safetensors file"];
    run("max", "p.safetensors", &broken);
    let train = [
        "explore",
        "rod-balancing",
        "--explorer",
        "random",
        "--train",
        "p",
    ];
    refused(&place, &train, &["--train", "`random` learns nothing"]);
}

#[cfg(not(feature = "torch"))]
#[test]
fn an_explorer_left_out_says_how_to_get_it() {
    let arguments = [
        "run",
        "rod-balancing",
        "--explorer",
        "fisher-ppo",
        "--set",
        "explorer.policy=\"train\"",
    ];
    let says = ["fisher-ppo", "cargo xtask setup", "--features torch"];
    refused(&Workplace::new(), &arguments, &says);
}

#[cfg(not(feature = "torch"))]
#[test]
fn the_list_says_that_the_solver_ppo_needs_torch() {
    let place = Workplace::new();
    let list = String::from_utf8(place.run(&["list"]).stdout).unwrap();
    let is_its = |line: &&str| line.split_whitespace().take(2).eq(["solver", "ppo"]);
    let line = list.lines().find(is_its).unwrap();
    assert!(
        line.contains("missing") && line.contains("--features torch"),
        "{line}"
    );
}

#[test]
fn a_custom_world_with_nothing_of_its_own_is_refused() {
    let place = Workplace::new();
    refused_run(
        &place,
        &["--world", "custom"],
        &["--world custom", "--real-effect", "matched"],
    );
}

#[test]
fn a_true_value_that_no_engine_takes_is_named() {
    let place = Workplace::new();
    let output = place.run(&tiny(&[
        "run",
        "rod-balancing",
        "--quiet",
        "--set",
        "parameter.mass.target=geom/rod_mass/mass",
        "--set",
        "parameter.mass.range=[0.1, 1]",
        "--truth",
        "mass=-1",
    ]));
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.lines()
            .last()
            .unwrap()
            .contains("parameter `mass`: the real world cannot have its true value of -1"),
        "{said}"
    );
}

#[test]
fn a_true_value_outside_of_the_prior_is_warned_of() {
    let place = Workplace::new();
    let output = place.run(&tiny(&[
        "run",
        "rod-balancing",
        "--quiet",
        "--truth",
        "mass_offset=0.2",
    ]));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    assert_eq!(
        said.matches("warning: --truth mass_offset=0.2 lies outside of the prior")
            .count(),
        1,
        "{said}"
    );
    assert!(said.contains("above its upper end"), "{said}");
}
