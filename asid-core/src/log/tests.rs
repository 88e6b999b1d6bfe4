//! A log of another stack, with the mapping that mends it, is the log as the model has it.

use super::*;
use crate::episode::tests::layout;

fn read_text(text: &str, mappings: &[ColumnMapping]) -> Result<(Episode, LogNotes)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text).unwrap();
    read(&path, &layout(), mappings)
}

/// A log at 100 Hz: the angle is a cubic of time, the tip runs on lines.
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
    // Stamps in ms, the command in degrees, the angle in degrees with the wrong sign and another zero, the tip in mm with
    // two axes swapped.
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
    // What the last rows would have told came after the log's end.
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
    let late = episode.remapped(&layout(), &[delay]).unwrap();
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
    assert_same(&plain.remapped(&layout(), &mappings).unwrap(), &of_file);
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
