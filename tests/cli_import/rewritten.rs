//! Imports of tables that were rewritten: sensors that are dead or missing, comments, decimal commas,
//! and cells without a number.

use std::path::{Path, PathBuf};

use super::{EPISODES, apart, diagnosed, each, fixture, import, told};
use asid::diagnosis::study::Study;

/// Logs of the fixture, each rewritten, in a folder.
pub fn rewritten(folder: &Path, rewrite: impl Fn(usize, &str) -> String) -> Vec<PathBuf> {
    let one = |(i, name): (usize, &str)| {
        let csv = std::fs::read_to_string(fixture(&format!("csv/{name}.csv"))).unwrap();
        let path = folder.join(format!("{name}.csv"));
        std::fs::write(&path, rewrite(i, &csv)).unwrap();
        path
    };
    EPISODES.into_iter().enumerate().map(one).collect()
}

/// A table with the cells of one column replaced, except its header.
fn with_column(csv: &str, column: usize, cell: impl Fn(&str) -> String) -> String {
    let row = |(i, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if i > 0 {
            cells[column] = cell(&cells[column]);
        }
        cells.join(",") + "\n"
    };
    csv.lines().enumerate().map(row).collect()
}

/// A sensor that never changes has no noise. In units of that noise the gap would be four billion,
/// without a warning from any check.
#[test]
fn a_sensor_that_never_changes_is_named_and_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        with_column(csv, 4, |_| "0.0292".into())
    });
    let study = folder.path().join("study");
    let done = import(&logs, &study, &[]);
    let noted = String::from_utf8_lossy(&done.stderr).into_owned();
    told(&done);
    let said = "`gripper_gap` always reads 0.0292 m";
    assert!(noted.contains(said), "{noted}");
    let result = diagnosed(&study, &folder.path().join("out"));
    let checks = result["checks"].as_array().unwrap();
    let log = checks.iter().find(|c| c["check"] == "log").unwrap();
    assert!(log["detail"].as_str().unwrap().contains(said), "{log}");
    assert_eq!(log["ok"], false);
    let signals = result["gap"]["signals"].as_array().unwrap();
    let named: Vec<&str> = signals
        .iter()
        .map(|s| s["signal"].as_str().unwrap())
        .collect();
    assert_eq!(named, ["pan_angle"]);
    let found = result["verdict"]["effects"].as_array().unwrap();
    assert!(found.contains(&"coulomb-friction@pan".into()), "{found:?}");
}

#[test]
fn columns_that_some_logs_lack_are_named_with_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |i, csv| match i {
        1 => csv.replacen("pan_angle", "turning", 1),
        3 => csv.replacen("gripper_gap", "jaw", 1),
        _ => csv.to_owned(),
    });
    let study = folder.path().join("study");
    let done = import(&logs, &study, &[]);
    let noted = String::from_utf8_lossy(&done.stderr).into_owned();
    let said = told(&done);
    assert!(said.contains("not used: turning, jaw"), "{said}");
    // The other logs keep their own rate.
    let rate = |name: &str| -> f64 {
        let row = said.lines().find(|l| l.starts_with(name)).unwrap();
        row.split_whitespace().nth(2).unwrap().parse().unwrap()
    };
    assert_eq!(rate("pan_angle"), rate("gripper_gap"));
    let lacks = |sensor: &str, log: &str| {
        let of = |line: &&str| line.contains(&format!("`{sensor}` has no reading in "));
        noted
            .lines()
            .find(of)
            .is_some_and(|l| l.contains(log) && !l.contains("train_0"))
    };
    assert!(lacks("pan_angle", "train_1.csv"), "{noted}");
    assert!(lacks("gripper_gap", "test_3.csv"), "{noted}");
    assert!(noted.contains("no log held out reads it"), "{noted}");
}

#[test]
fn the_state_of_the_first_row_is_said_to_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        let row = |(i, line): (usize, &str)| match i {
            0 => format!("{line},qpos.pan,qvel.pan,odd\n"),
            1 => format!("{line},0.1,0,1\n"),
            _ => format!("{line},,,1\n"),
        };
        csv.lines().enumerate().map(row).collect()
    });
    let said = told(&import(&logs, &folder.path().join("study"), &[]));
    assert!(
        said.contains("\nstate of the first row: qpos.pan, qvel.pan\nnot used: odd\n"),
        "{said}"
    );
    copies_hold_the_state_of_the_first_row(&logs, folder.path());
}

