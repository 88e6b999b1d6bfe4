//! `asid import` and `asid export-log` as users run them, on logs written by public Python
//! packages.

#![cfg(feature = "logs")]
#![allow(clippy::unwrap_used)]

mod mapped;
#[path = "../cli_support/program.rs"]
mod program;
mod rewritten;

use std::path::{Path, PathBuf};

use asid::core::Episode;
use asid::diagnosis::study::Study;
use asid::logs::{LogSettings, Opener};
use program::{asid, json, text};
use serde_json::Value;

const EPISODES: [&str; 4] = ["train_0", "train_1", "train_2", "test_3"];

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("logs/tests/fixtures")
        .join(name)
}

/// Runs `import` on some logs into a folder.
fn import(logs: &[PathBuf], out: &Path, more: &[&str]) -> std::process::Output {
    let model = fixture("nominal.xml");
    let mut arguments = vec![
        "import",
        "--model",
        text(&model),
        "--out",
        text(out),
        "--quiet",
    ];
    arguments.extend(logs.iter().map(|l| text(l)));
    arguments.extend(more);
    asid(&arguments)
}

fn told(out: &std::process::Output) -> String {
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    String::from_utf8_lossy(&out.stdout).into_owned()
}

fn each(folder: &str, ending: &str) -> Vec<PathBuf> {
    EPISODES
        .iter()
        .map(|n| fixture(&format!("{folder}/{n}{ending}")))
        .collect()
}

/// The largest difference of the numbers of two studies.
fn apart(a: &Study, b: &Study) -> f64 {
    let mut most: f64 = 0.0;
    let all = |s: &Study| -> Vec<Episode> {
        s.train
            .iter()
            .chain(&s.test)
            .map(|(_, e)| e.clone())
            .collect()
    };
    let (a, b) = (all(a), all(b));
    assert_eq!(a.len(), b.len());
    for (x, y) in a.iter().zip(&b) {
        assert_eq!((&x.channels, x.rows()), (&y.channels, y.rows()));
        for (p, q) in [
            (&x.time, &y.time),
            (&x.ctrl, &y.ctrl),
            (&x.readings, &y.readings),
        ] {
            most = p
                .iter()
                .zip(q)
                .map(|(p, q)| (p - q).abs())
                .fold(most, f64::max);
        }
    }
    most
}

fn diagnosed(study: &Path, out: &Path) -> Value {
    let done = asid(&["diagnose", text(study), "--quiet", "--out", text(out)]);
    told(&done);
    json(&out.join("result.json"))
}

/// Collects all numbers of a result with their paths, except those of elapsed times.
fn numbers(value: &Value, way: &str, found: &mut Vec<(String, f64)>) {
    match value {
        Value::Number(x) if !way.contains("/seconds") => {
            found.push((way.to_owned(), x.as_f64().unwrap()));
        }
        Value::Array(entries) => {
            for (i, entry) in entries.iter().enumerate() {
                numbers(entry, &format!("{way}/{i}"), found);
            }
        }
        Value::Object(entries) => {
            for (key, entry) in entries {
                numbers(entry, &format!("{way}/{key}"), found);
            }
        }
        _ => {}
    }
}

