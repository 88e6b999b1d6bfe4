//! Engines in C: the system's compiler builds the examples, they conform, and the guide's code is
//! that of the examples.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;
mod plugin_support;

use std::path::{Path, PathBuf};
use std::process::Command;

use asid::core::{Backend, BatchConfig, Capabilities, Control, Error, Rollout, Scene};
use asid_conformance::{Outcome, Row, table};
use cli_support::{Workplace, names};
use serde_json::Value;

/// Flags under which the examples compile without a warning.
const STRICT: [&str; 6] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-pedantic",
    "-Werror",
    "-O2",
];

/// The C compiler: `$CC`, or `cc`.
fn compiler() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".into())
}

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(repository(path)).unwrap()
}

/// Compiles sources in a folder of the repository into a library.
fn build(folder: &str, sources: &[&str], library: &Path) {
    let sources = sources.iter().map(|s| repository(folder).join(s));
    let output = Command::new(compiler())
        .args(STRICT)
        .args(["-shared", "-fPIC", "-I"])
        .arg(repository("backends/abi/include"))
        .args(sources)
        .arg("-o")
        .arg(library)
        .arg("-lm")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{said}");
}

fn engine(library: &Path) -> Box<dyn Backend> {
    let engine = asid_abi::open_engine(library).unwrap();
    engine.backend(engine.name())
}

/// Runs all checks; returns how many passed.
fn conforms(backend: &dyn Backend) -> usize {
    let rows = asid_conformance::run(backend);
    let failures: Vec<Row> = rows.iter().filter(|r| r.is_failure()).cloned().collect();
    assert!(failures.is_empty(), "\n{}", table(&failures));
    let known = |r: &&Row| r.outcome == Outcome::KnownDeviation;
    assert_eq!(rows.iter().filter(known).count(), 0, "an example deviates");
    rows.iter().filter(|r| r.outcome == Outcome::Pass).count()
}

#[test]
fn the_engine_in_one_file_conforms() {
    let place = Workplace::new();
    let library = place.path("libflight.so");
    build("plugins/engine-c", &["engine.c"], &library);
    let engine = engine(&library);
    assert_eq!(engine.name(), "flight");
    assert!(engine.capabilities().contains(Capabilities::FREE_BODIES));
    assert!(conforms(&*engine) > 60);
}

#[test]
fn the_engine_of_mechanisms_conforms() {
    let place = Workplace::new();
    let library = place.path("libmechanism.so");
    let sources = ["engine.c", "scene.c", "dynamics.c"];
    build("plugins/mechanism-c", &sources, &library);
    let engine = engine(&library);
    let claimed = Capabilities::ARTICULATION | Capabilities::ACTUATORS;
    assert!(engine.capabilities().contains(claimed));
    assert!(conforms(&*engine) > 110);
}

/// Readings after `steps` frames of one step each, from rest with a command of 1 and these
/// parameters.
fn readings(
    engine: &dyn Backend,
    inside: &str,
    channels: &[&str],
    parameters: &[(&str, f64)],
    steps: usize,
) -> asid::core::Result<Vec<f64>> {
    let xml = format!("<mujoco>{inside}</mujoco>");
    let model = engine.load(&Scene::from_xml("it", &xml, &[])?)?;
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: parameters
            .iter()
            .map(|p| p.0.parse())
            .collect::<asid::core::Result<_>>()?,
    };
    let mut simulator = model.simulator(&config)?;
    let values: Vec<f64> = parameters.iter().map(|p| p.1).collect();
    simulator.set_parameters(&[0], &values)?;
    let record = model.layout().recording(channels)?;
    let mut out = vec![0.0; record.width()];
    let control = vec![1.0; model.layout().nu()];
    let rollout = Rollout::new(&[0], 1, steps, Control::Shared(&control), &record);
    simulator.rollout(&rollout, &mut out)?;
    Ok(out)
}

