//! `asid diagnose` as the user runs it.

#![allow(clippy::unwrap_used)]

#[path = "cli_support/program.rs"]
mod program;
#[path = "diagnosis/world.rs"]
mod world;

use program::{asid, json, text};
use serde_json::Value;
use world::{Truth, write_study};

/// Returns the one line on standard error, and the exit status.
fn refusal(arguments: &[&str]) -> (String, Option<i32>) {
    let out = asid(arguments);
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    (said.trim().to_owned(), out.status.code())
}

#[test]
fn a_fault_is_found_and_its_refined_model_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let (study, out) = (folder.path().join("study"), folder.path().join("out"));
    write_study(&study, Truth::Coulomb(1.2));
    let done = asid(&["diagnose", text(&study), "--quiet", "--out", text(&out)]);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let said = String::from_utf8(done.stdout).unwrap();
    assert!(said.contains("coulomb-friction@rail explains"), "{said}");
    let result = json(&out.join("result.json"));
    assert_eq!(result["schema"], 1);
    assert_eq!(result["verdict"]["kind"], "effects");
    assert_eq!(result["verdict"]["effects"][0], "coulomb-friction@rail");
    for file in [
        "config.toml",
        "refined.toml",
        "trace.json",
        "evidence.json",
        "train-1.csv",
        "test-2.csv",
    ] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let next = &result["next_experiment"];
    assert!(
        next["how"].as_str().unwrap().starts_with("repeat train_"),
        "{next}"
    );
    let commands = std::fs::read_to_string(out.join(next["file"].as_str().unwrap())).unwrap();
    assert!(commands.starts_with("time,ctrl."), "{commands}");
    // The true force is within its interval, and detectable even at a tenth of its size.
    let effect = &result["effects"][0];
    let [low, high] = [0, 1].map(|i| effect["intervals95"]["force"][i].as_f64().unwrap());
    assert!(low < 1.2 && 1.2 < high, "{low} to {high}");
    assert_eq!(effect["at_bound"], false);
    let limits = result["detection_limits"].as_array().unwrap();
    let of = |name: &str| limits.iter().find(|l| l["effect"] == name).unwrap();
    assert!(of("viscous-friction@rail")["value"].as_f64().unwrap() > 0.0);
    let shares = &result["gap"]["shares"];
    let sum: f64 = ["named", "learnable", "unrepeatable"]
        .iter()
        .map(|k| shares[k].as_f64().unwrap())
        .sum();
    assert!(
        (sum - 1.0).abs() < 1e-9 && shares["named"].as_f64().unwrap() > 0.9,
        "{shares}"
    );
    // The refined model replaces the model: nothing is left to explain.
    let refined = out.join("refined.toml");
    let toml = std::fs::read_to_string(study.join("study.toml")).unwrap();
    let toml = toml.replace("nominal.xml", text(&refined));
    std::fs::write(study.join("study.toml"), toml).unwrap();
    let again = asid(&[
        "diagnose",
        text(&study),
        "--quiet",
        "--json",
        "--out",
        text(&folder.path().join("b")),
    ]);
    let result: Value = serde_json::from_slice(&again.stdout).unwrap();
    let nominal = result["gap"]["nominal"].as_f64().unwrap();
    assert!(nominal < 3.0, "gap {nominal} with the refined model");
}