/// Symptom: the table said that the state of the first row is read, and copies of the logs were
/// without it. A single log, which is cut into parts, is always copied.
///
/// Cause: an episode was written without its initial state.
fn copies_hold_the_state_of_the_first_row(logs: &[PathBuf], folder: &Path) {
    let (whole, cut) = (folder.join("whole"), folder.join("cut"));
    told(&import(logs, &whole, &["--copy"]));
    told(&import(&logs[..1], &cut, &[]));
    let lines = |path: PathBuf| -> [String; 3] {
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines().map(str::to_owned);
        [(); 3].map(|()| lines.next().unwrap())
    };
    for path in [whole.join("train_0.csv"), cut.join("train_0.csv")] {
        let [header, first, second] = lines(path);
        assert!(header.ends_with(",qpos.pan,qvel.pan"), "{header}");
        assert!(first.ends_with(",0.1,0"), "{first}");
        assert!(second.ends_with(",,"), "{second}");
    }
    let [header, ..] = lines(cut.join("train_1.csv"));
    assert!(!header.contains("qpos"), "{header}");
    let study = Study::read(&whole).unwrap();
    assert!(study.train.iter().all(|(_, e)| e.initial.is_some()));
}

#[test]
fn comments_and_decimal_commas_are_read_as_the_plain_table() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        let table = csv.replace(',', ";").replace('.', ",");
        let table = table.replacen("ctrl,", "ctrl.", 2);
        format!("# robot: arm, second of its kind\n{table}# end\n")
    });
    let study = folder.path().join("study");
    told(&import(&logs, &study, &[]));
    let (read, csv) = (
        Study::read(&study).unwrap(),
        Study::read(&fixture("csv")).unwrap(),
    );
    assert_eq!(apart(&read, &csv), 0.0);
}

#[test]
fn a_file_that_cannot_be_read_says_what_is_wrong_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    let header = "time,ctrl.pan,ctrl.gripper,pan_angle,gripper_gap\n";
    for (text, wanted) in [
        (String::new(), "log.csv: is empty"),
        (header.to_owned(), "has no rows below its header (row 1)"),
        (
            format!("{header}2026-01-01T10:00:00,0,0,0,0\n"),
            "column `time`, the stamps, holds no numbers but text such as `2026-01-01T10:00:00`",
        ),
        (
            format!("{header}0,0,0,0,0\n0.1,0,0\n"),
            "row 3: cells found: 3, expected by the header (row 1): 5",
        ),
    ] {
        std::fs::write(&log, text).unwrap();
        let done = import(
            std::slice::from_ref(&log),
            &folder.path().join("study"),
            &[],
        );
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(
            (done.status.code(), said.lines().count()),
            (Some(2), 1),
            "{said}"
        );
        assert!(said.contains(wanted), "{said}");
    }
}

#[test]
fn a_mapped_column_without_a_number_is_told_with_what_it_holds() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        with_column(csv, 1, |x| x.replace('.', "'"))
    });
    let study = folder.path().join("study");
    let done = import(&logs, &study, &["--map", "ctrl.pan=ctrl.pan"]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(
        (done.status.code(), said.lines().count()),
        (Some(2), 1),
        "{said}"
    );
    assert!(said.contains("no cell of column ctrl.pan (`"), "{said}");
    let done = import(&logs, &study, &[]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(said.contains("without a number are ctrl.pan (`"), "{said}");
}

#[test]
fn all_missing_commands_are_named_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        csv.replacen("ctrl.pan,ctrl.gripper", "a,b", 1)
    });
    let done = import(&logs, &folder.path().join("study"), &[]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(
        said.contains("the command of the actuators `pan` and `gripper`"),
        "{said}"
    );
}

#[test]
fn a_quiet_import_of_sound_logs_says_nothing_on_standard_error() {
    let folder = tempfile::tempdir().unwrap();
    let done = import(&each("csv", ".csv"), &folder.path().join("study"), &[]);
    assert!(done.status.success());
    assert_eq!(String::from_utf8_lossy(&done.stderr), "");
}