/// Logs of other formats give the verdict and the values of the CSV study.
///
/// The logs are bags of both storages, MCAP and a dataset, written by public packages
/// (`logs/tests/fixtures/make.py`). A bag has bitwise the same numbers, and so has its result. A
/// dataset of `LeRobot` is in single precision, 2e-7 rad off. That is less than half of the last
/// digit of the CSV (5e-7 rad) and a thousandth of the noise. Reported values therefore move by
/// less than one of their four printed digits.
#[test]
fn logs_of_other_stacks_are_diagnosed_as_the_csv_study() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let csv = Study::read(&fixture("csv")).unwrap();
    let wanted = diagnosed(&fixture("csv"), &at("csv"));
    let found = wanted["verdict"]["effects"].as_array().unwrap();
    assert!(found.contains(&"coulomb-friction@pan".into()), "{found:?}");
    for (name, logs, off, relative) in [
        ("sqlite", each("bag_sqlite", ""), 1e-12, 1e-9),
        ("bag-mcap", each("bag_mcap", ""), 1e-12, 1e-9),
        ("mcap", each("mcap", ".mcap"), 1e-12, 1e-9),
        // Single precision: see the crate's own test.
        ("lerobot", vec![fixture("lerobot")], 2e-7, 1e-3),
    ] {
        let study = at(name);
        let said = told(&import(&logs, &study, &[]));
        assert!(
            said.contains("gripper_gap") && said.contains("4 episodes, 1 of them held out"),
            "{said}"
        );
        assert!(study.join("import.html").is_file());
        let read = Study::read(&study).unwrap();
        assert!(apart(&read, &csv) <= off, "{name}: {}", apart(&read, &csv));
        let result = diagnosed(&study, &at(&format!("{name}-out")));
        for key in ["kind", "effects", "ambiguous_with"] {
            assert_eq!(result["verdict"][key], wanted["verdict"][key], "{name}");
        }
        assert_eq!(result["wiring"].as_array().map_or(0, Vec::len), 0, "{name}");
        for part in ["gap", "effects", "verdict"] {
            let (mut a, mut b) = (Vec::new(), Vec::new());
            numbers(&result[part], part, &mut a);
            numbers(&wanted[part], part, &mut b);
            assert_eq!(a.len(), b.len(), "{name} {part}");
            for ((way, x), (_, y)) in a.iter().zip(&b) {
                // The odds of a rival far behind are those of an unfinished fit. Probabilities are
                // compared to a millionth, since one of 1e-15 is only rounding.
                let told = if way.ends_with("probability") {
                    1e-3 * relative
                } else {
                    0.0
                };
                let off = relative * y.abs() + told.max(1e-12);
                assert!((x - y).abs() <= off, "{name} {way}: {x} {y}");
            }
        }
    }
}

#[test]
fn copies_are_the_same_study_in_the_models_own_names() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    told(&import(&each("bag_sqlite", ""), &out, &["--copy"]));
    let (read, csv) = (
        Study::read(&out).unwrap(),
        Study::read(&fixture("csv")).unwrap(),
    );
    assert!(apart(&read, &csv) < 1e-12);
    assert!(read.columns.iter().all(|c| c.name == "time"));
}

#[test]
fn one_episode_is_cut_so_that_a_part_is_held_out() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    told(&import(&each("mcap", ".mcap")[..1], &out, &[]));
    let read = Study::read(&out).unwrap();
    assert_eq!((read.train.len(), read.test.len()), (2, 1));
}

#[test]
fn a_table_with_other_names_and_units_is_mapped() {
    let folder = tempfile::tempdir().unwrap();
    let mut logs = Vec::new();
    for name in EPISODES {
        let csv = std::fs::read_to_string(fixture(&format!("csv/{name}.csv"))).unwrap();
        let mut text =
            "Time [ms];pan target;gripper target;pan angle [deg];gripper [mm];battery\n".to_owned();
        for line in csv.lines().skip(1) {
            let x: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
            text += &format!(
                "{};{};{};{};{};12\n",
                1e3 * x[0],
                x[1],
                x[2],
                x[3].to_degrees(),
                1e3 * x[4]
            );
        }
        let path = folder.path().join(format!("{name}.csv"));
        std::fs::write(&path, text).unwrap();
        logs.push(path);
    }
    let out = folder.path().join("study");
    told(&import(&logs, &out, &[]));
    let (read, csv) = (
        Study::read(&out).unwrap(),
        Study::read(&fixture("csv")).unwrap(),
    );
    assert!(apart(&read, &csv) < 1e-9);
}

/// A model without sensors gets one at each joint, since the models of most robots have none.
#[test]
fn a_model_without_sensors_reads_its_joints() {
    let folder = tempfile::tempdir().unwrap();
    let xml = std::fs::read_to_string(fixture("nominal.xml")).unwrap();
    let (from, to) = (
        xml.find("<sensor>").unwrap(),
        xml.find("</sensor>").unwrap(),
    );
    let model = folder.path().join("bare.xml");
    std::fs::write(&model, format!("{}{}", &xml[..from], &xml[to + 9..])).unwrap();
    let (out, dataset) = (folder.path().join("study"), fixture("lerobot"));
    let done = asid(&[
        "import",
        text(&dataset),
        "--model",
        text(&model),
        "--out",
        text(&out),
        "--quiet",
    ]);
    told(&done);
    let read = Study::read(&out).unwrap();
    assert_eq!(read.train[0].1.width(), 2);
}