#[test]
fn the_diagnosis_is_repeated_on_simulated_logs_and_a_rate_of_false_alarms_is_a_probability() {
    let folder = tempfile::tempdir().unwrap();
    let (study, out) = (folder.path().join("study"), folder.path().join("out"));
    write_study(&study, Truth::Coulomb(1.2));
    let (line, status) = refusal(&["diagnose", text(&study), "--quiet", "--false-alarms", "5"]);
    assert_eq!(status, Some(2));
    assert!(
        line.contains("--false-alarms") && line.contains("between 0 and 1"),
        "{line}"
    );
    let done = asid(&[
        "diagnose",
        text(&study),
        "--quiet",
        "--calibrate",
        "--minutes",
        "1",
        "--out",
        text(&out),
    ]);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let found = &json(&out.join("result.json"))["calibration"];
    let rows = found["rows"].as_array().unwrap();
    assert!(rows[0]["effects"].as_array().unwrap().is_empty());
    let count = |r: &Value, key: &str| r[key].as_u64().unwrap();
    let all: u64 = rows.iter().map(|r| count(r, "runs")).sum();
    assert_eq!(all, found["runs"].as_u64().unwrap());
    // A machine without an effect is reported as such, and the friction is found where it was
    // added.
    for row in rows.iter().take(2).filter(|r| count(r, "runs") > 0) {
        assert_eq!(count(row, "right"), count(row, "runs"), "{row}");
    }
}

/// The part of a study that is broken, how, and the message.
type Spoilt<'a> = (&'a str, Box<dyn Fn() + 'a>, &'a str);

#[test]
fn bad_studies_and_logs_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    write_study(&study, Truth::None);
    let log = study.join("train_0.csv");
    let good = std::fs::read_to_string(&log).unwrap();
    let toml = study.join("study.toml");
    let written = std::fs::read_to_string(&toml).unwrap();
    let with_log = |text: String| std::fs::write(&log, text).unwrap();
    let cases: [Spoilt<'_>; 9] = [
        (
            "no sensor",
            Box::new(|| with_log(good.replace(",x,dx,", ",place,speed,"))),
            "no column of a sensor",
        ),
        (
            "text",
            Box::new(|| with_log(good.replacen("\n0.010,", "\n0.010,abc", 1))),
            "row 3, column `ctrl.belt`",
        ),
        (
            "time back",
            Box::new(|| with_log(good.replace("\n1.020,", "\n0.005,"))),
            "row 104: the time goes back",
        ),
        (
            "one row",
            Box::new(|| with_log(good.lines().take(2).collect::<Vec<_>>().join("\n"))),
            "at least 2",
        ),
        (
            "twice",
            Box::new(|| with_log(good.replacen(",x,dx,", ",x,x,", 1))),
            "train_0.csv: column `x` stands twice",
        ),
        (
            "unit",
            Box::new(|| {
                let column = "[[column]]\nname = \"x\"\nunit = \"deg\"\n";
                std::fs::write(&toml, format!("{written}{column}")).unwrap();
            }),
            "`x` is a length; deg is an angle",
        ),
        (
            "key",
            Box::new(|| std::fs::write(&toml, format!("speed = 3\n{written}")).unwrap()),
            "unknown field `speed`",
        ),
        (
            "target",
            Box::new(|| std::fs::write(&toml, written.replace("geom/cart", "geom/card")).unwrap()),
            "study.toml: parameter `mass`: unknown geom `card`",
        ),
        (
            "pattern",
            Box::new(|| std::fs::write(&toml, written.replace("train_*", "tarin_*")).unwrap()),
            "no file matches `tarin_*.csv`",
        ),
    ];
    for (name, spoil, expected) in cases {
        spoil();
        let (said, status) = refusal(&["diagnose", text(&study), "--quiet"]);
        assert!(said.contains(expected), "{name}: {said}");
        assert_eq!(status, Some(2), "{name}: {said}");
        with_log(good.clone());
        std::fs::write(&toml, &written).unwrap();
    }
    let (said, status) = refusal(&["diagnose", text(&folder.path().join("nowhere"))]);
    assert!(said.contains("no such file") && status == Some(2), "{said}");
}

