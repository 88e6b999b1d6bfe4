//! Imports whose mapping needs care: a column that a log lacks, two faults of one column, and a row
//! of units.

use asid::diagnosis::study::Study;
use asid::logs::episode::ColumnMapping;

use super::rewritten::rewritten;
use super::{diagnosed, import, told};

/// Symptom: the import was refused with "sensor `gripper_gap` has 1 entries but column `jaw` is
/// missing", and so was the diagnosis of such a study.
///
/// Cause: a mapping was taken for a promise that each log has its column.
#[test]
fn a_log_without_a_mapped_column_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |i, csv| {
        let jaw = if i == 1 { "other" } else { "jaw" };
        let header = format!("time,u1,u2,j1/pos,{jaw}");
        csv.replacen(
            "time,ctrl.pan,ctrl.gripper,pan_angle,gripper_gap",
            &header,
            1,
        )
    });
    let maps = [
        "ctrl.pan=u1",
        "ctrl.gripper=u2",
        "pan_angle=j1/pos",
        "gripper_gap=jaw",
    ];
    let more: Vec<&str> = maps.iter().flat_map(|m| ["--map", *m]).collect();
    let study = folder.path().join("study");
    let done = import(&logs, &study, &more);
    let noted = String::from_utf8_lossy(&done.stderr).into_owned();
    told(&done);
    let lacks = |text: &str| {
        text.contains("`gripper_gap` has no reading in ") && text.contains("train_1.csv")
    };
    assert!(lacks(&noted), "{noted}");
    let result = diagnosed(&study, &folder.path().join("out"));
    let checks = result["checks"].as_array().unwrap();
    let log = checks.iter().find(|c| c["check"] == "log").unwrap();
    assert!(lacks(log["detail"].as_str().unwrap()), "{log}");
    let signals = result["gap"]["signals"].as_array().unwrap();
    assert_eq!(signals.len(), 2, "{signals:?}");
}

/// Symptom: the column that counted the other way got the delay of a late clock as well, and no
/// other column did. No common delay was left for the diagnosis to find.
///
/// Cause: the line of a column holds the corrections of all its faults, also that of a clock, which
/// an import leaves to the diagnosis.
#[test]
fn a_late_clock_beside_a_wrong_sign_is_left_to_the_diagnosis_in_every_column() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
        // Readings of three rows before, 60 ms.
        let late = (4..rows.len()).map(|k| {
            let (now, then) = (&rows[k], &rows[k - 3]);
            let angle: f64 = then[3].parse().unwrap();
            format!("{},{},{},{},{}\n", now[0], now[1], now[2], -angle, then[4])
        });
        format!("{}\n{}", rows[0].join(","), late.collect::<String>())
    });
    let study = folder.path().join("study");
    let done = import(&logs, &study, &[]);
    let noted = String::from_utf8_lossy(&done.stderr).into_owned();
    told(&done);
    assert!(
        noted.contains("wiring-sign of pan_angle is likely"),
        "{noted}"
    );
    assert!(
        noted.contains("readings are late against the commands"),
        "{noted}"
    );
    let turned = ColumnMapping {
        sign: -1.0,
        ..ColumnMapping::of("pan_angle")
    };
    assert_eq!(Study::read(&study).unwrap().columns, [turned]);
}

/// Symptom: "no column is the command of the actuators …; nothing is left in the log", for a table
/// with a row of units.
///
/// Cause: stamps were counted from the first cell of their column, which was no number.
#[test]
fn a_row_of_units_is_named_as_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let logs = rewritten(folder.path(), |_, csv| {
        csv.replacen('\n', "\ns,rad,m,rad,m\n", 1)
    });
    let done = import(&logs, &folder.path().join("study"), &[]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(
        (done.status.code(), said.lines().count()),
        (Some(2), 1),
        "{said}"
    );
    assert!(
        said.contains("row 2, column `time`: `s` is not a finite number"),
        "{said}"
    );
}