fn close(found: &[f64], expected: &[f64]) -> bool {
    let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
    found.len() == expected.len() && found.iter().zip(expected).all(near)
}

#[test]
fn principal_axes_may_be_turned() {
    let place = Workplace::new();
    let (flight, mechanism) = (place.path("libflight.so"), place.path("libmechanism.so"));
    build("plugins/engine-c", &["engine.c"], &flight);
    let sources = ["engine.c", "scene.c", "dynamics.c"];
    build("plugins/mechanism-c", &sources, &mechanism);
    // The inertia is rotated by 45° about z, so that the first principal axis is (1, 1, 0) of the
    // body.
    let (c, s) = (
        std::f64::consts::FRAC_PI_8.cos(),
        std::f64::consts::FRAC_PI_8.sin(),
    );
    let body = |joint: &str| {
        format!(
            r#"<option gravity="0 0 0" timestep="0.01"/><worldbody><body name="b">{joint}<inertial pos="0 0 0"
            quat="{c} 0 0 {s}" mass="2" diaginertia=".1 .2 .25"/></body></worldbody>
            <sensor><framequat name="axes" objtype="body" objname="b"/>
            <framequat name="own" objtype="xbody" objname="b"/></sensor>"#
        )
    };
    let still = [c, 0.0, 0.0, s, 1.0, 0.0, 0.0, 0.0];
    for library in [&flight, &mechanism] {
        let engine = engine(library);
        let free = body(r#"<freejoint name="j"/>"#);
        let found = readings(&*engine, &free, &["axes", "own"], &[], 5).unwrap();
        assert!(close(&found, &still), "{}: {found:?}", engine.name());
        // About a principal axis it keeps rotating; about another axis it would tumble.
        let turning =
            free.clone() + r#"<keyframe><key qpos="0 0 0 1 0 0 0" qvel="0 0 0 1 1 0"/></keyframe>"#;
        let found = readings(&*engine, &turning, &["qvel.j"], &[], 50).unwrap();
        let kept = close(&found, &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
        assert!(kept, "{}: {found:?}", engine.name());
    }
    // 20 steps of 0.01 s with 1 N m: the rate is 0.2 over the moment of inertia about the hinge.
    let engine = engine(&mechanism);
    let wheel =
        body(r#"<joint name="j" axis="1 1 0"/>"#) + r#"<actuator><motor joint="j"/></actuator>"#;
    let rate = |parameters: &[(&str, f64)]| {
        readings(&*engine, &wheel, &["qvel.j"], parameters, 20).unwrap()
    };
    assert!(close(&rate(&[]), &[0.2 / 0.1]));
    assert!(close(&rate(&[("body/b/inertia/0", 0.5)]), &[0.2 / 0.5]));
    assert!(close(&rate(&[("body/b/inertia/1", 0.5)]), &[0.2 / 0.1]));
    assert!(close(&rate(&[("body/b/mass", 4.0)]), &[0.2 / 0.2]));
    let both = [("body/b/inertia/0", 0.5), ("body/b/mass", 4.0)];
    assert!(close(&rate(&both), &[0.2 / 0.5]));
}

#[test]
fn a_sensor_that_cannot_be_read_is_refused_when_it_is_recorded() {
    let place = Workplace::new();
    let library = place.path("libflight.so");
    build("plugins/engine-c", &["engine.c"], &library);
    let engine = engine(&library);
    let inside = r#"<worldbody><body name="b"><freejoint name="j"/>
        <geom size="1" contype="0" conaffinity="0"/></body></worldbody>
        <sensor><clock name="time"/><framepos name="place" objtype="xbody" objname="b"/></sensor>"#;
    assert!(readings(&*engine, inside, &["place"], &[], 1).is_ok());
    let error = readings(&*engine, inside, &["time"], &[], 1).unwrap_err();
    assert!(matches!(error, Error::Incapable { .. }), "{error}");
    let said = error.to_string();
    assert!(
        said.starts_with("backend `flight` cannot read sensors"),
        "{said}"
    );
    // The host names the target that an engine refuses.
    let target = [("body/b/mass", 1.0)];
    let error = readings(&*engine, inside, &["place"], &target, 1).unwrap_err();
    let said = error.to_string();
    assert!(said.starts_with("parameter `body/b/mass/0`: "), "{said}");
}

#[test]
fn what_an_engine_lacks_is_one_line() {
    let place = Workplace::new();
    let library = place.path("libmechanism.so");
    let sources = ["engine.c", "scene.c", "dynamics.c"];
    build("plugins/mechanism-c", &sources, &library);
    let engine = engine(&library);
    let body = |joint: &str| {
        format!(
            r#"<worldbody><body name="b"><joint name="j" {joint}/>
            <geom name="g" size="1" contype="0" conaffinity="0"/></body></worldbody>"#
        )
    };
    let two = r#"<worldbody><body><joint/><geom name="g" size="1"/></body>
        <body><joint/><geom name="h" size="1"/></body></worldbody>"#;
    for (inside, expected) in [
        (body(r#"range="0 1""#), "no limits of joints: joint `j`"),
        (body(r#"frictionloss="1""#), "no dry friction: joint `j`"),
        (
            body(r#"springdamper="1 1""#),
            "lacks `joint/j springdamper`",
        ),
        (
            body("") + r#"<option wind="1 0 0"/>"#,
            "lacks `option wind`",
        ),
        (
            body("") + r#"<actuator><damper joint="j"/></actuator>"#,
            "<damper> `actuator0`",
        ),
        (two.into(), "geoms `g` and `h` could touch"),
    ] {
        let xml = format!("<mujoco>{inside}</mujoco>");
        let scene = Scene::from_xml("it", &xml, &[]).unwrap();
        let error = engine.load(&scene).err().unwrap().to_string();
        assert!(error.starts_with("scene it: this engine "), "{error}");
        assert!(error.contains(expected), "{expected}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn a_task_runs_on_an_engine_in_c_as_on_another() {
    let place = Workplace::new();
    let library = place.path("libmechanism.so");
    let sources = ["engine.c", "scene.c", "dynamics.c"];
    build("plugins/mechanism-c", &sources, &library);
    let task = plugin_support::build(&["payload-swing"]).swap_remove(0);
    let mut arguments = vec!["run", "payload-swing", "--seed", "1", "--quiet"];
    arguments.extend(["--set", "condition=\"light\""]);
    arguments.extend(["--out", "out", "--backend", "mechanism"]);
    // The truth is a world of another engine, so both engines must be right.
    arguments.extend(["--real-backend", "rapier"]);
    for plugin in [&task, &library] {
        arguments.extend(["--plugin", plugin.to_str().unwrap()]);
    }
    let output = place.run(&arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let result: Value = serde_json::from_str(&place.read("out/result.json")).unwrap();
    assert_eq!(result["versions"]["engine"], "mechanism 1.0");
    let mass = &result["parameters"][0];
    let error = mass["estimate"].as_f64().unwrap() - mass["truth"].as_f64().unwrap();
    // 0.01 rad of noise leave a standard deviation of 1.4 g; the bound is three times that.
    assert!(error.abs() < 4.2e-3, "{mass}");
    assert_eq!(result["downstream"]["success"], true, "{result}");
}

/// Code blocks of a language in the guide.
fn blocks(language: &str) -> Vec<String> {
    let guide = read("docs/add-a-backend.md");
    let mut found = Vec::new();
    for part in guide.split("\n```").skip(1).step_by(2) {
        if let Some(code) = part.strip_prefix(&format!("{language}\n")) {
            found.push(code.to_owned());
        }
    }
    found
}

#[test]
fn the_guide_leads_to_a_green_table() {
    let commands = &blocks("sh")[0];
    assert!(commands.contains("asid conformance"), "{commands}");
    let commands = commands.replace("\ncc ", &format!("\n{} ", compiler()));
    let place = Workplace::new();
    let bin = Path::new(env!("CARGO_BIN_EXE_asid")).parent().unwrap();
    let mut path = bin.as_os_str().to_owned();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap());
    let output = Command::new("sh")
        .args(["-e", "-c", &commands])
        .current_dir(place.path(""))
        .env("PATH", path)
        .env_remove("ASID_PLUGIN_PATH")
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{text}\n{errors}");
    let listed = text.lines().find(|l| l.contains("rigid bodies in free"));
    assert!(listed.is_some_and(|l| l.contains("my-engine")), "{text}");
    let row = |l: &&str| l.contains("dynamics/free-tumbling-momentum");
    let row = text.lines().filter(|l| l.contains("my-engine")).find(row);
    assert!(row.is_some_and(|l| l.contains("pass")), "{text}");
    assert!(!text.contains("FAIL"), "{text}");
}

#[test]
fn code_of_the_guide_is_that_of_the_examples() {
    let engine = read("plugins/engine-c/engine.c");
    let (quoted, new): (Vec<_>, Vec<_>) = blocks("c").into_iter().partition(|b| engine.contains(b));
    assert!(quoted.len() > 10, "{new:?}");
    // Code that is not quoted must compile together with the rest.
    let place = Workplace::new();
    place.write("guide.c", &(engine + &new.join("\n")));
    let output = Command::new(compiler())
        .args(STRICT)
        .args(["-Wno-unused-function", "-fsyntax-only", "-I"])
        .arg(repository("backends/abi/include"))
        .arg(place.path("guide.c"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{said}");
    // Rust code is built and run where it is.
    let sources = [
        "plugins/engine-rust/src/lib.rs",
        "plugins/own-binary/src/main.rs",
        "backends/rapier/src/lib.rs",
    ]
    .map(read);
    for block in blocks("rust") {
        let stands = sources.iter().any(|s| s.contains(&block));
        assert!(stands, "in no example:\n{block}");
    }
}

#[test]
fn new_writes_what_can_be_built_and_nothing_over_anything() {
    let place = Workplace::new();
    for kind in ["engine-c", "mechanism-c"] {
        let dir = format!("deep/{kind}-of-mine");
        let output = place.run(&["new", kind, &dir]);
        assert!(output.status.success(), "{output:?}");
        // The compile command of its README, as written there.
        let readme = place.read(&format!("{dir}/README.md"));
        let line = readme.lines().find(|l| l.starts_with("cc ")).unwrap();
        let line = line.replacen("cc", &compiler(), 1);
        let status = Command::new("sh")
            .args(["-c", &line])
            .current_dir(place.path(&dir))
            .status()
            .unwrap();
        assert!(status.success(), "{line}");
        let engine = asid_abi::open_engine(&place.path(&dir).join("libmy.so")).unwrap();
        assert_eq!(engine.name(), format!("{kind}-of-mine"));

        let before = names(&place.path(&dir));
        let again = place.run(&["new", kind, &dir]);
        assert_eq!(again.status.code(), Some(2));
        let said = String::from_utf8(again.stderr).unwrap();
        assert!(said.contains("holds something already"), "{said}");
        assert_eq!(names(&place.path(&dir)), before);
    }
    place.write("file", "");
    for (arguments, expected) in [
        (["new", "engine-c", "file"], "no folder"),
        (["new", "engine-c", "My_Engine"], "a-z, 0-9 and -"),
        (["new", "engine-d", "x"], "engine-c"),
        (["new", "engine-c", "mujoco"], "`mujoco` is one of"),
        (["new", "mechanism-c", "deep/rapier"], "`rapier` is one of"),
    ] {
        let output = place.run(&arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.contains(expected) && said.lines().count() == 1,
            "{said}"
        );
    }
    assert_eq!(place.names(), ["deep", "file"]);
}