/// Symptom: `--task T --config DIR/config.toml` ran the task in its simulated world and diagnosed
/// these runs, in place of the logs of the file. Cause: a task on the command line dropped the logs
/// of the file, also of the same task. Here the logs do not exist, so that a message names the one
/// that is read first.
#[test]
fn logs_of_a_configuration_are_those_of_its_task_only() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("config.toml");
    let logs = "task = \"shuffleboard\"\ntrain = [\"a.csv\", \"b.csv\"]\ntest = [\"c.csv\"]\n";
    std::fs::write(&file, logs).unwrap();
    let with = |options: &[&str]| {
        let call = ["diagnose", "--config", text(&file), "--quiet"];
        let (said, status) = refusal(&[&call[..], options].concat());
        assert_eq!(status, Some(2), "{said}");
        said
    };
    let task = ["--task", "shuffleboard"];
    let first = with(&[]);
    assert!(first.contains("a.csv"), "{first}");
    assert_eq!(with(&task), first);
    // Logs of the command line take their place, and so do runs that make them.
    let said = with(&["--task", "shuffleboard", "--train", "d.csv"]);
    assert!(said.contains("d.csv"), "{said}");
    let said = with(&["--task", "shuffleboard", "--runs", "1"]);
    assert!(said.contains("--runs: at least 2"), "{said}");
    // Another task has other logs.
    let said = with(&["--task", "rod-balancing", "--set", "runs=1"]);
    assert!(said.contains("--runs: at least 2"), "{said}");
    // Further episodes would be of a simulated machine.
    let said = with(&["--task", "shuffleboard", "--experiments", "2"]);
    assert!(said.contains("these logs are given"), "{said}");
}

/// Symptom: `asid diagnose robot.xml` ended with a message of the parser of TOML, and of a refined
/// model with `train` as a missing field. Cause: the file of a model was read as a study.
#[test]
fn the_file_of_a_model_is_no_study() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["robot.xml", "refined.toml"].map(|name| folder.path().join(name));
    std::fs::write(&files[0], "<mujoco/>").unwrap();
    std::fs::write(&files[1], "model = \"robot.xml\"\n").unwrap();
    for file in &files {
        let (said, status) = refusal(&["diagnose", text(file), "--quiet"]);
        assert!(
            said.contains("is a model without logs") && said.contains("asid import"),
            "{said}"
        );
        assert_eq!(status, Some(2), "{said}");
    }
}

/// Symptom: "leave out --experiments" of a call without this option, and "--minutes: is a number
/// above 0" of one whose file has the number. Cause: a message named the option wherever the value
/// came from. No log and no study here exists, so that nothing is read before.
#[test]
fn a_message_names_a_setting_as_it_was_given() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("config.toml");
    let refused = |settings: &str, options: &[&str], expected: &[&str]| {
        std::fs::write(&file, settings).unwrap();
        let call = ["diagnose", "--config", text(&file), "--quiet"];
        let (said, status) = refusal(&[&call[..], options].concat());
        assert_eq!(status, Some(2), "{said}");
        for words in expected {
            assert!(said.contains(words), "{said}");
        }
    };
    let task = "task = \"shuffleboard\"\n";
    let logs = "train = [\"a.csv\", \"b.csv\"]\n";
    let given = ["--task", "shuffleboard", "--train", "c.csv"];
    refused(
        &format!("{task}experiments = 2\n"),
        &given,
        &[
            "config experiments: ",
            "leave out `experiments`, or `--train`",
        ],
    );
    refused(
        &format!("{task}{logs}"),
        &["--experiments", "2"],
        &["--experiments: ", "leave out `--experiments`, or `train`"],
    );
    // The logs of the file are diagnosed, so that no run makes any.
    refused(
        &format!("{task}{logs}runs = 6\n"),
        &[],
        &["config runs: ", "its logs are given"],
    );
    refused(
        "seeds = 3\n",
        &["study"],
        &["config seeds: ", "go with --task"],
    );
    refused("", &["study", "--seeds", "3"], &["--seeds: "]);
    refused("minutes = -1\n", &["study"], &["config minutes: "]);
    refused("", &["study", "--minutes=-1"], &["--minutes: "]);
    refused("false_alarms = 5\n", &["study"], &["config false_alarms: "]);
}

