//! A log of another stack with the right mapping equals the log in the model's terms.

use asid_core::episode::ChannelColumns;
use asid_core::layout::{Actuator, Sensor};

use super::*;

/// A servo with its angle and the position of its tip.
pub(super) fn layout() -> Layout {
    Layout {
        timestep: 0.01,
        nq: 0,
        nv: 0,
        bodies: vec!["world".into()],
        geoms: vec![],
        joints: vec![],
        actuators: vec![Actuator {
            name: "servo".into(),
            ctrl_range: None,
        }],
        sensors: vec![
            Sensor {
                name: "angle".into(),
                kind: "jointpos".into(),
                address: 0,
                len: 1,
            },
            Sensor {
                name: "tip".into(),
                kind: "framepos".into(),
                address: 1,
                len: 3,
            },
        ],
        keyframes: vec![],
    }
}

fn read_text(text: &str, mappings: &[ColumnMapping]) -> Result<(Episode, LogNotes)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    read_mapped(&path, &layout(), mappings)
}

/// A log at 100 Hz: the angle is a cubic of time, the tip moves linearly.
fn plain(late: f64) -> Vec<[f64; 6]> {
    (0..60)
        .map(|k| {
            let t = 0.01 * f64::from(k);
            let s = t - late;
            [t, f64::from(k / 7), 0.3 + 2.0 * s, s, -s, 1.0 + 0.5 * s]
        })
        .collect()
}

