//! Faulty engine plugins, actually built: each gives one line that names the file and the reason,
//! and the host continues.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::Command;

use asid_abi::open_engine;
use asid_core::{BatchConfig, Control, Model, Result, Rollout, Scene, Simulator};

const HERE: &str = env!("CARGO_MANIFEST_DIR");

/// Builds `wrong.c` with one fault.
fn build(folder: &Path, fault: &str) -> PathBuf {
    let library = folder.join(format!("lib{}.so", fault.to_lowercase()));
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let run = Command::new(compiler)
        .args(["-std=c99", "-shared", "-fPIC", "-I"])
        .arg(format!("{HERE}/include"))
        .arg(format!("-D{fault}"))
        .arg(format!("{HERE}/tests/wrong.c"))
        .arg("-o")
        .arg(&library)
        .output()
        .unwrap();
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    library
}

fn scene() -> Scene {
    Scene::from_xml(
        "pendulum",
        r#"<mujoco><worldbody><body name="arm"><joint name="hinge"/><geom size="0.1"/></body>
        </worldbody></mujoco>"#,
        &[],
    )
    .unwrap()
}

/// Uses an engine as a run does, up to the first error.
fn use_engine(path: &Path) -> Result<()> {
    let model = open_engine(path)?.backend("still").load(&scene())?;
    let target = "joint/hinge/damping".parse()?;
    // The engine supports no parameters and says so in its own message.
    if let Err(error) = model.nominal(&target)
        && !error.to_string().contains("fixed (plugin")
    {
        return Err(error);
    }
    let mut sim = model.simulator(&BatchConfig {
        size: 2,
        ..BatchConfig::default()
    })?;
    sim.reset(&[0, 1])?;
    roll(&*model, &mut *sim)
}

fn roll(model: &dyn Model, sim: &mut dyn Simulator) -> Result<()> {
    let record = model.layout().recording(&["qpos.hinge"])?;
    let mut out = [0.0; 6];
    sim.rollout(
        &Rollout::new(&[0, 1], 3, 1, Control::Shared(&[]), &record),
        &mut out,
    )
}

#[test]
fn every_wrong_engine_is_refused_in_one_line_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    for (fault, reason) in [
        (
            "NO_SYMBOL",
            "exports no engine (no symbol `asid_backend_entry`)",
        ),
        (
            "OTHER_MAJOR",
            "built for version 2.0 of the engine ABI, this program reads 1.0",
        ),
        ("CUT_SHORT", "its table is cut short"),
        (
            "UNKNOWN_CLAIM",
            "claims capability bit 40, which version 1.0 does not have",
        ),
        ("NULL_TABLE", "cannot work on this machine"),
        ("LACKS_ROLLOUT", "its table has no `rollout` (NULL)"),
        ("LOAD_FAILS", "scene pendulum: this engine likes no scene"),
        (
            "LOAD_GIVES_NULL",
            "load: says that all is well and gives NULL",
        ),
        (
            "NOMINAL_IS_NAN",
            "nominal: gives NaN for joint/hinge/damping",
        ),
        (
            "SILENT_ERROR",
            "reset: failed with code 77 and said nothing",
        ),
        ("ROLLOUT_FAILS", "rollout: the licence has expired"),
        (
            "READS_NAN",
            "rollout: reads NaN for position 0 of simulation 1 in frame 2, which it says is running",
        ),
    ] {
        let library = build(folder.path(), fault);
        let line = use_engine(&library).unwrap_err().to_string();
        assert!(line.contains(reason), "{fault}: {line}");
        assert!(line.contains(library.to_str().unwrap()), "{fault}: {line}");
        assert!(!line.contains('\n'), "{fault}: {line}");
    }
}

#[test]
fn an_engine_without_a_fault_is_not_refused() {
    let folder = tempfile::tempdir().unwrap();
    let library = build(folder.path(), "NO_FAULT");
    use_engine(&library).unwrap();
    let engine = open_engine(&library).unwrap();
    let model = engine.backend("still").load(&scene()).unwrap();
    // The host's reading of the document replaces an omitted layout.
    assert_eq!(model.layout().bodies, ["world", "arm"]);
    assert_eq!(model.layout().geoms, ["geom0"]);
    // An unclaimed capability is refused before the engine is called.
    let mut sim = model
        .simulator(&BatchConfig {
            size: 1,
            ..BatchConfig::default()
        })
        .unwrap();
    let error = sim.save(&[0]).unwrap_err().to_string();
    assert!(
        error.starts_with("backend `still` cannot save states (plugin "),
        "{error}"
    );
}

#[test]
fn what_is_no_library_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.so");
    std::fs::write(&text, "not a library").unwrap();
    let line = |path: &Path| open_engine(path).unwrap_err().to_string();
    assert_eq!(
        line(&text),
        format!(
            "plugin {}: is not a library that can be loaded: file too short",
            text.display()
        )
    );
    std::fs::write(&text, "not a library ".repeat(1000)).unwrap();
    assert!(
        line(&text).ends_with("invalid ELF header"),
        "{}",
        line(&text)
    );
    assert!(line(folder.path()).ends_with("is a folder, not a library"));
    assert!(line(Path::new("nowhere.so")).ends_with("nowhere.so: no such file"));
}