/// Symptom: `--world perturbed` and `--preset published` beside a study were accepted and ignored,
/// and no trial was run for `--world` beside logs of a task. Cause: the kind of world did not count
/// as a description of a run.
#[test]
fn a_kind_of_world_describes_a_run_of_a_task() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    write_study(&study, Truth::None);
    let world = ["--world", "perturbed"];
    let (said, status) = refusal(&[&["diagnose", text(&study)][..], &world].concat());
    assert!(said.contains("cannot be run from here"), "{said}");
    assert_eq!(status, Some(2), "{said}");
    let (said, status) = refusal(&["diagnose", text(&study), "--preset", "published"]);
    assert!(said.contains("--preset: goes with a task"), "{said}");
    assert_eq!(status, Some(2), "{said}");
    // Beside logs of a task it is that of the trials, and must be one.
    let logs = ["diagnose", "--task", "shuffleboard", "--train", "a.csv"];
    let (said, status) = refusal(&[&logs[..], &["--world", "unheard-of"]].concat());
    assert!(said.contains("unheard-of"), "{said}");
    assert_eq!(status, Some(2), "{said}");
}

/// Rewrites each log of a study.
fn rewrite_logs(study: &std::path::Path, anew: impl Fn(&str) -> String) {
    for entry in std::fs::read_dir(study).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "csv") {
            let log = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, anew(&log)).unwrap();
        }
    }
}

/// An initial state can fit two rows of any machine.
///
/// Guards against a verdict from the missing gap of such logs. Also guards against a panic: with a
/// known initial state, a column taken as late leaves no rows.
#[test]
fn logs_of_too_few_rows_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    write_study(&study, Truth::None);
    rewrite_logs(&study, |log| {
        log.lines().take(3).collect::<Vec<_>>().join("\n")
    });
    let (said, status) = refusal(&["diagnose", text(&study), "--quiet"]);
    assert!(said.contains("4 logs to fit to, 8 rows in all"), "{said}");
    assert_eq!(status, Some(2), "{said}");
}

#[test]
fn an_ordinary_log_is_read_and_what_was_done_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    write_study(&study, Truth::None);
    // Stamps in microseconds since boot, a column without a sensor, a misspelt position, the
    // position with the other sign, and a spike.
    for entry in std::fs::read_dir(&study).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "csv") {
            continue;
        }
        let log = std::fs::read_to_string(&path).unwrap();
        let rows = log.lines().enumerate().map(|(i, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            cells.push(if i == 0 {
                "battery".into()
            } else {
                "12.1 V".into()
            });
            if i > 0 {
                let number = |cell: &str| cell.parse::<f64>().unwrap();
                cells[0] = format!("{:.0}", 3.7e9 + 1e6 * number(&cells[0]));
                cells[2] = (-number(&cells[2])).to_string();
                if i == 50 {
                    cells[3] = "40".into();
                }
            }
            cells.join(",") + "\n"
        });
        let text: String = rows.collect();
        std::fs::write(&path, text.replacen(",dx,", ",DX,", 1)).unwrap();
    }
    let mapping = "[[column]]\nname = \"dx\"\nfrom = \"DX\"\n";
    let toml = study.join("study.toml");
    let written = std::fs::read_to_string(&toml).unwrap();
    let diagnosed = |name: &str| -> Value {
        let out = folder.path().join(name);
        let out = asid(&[
            "diagnose",
            text(&study),
            "--quiet",
            "--json",
            "--out",
            text(&out),
        ]);
        serde_json::from_slice(&out.stdout)
            .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&out.stderr)))
    };
    let check = |result: &Value, name: &str| -> (bool, String) {
        let checks = result["checks"].as_array().unwrap();
        let found = checks.iter().find(|c| c["check"] == name);
        let found = found.unwrap_or_else(|| panic!("no check `{name}`"));
        let detail = found["detail"].as_str().unwrap().to_owned();
        (found["ok"].as_bool().unwrap(), detail)
    };
    let (ok, said) = check(&diagnosed("a"), "log");
    assert!(!ok && said.contains("`DX` looks like `dx`"), "{said}");
    std::fs::write(&toml, format!("{written}{mapping}")).unwrap();
    let result = diagnosed("b");
    let (ok, said) = check(&result, "log");
    assert!(
        ok && said.contains("`battery`") && said.contains("stamps are read as us"),
        "{said}"
    );
    assert!(check(&result, "outliers").1.contains("6 of `dx`"));
    assert_eq!(
        result["wiring"][0]["fault"], "wiring-sign",
        "{}",
        result["wiring"]
    );
    assert_eq!(result["verdict"]["kind"], "none", "{}", result["sentence"]);
    // The lines that the result gives correct the wiring.
    let mend = result["wiring"][0]["mend"].as_str().unwrap();
    std::fs::write(&toml, format!("{written}{mapping}{mend}\n")).unwrap();
    let result = diagnosed("c");
    assert_eq!(result["wiring"], serde_json::json!([]));
    assert_eq!(result["verdict"]["kind"], "none", "{}", result["sentence"]);
}