#[test]
fn wrong_calls_are_one_line_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("study");
    let logs = each("bag_sqlite", "");
    for (more, said) in [
        (&["--map", "ctrl.pan"][..], "is not NAME=COLUMN"),
        (
            &["--map", "pan_angl=/joint_states.position.pan"],
            "unknown sensor or command `pan_angl`",
        ),
        (
            &["--map", "pan_angle=/joint_states.position.pam"],
            "unknown column",
        ),
        (
            &["--topic", "/joint_states"],
            "no column is the command of the actuators `pan` and `gripper`",
        ),
        (&["--topic", "/nothing"], "no messages of topic `/nothing`"),
        (
            &["--map", "ctrl.pan=a", "--map", "ctrl.pan=b"],
            "gives `ctrl.pan` two columns, `a` and `b`",
        ),
        (&["--test", "nowhere.mcap"], "nowhere.mcap"),
    ] {
        let done = import(&logs, &out, more);
        let error = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(
            (done.status.code(), error.lines().count()),
            (Some(2), 1),
            "{error}"
        );
        assert!(error.contains(said), "{error}");
        assert!(!out.exists());
    }
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("mine"), "").unwrap();
    let done = import(&logs, &out, &[]);
    assert_eq!(done.status.code(), Some(2));
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
}

#[test]
fn exported_logs_are_read_back_with_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("mcap");
    told(&asid(&[
        "export-log",
        text(&fixture("csv")),
        "--out",
        text(&out),
    ]));
    let logs = EPISODES.map(|n| out.join(format!("{n}.mcap")));
    let raw = Opener::default()
        .open(&logs[0], &LogSettings::default())
        .unwrap();
    assert!(raw[0].series("/joint_states.position.pan").is_some());
    let study = folder.path().join("study");
    told(&import(&logs, &study, &[]));
    let (read, csv) = (
        Study::read(&study).unwrap(),
        Study::read(&fixture("csv")).unwrap(),
    );
    // Stamps are whole nanoseconds.
    assert!(apart(&read, &csv) < 1e-9);
}

/// Guards against copies of a log under two names: the study would fit the log that it holds out.
#[test]
fn a_log_that_is_fitted_and_held_out_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let logs = each("bag_sqlite", "");
    let twice = text(&logs[3]).to_owned();
    let out = import(&logs, &place.path().join("study"), &["--test", &twice]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{said}");
    assert!(said.contains("to be fitted and to be held out"), "{said}");
    assert!(!place.path().join("study").exists());
}

/// Guards against a study that `diagnose` refuses.
#[test]
fn a_log_that_is_named_twice_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let log = fixture("csv/train_0.csv");
    let again = fixture("csv/../csv/train_0.csv");
    for logs in [[log.clone(), log.clone()], [log, again]] {
        let out = import(&logs, &place.path().join("study"), &[]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert!(
            said.contains("is named twice") && said.lines().count() == 1,
            "{said}"
        );
        assert!(!place.path().join("study").exists());
    }
}

#[test]
fn a_column_that_stands_twice_is_refused_before_it_is_mapped() {
    let place = tempfile::tempdir().unwrap();
    let log = place.path().join("log.csv");
    let csv = std::fs::read_to_string(fixture("csv/train_0.csv")).unwrap();
    let doubled = csv.lines().map(|line| {
        let last = line.rsplit(',').next().unwrap();
        format!("{line},{last}\n")
    });
    std::fs::write(&log, doubled.collect::<String>()).unwrap();
    let out = import(&[log], &place.path().join("study"), &[]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{said}");
    assert!(
        said.contains("log.csv: column `gripper_gap` stands twice"),
        "{said}"
    );
}

#[test]
fn what_is_not_used_and_where_the_stamps_are_is_said() {
    let place = tempfile::tempdir().unwrap();
    let csv = std::fs::read_to_string(fixture("csv/train_0.csv")).unwrap();
    let more = csv.lines().enumerate().map(|(i, line)| match i {
        0 => format!("{},battery,state\n", line.replacen("time", "stamp", 1)),
        _ => format!("{line},12.1,running\n"),
    });
    let log = place.path().join("log.csv");
    std::fs::write(&log, more.collect::<String>()).unwrap();
    let out = import(&[log], &place.path().join("study"), &[]);
    let noted = String::from_utf8_lossy(&out.stderr).into_owned();
    let said = told(&out);
    assert!(said.contains("\ntime is column stamp\n"), "{said}");
    assert!(said.contains("\nnot used: battery\n"), "{said}");
    assert!(
        noted.contains("columns without a number are not read: state"),
        "{noted}"
    );
}