fn text(header: &str, rows: &[[f64; 6]]) -> String {
    let rows: Vec<String> = rows
        .iter()
        .map(|row| row.map(|x| x.to_string()).join(","))
        .collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

const PLAIN: &str = "time,ctrl.servo,angle,tip.0,tip.1,tip.2";

fn assert_same(a: &Episode, b: &Episode) {
    assert_eq!(a.channels, b.channels);
    for (x, y) in [
        (&a.time, &b.time),
        (&a.ctrl, &b.ctrl),
        (&a.readings, &b.readings),
    ] {
        assert_eq!(x.len(), y.len());
        for (x, y) in x.iter().zip(y) {
            assert!(
                (x - y).abs() < 1e-9 || (x.is_nan() && y.is_nan()),
                "{x} {y}"
            );
        }
    }
}

#[test]
fn a_spoilt_log_with_its_mending_gives_the_same_readings() {
    let (want, _) = read_text(&text(PLAIN, &plain(0.0)), &[]).unwrap();
    // Stamps in ms, the command in degrees, the angle in degrees with the wrong sign and another
    // zero, the tip in mm with two axes swapped.
    let spoilt: Vec<[f64; 6]> = plain(0.0)
        .into_iter()
        .map(|[t, u, angle, x, y, z]| {
            let turned = -(angle - 0.7).to_degrees();
            [1e3 * t, u.to_degrees(), turned, 1e3 * x, 1e3 * y, 1e3 * z]
        })
        .collect();
    let header = "stamp,cmd,joint,mocap.1,mocap.0,mocap.2";
    let mapping = |name: &str, from: &str, unit: &str| ColumnMapping {
        from: Some(from.into()),
        unit: Some(unit.into()),
        ..ColumnMapping::of(name)
    };
    let mappings = [
        mapping("time", "stamp", "ms"),
        mapping("ctrl.servo", "cmd", "deg"),
        ColumnMapping {
            sign: -1.0,
            offset: 0.7,
            ..mapping("angle", "joint", "deg")
        },
        mapping("tip", "mocap", "mm"),
        mapping("tip.0", "mocap.1", "mm"),
        mapping("tip.1", "mocap.0", "mm"),
    ];
    let (got, notes) = read_text(&text(header, &spoilt), &mappings).unwrap();
    assert_same(&got, &want);
    assert_eq!(notes, LogNotes::default());
}

#[test]
fn readings_that_are_late_are_given_to_the_time_that_they_tell_of() {
    let (want, _) = read_text(&text(PLAIN, &plain(0.0)), &[]).unwrap();
    let mappings = ["angle", "tip"].map(|name| ColumnMapping {
        delay: 0.034,
        ..ColumnMapping::of(name)
    });
    let (got, _) = read_text(&text(PLAIN, &plain(0.034)), &mappings).unwrap();
    // Readings of the last rows arrive after the log's end.
    let told = 60 - 4;
    let width = want.width();
    for (x, y) in got.readings[..told * width].iter().zip(&want.readings) {
        assert!((x - y).abs() < 1e-9, "{x} {y}");
    }
    assert!(got.readings[told * width..].iter().all(|x| x.is_nan()));
}

#[test]
fn a_delayed_command_keeps_its_integral() {
    let (episode, _) = read_text(&text(PLAIN, &plain(0.0)), &[]).unwrap();
    let delay = ColumnMapping {
        delay: 0.025,
        ..ColumnMapping::of("ctrl.servo")
    };
    let late = remapped(&episode, &layout(), (&[delay], &[])).unwrap();
    // Command k / 7 in row k: the first step arrives in the middle of row 9.
    for (got, want) in late.ctrl[8..11].iter().zip([0.0, 0.5, 1.0]) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn a_mapping_of_an_episode_is_the_mapping_of_its_file() {
    let text = text(PLAIN, &plain(0.0));
    let mappings = [
        ColumnMapping {
            from: Some("tip.1".into()),
            sign: -1.0,
            ..ColumnMapping::of("tip.0")
        },
        ColumnMapping {
            unit: Some("deg".into()),
            offset: 0.1,
            delay: 0.02,
            ..ColumnMapping::of("angle")
        },
    ];
    let (of_file, _) = read_text(&text, &mappings).unwrap();
    let (plain, _) = read_text(&text, &[]).unwrap();
    assert_same(
        &remapped(&plain, &layout(), (&mappings, &[])).unwrap(),
        &of_file,
    );
}

#[test]
fn columns_that_the_model_does_not_know_are_listed_and_a_misspelt_one_named() {
    let text =
        "time,ctrl.servo,Angle,battery,tip.0,tip.1,tip.2\n0,1,2,12.1,0,0,0\n0.1,1,2,oops,0,0,0\n";
    let (episode, notes) = read_text(text, &[]).unwrap();
    assert_eq!(episode.channels.len(), 1);
    assert_eq!(notes.passed_over, ["Angle", "battery"]);
    assert_eq!(notes.misspelt, [("Angle".into(), "angle".into())]);
}

#[test]
fn commands_at_a_lower_rate_than_readings_are_held() {
    let text = "time,ctrl.servo,angle\n0,,1\n0.1,5,nan\n0.2,,3\n0.3,6,\n";
    let (episode, notes) = read_text(text, &[]).unwrap();
    assert_eq!(episode.ctrl, [5.0, 5.0, 5.0, 6.0]);
    assert_eq!(notes.held, 2);
    assert!(episode.readings[1].is_nan() && episode.readings[3].is_nan());
}

#[test]
fn stamps_in_nanoseconds_give_a_log_of_seconds() {
    let rows: Vec<String> = (0..20)
        .map(|k| format!("{},0,{k}", 1_700_000_000_000_000_000_i64 + 10_000_000 * k))
        .collect();
    let text = format!("time,ctrl.servo,angle\n{}\n", rows.join("\n"));
    let (episode, notes) = read_text(&text, &[]).unwrap();
    assert_eq!(notes.time_unit, Some("ns"));
    for (k, t) in episode.time.iter().enumerate() {
        assert!((t - 0.01 * k as f64).abs() < 1e-6, "{t}");
    }
}

#[test]
fn logs_round_trip_to_the_bit() {
    let episode = Episode {
        time: vec![0.0, 0.1, 0.2],
        actuators: vec!["servo".into()],
        ctrl: vec![1.0 / 3.0, -2e-7, 1e20],
        channels: vec![
            ChannelColumns {
                name: "angle".into(),
                len: 1,
            },
            ChannelColumns {
                name: "tip".into(),
                len: 3,
            },
        ],
        readings: vec![
            0.1,
            1.0,
            f64::NAN,
            3.0,
            0.2,
            1.5,
            2.0,
            3.5,
            -0.3,
            1.0,
            2.0,
            std::f64::consts::PI,
        ],
        initial: None,
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("log.csv");
    episode.write_csv(&path).unwrap();
    let back = read(&path, &layout()).unwrap();
    assert_eq!(back.time, episode.time);
    assert_eq!(back.ctrl, episode.ctrl);
    for (a, b) in back.readings.iter().zip(&episode.readings) {
        assert!(a == b || (a.is_nan() && b.is_nan()));
    }
}

#[test]
fn names_with_commas_and_quotes_read_back() {
    let mut layout = layout();
    for (name, odd) in [("servo", "a, \"b\""), ("angle", "l,ed")] {
        for a in layout.actuators.iter_mut().filter(|a| a.name == name) {
            a.name = odd.into();
        }
        for s in layout.sensors.iter_mut().filter(|s| s.name == name) {
            s.name = odd.into();
        }
    }
    let actuators = vec![layout.actuators[0].name.clone()];
    let sensor = layout.sensors.iter().find(|s| s.len == 1).unwrap();
    let episode = Episode {
        time: vec![0.0, 0.1],
        actuators,
        ctrl: vec![1.0, 2.0],
        channels: vec![ChannelColumns {
            name: sensor.name.clone(),
            len: 1,
        }],
        readings: vec![0.5, 0.25],
        ..Episode::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    episode.write_csv(&path).unwrap();
    let header = std::fs::read_to_string(&path).unwrap();
    assert!(
        header.starts_with("time,\"ctrl.a, \"\"b\"\"\","),
        "{header}"
    );
    let back = read(&path, &layout);
    assert_eq!(
        back.map(|b| b.readings).map_err(|e| e.to_string()),
        Ok(episode.readings)
    );
}

#[test]
fn bad_logs_name_row_and_column() {
    let cases = [
        ("t,ctrl.servo,angle\n0,1,2\n", "no column `time`"),
        ("time,angle\n0,1\n", "`ctrl.servo`"),
        ("time,ctrl.servo,angel\n0,1,2\n1,1,2\n", "`angel`"),
        ("time,ctrl.servo,tip.0,tip.1\n0,1,2,3\n", "`tip.2`"),
        (
            "time,ctrl.servo,angle\n0,1,2\n0,1,2\n",
            "different times: 1",
        ),
        (
            "time,ctrl.servo,angle\n0,1,2\n1,1,abc\n",
            "row 3, column `angle`: `abc`",
        ),
        (
            "time,ctrl.servo,angle\n0,,2\n1,,2\n",
            "column `ctrl.servo`: every command is missing",
        ),
        ("time,ctrl.servo,angle\n0,1,2\n", "different times: 1"),
        ("time,ctrl.servo,angle\n0,1,\n1,1,\n", "every reading"),
        ("time,ctrl.servo,angle\n0,1,2\n1,1\n", "row 3"),
    ];
    for (text, expected) in cases {
        let error = read_text(text, &[]).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_column_without_a_reading_and_a_sensor_without_a_name_are_said() {
    let mut nameless = layout();
    nameless.sensors[1].name = "sensor1".into();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let read = |text: &str, layout: &Layout| {
        std::fs::write(&path, text).unwrap();
        read_mapped(&path, layout, &[]).unwrap().1
    };
    let notes = read(
        "time,ctrl.servo,angle,tip.0,tip.1,tip.2\n0,0,,1,1,1\n0.1,0,nan,1,1,1\n",
        &layout(),
    );
    assert_eq!(notes.empty, ["angle"]);
    assert!(notes.is_suspicious());
    let said = notes.lines().join("; ");
    assert!(
        said.contains("every reading of column `angle` is missing"),
        "{said}"
    );
    let notes = read("time,ctrl.servo,angle\n0,0,1\n0.1,0,2\n", &nameless);
    let said = notes.lines().join("; ");
    assert!(said.contains("is called `sensor1`"), "{said}");
    assert!(!notes.is_suspicious());
    let notes = read("time,ctrl.servo,angle,tip\n0,0,1,1\n0.1,0,2,1\n", &nameless);
    assert!(notes.is_suspicious());
    let notes = read("time,ctrl.servo,angle\n0,0,1\n0.1,,2\n", &layout());
    assert!(notes.empty.is_empty() && notes.nameless.is_empty());
}

#[test]
fn a_column_that_stands_twice_is_refused_by_name() {
    let error = read_text("time,ctrl.servo,angle,angle\n0,0,1,1\n0.1,0,2,2\n", &[]);
    let said = error.unwrap_err().to_string();
    assert!(
        said.contains("log.csv") && said.contains("column `angle` stands twice"),
        "{said}"
    );
    assert!(said.contains("column 3 and as column 4"), "{said}");
    // Empty names: of an index, and of cells after the last comma.
    let read = read_text(",time,ctrl.servo,angle,\n0,0,0,1,\n1,0.1,0,2,\n", &[]);
    assert!(read.is_ok(), "{read:?}");
}

/// Symptom: a command that was missing was said to be a sensor's column: "is it `pos_elbow`?"
///
/// Cause: the most similar of all columns was named, also one that another quantity has.
#[test]
fn a_missing_command_is_not_said_to_be_the_column_of_a_sensor() {
    let from = |name: &str, from: &str| ColumnMapping {
        from: Some(from.into()),
        ..ColumnMapping::of(name)
    };
    let mappings = [from("ctrl.servo", "cmd_servo"), from("angle", "pos_servo")];
    let said = |header: &str| {
        let read = read_text(&format!("{header}\n0,0\n0.1,0\n"), &mappings);
        read.unwrap_err().to_string()
    };
    let alone = said("time,pos_servo");
    let expected = "has no column `cmd_servo`, the command of actuator `servo`";
    assert!(alone.ends_with(expected), "{alone}");
    assert!(said("time,cmd_sevro").ends_with("is it `cmd_sevro`?"));
}

/// Symptom: a reading of 1e308, which some loggers write for none, was fitted.
#[test]
fn a_number_larger_than_any_reading_is_refused_with_its_cell() {
    let (header, mut rows) = (PLAIN, plain(0.0));
    // Stamps in nanoseconds since 1970 are large, and right.
    rows.iter_mut()
        .for_each(|row| row[0] = 1e9 * (1.7e9 + row[0]));
    assert!(read_text(&text(header, &rows), &[]).is_ok());
    rows[4][2] = 1e308;
    let said = read_text(&text(header, &rows), &[])
        .unwrap_err()
        .to_string();
    let parts = ["row 6, column `angle`: 1e308", "leave the cell empty"];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
}