#[test]
fn degrees_in_place_of_radians_are_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    write_study(&study, Truth::None);
    rewrite_logs(&study, |log| {
        let scaled = log.lines().enumerate().map(|(i, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if i > 0 {
                let x: f64 = cells[2].parse().unwrap();
                cells[2] = (x * 180.0 / std::f64::consts::PI).to_string();
            }
            cells.join(",") + "\n"
        });
        scaled.collect()
    });
    let out = asid(&[
        "diagnose",
        text(&study),
        "--quiet",
        "--json",
        "--out",
        text(&folder.path().join("o")),
    ]);
    let result: Value = serde_json::from_slice(&out.stdout).unwrap();
    let units = result["checks"]
        .as_array()
        .unwrap()
        .iter()
        .find(|c| c["check"] == "units")
        .unwrap();
    assert_eq!(units["ok"], false);
    assert!(
        units["detail"].as_str().unwrap().contains("degrees"),
        "{units}"
    );
}

#[test]
fn a_time_limit_and_an_interruption_end_with_what_is_known() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("study");
    write_study(&study, Truth::Coulomb(1.2));
    let out = folder.path().join("limit");
    let done = asid(&[
        "diagnose",
        text(&study),
        "--minutes",
        "1e-4",
        "--out",
        text(&out),
    ]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{said}");
    assert!(said.contains("first table, screening"), "{said}");
    assert!(said.contains("the time is up"), "{said}");
    let result = json(&out.join("result.json"));
    assert!(!result["not_tried"].as_array().unwrap().is_empty());
    assert!(!result["ranking"].as_array().unwrap().is_empty());
    let seconds = |key: &str| result[key].as_f64().unwrap();
    assert!(seconds("seconds_to_first_table") <= seconds("seconds"));
    let config = std::fs::read_to_string(out.join("config.toml")).unwrap();
    assert!(config.contains("minutes = 0.0001"), "{config}");

    let (said, status) = refusal(&["diagnose", text(&study), "--minutes", "0"]);
    assert!(said.contains("--minutes") && status == Some(2), "{said}");
}

#[cfg(unix)]
#[test]
fn the_first_interruption_writes_what_is_known() {
    use std::io::{BufRead as _, BufReader};
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    let (study, out) = (folder.path().join("study"), folder.path().join("out"));
    write_study(&study, Truth::Coulomb(1.2));
    let mut child = Command::new(env!("CARGO_BIN_EXE_asid"))
        .args(["diagnose", text(&study), "--out", text(&out)])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut interrupted = false;
    for line in lines.map_while(Result::ok) {
        if !interrupted && line.contains("first table") {
            let pid = child.id().to_string();
            let sent = Command::new("kill").args(["-INT", &pid]).status().unwrap();
            assert!(sent.success());
            interrupted = true;
        }
    }
    assert!(interrupted && child.wait().unwrap().success());
    let result = json(&out.join("result.json"));
    assert!(!result["not_tried"].as_array().unwrap().is_empty());
    assert!(out.join("report.html").is_file());
}
