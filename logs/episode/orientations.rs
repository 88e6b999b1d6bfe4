//! Orientations of a log: quaternions of length one, or missing.
//!
//! A tracker that has lost its body, or an IMU that is not set up yet, reports zeros. Zeros are no
//! orientation: they count as missing, as an empty cell does. All others are scaled to length one.

use asid_core::layout::Layout;
use asid_core::signal::orientation;
use asid_core::{Episode, episode::InitialState};

/// Largest difference of a squared norm from 1 that is left as it is: a log of six digits keeps its
/// own.
const ROUNDED: f64 = 1e-5;

/// Scales a quaternion to length one, or sets it to NaN where it is no orientation; returns whether
/// it was set to NaN.
///
/// A quaternion with a missing entry stays.
fn settle(q: &mut [f64]) -> bool {
    if q.iter().any(|x| x.is_nan()) {
        return false;
    }
    let Some(turn) = orientation(q) else {
        q.fill(f64::NAN);
        return true;
    };
    let square: f64 = q.iter().map(|x| x * x).sum();
    if (square - 1.0).abs() > ROUNDED {
        q.copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
    }
    false
}

/// Settles all orientations of an episode.
///
/// Returns what lost some of its orientations with their number: sensors, and the joints of an
/// initial state.
pub(super) fn settle_all(episode: &mut Episode, layout: &Layout) -> Vec<(String, usize)> {
    let width = episode.width();
    let mut lost = Vec::new();
    let mut first = 0;
    for channel in &episode.channels {
        let columns = first..first + channel.len;
        first = columns.end;
        let sensor = layout.sensor(&channel.name);
        if !sensor.is_ok_and(|s| s.is_orientation()) {
            continue;
        }
        let rows = episode.readings.chunks_exact_mut(width);
        let count = rows.filter_map(|row| settle(&mut row[columns.clone()]).then_some(()));
        lost.push((channel.name.clone(), count.count()));
    }
    if let Some(InitialState { qpos, .. }) = &mut episode.initial {
        for at in layout.quaternions() {
            let count = usize::from(settle(&mut qpos[at..at + 4]));
            let begun = layout.joints.iter().filter(|j| j.qpos <= at);
            let joint = begun.max_by_key(|j| j.qpos);
            lost.extend(joint.map(|j| (format!("qpos.{}", j.name), count)));
        }
    }
    lost.retain(|(_, count)| *count > 0);
    lost
}

#[cfg(test)]
mod tests {
    use asid_core::layout::{Joint, JointKind, Sensor};

    use super::super::{LogNotes, read_mapped};
    use super::*;

    /// A free body whose orientation is read.
    fn layout() -> Layout {
        Layout {
            timestep: 0.002,
            nq: 7,
            nv: 6,
            bodies: Vec::new(),
            geoms: Vec::new(),
            joints: vec![Joint {
                name: "puck".into(),
                kind: JointKind::Free,
                body: "puck".into(),
                qpos: 0,
                qvel: 0,
            }],
            actuators: Vec::new(),
            sensors: vec![Sensor {
                name: "imu".into(),
                kind: "framequat".into(),
                address: 0,
                len: 4,
            }],
            keyframes: Vec::new(),
        }
    }

    fn read(rows: &[&str]) -> (Episode, LogNotes) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let columns = (0..4).map(|i| format!("imu.{i},qpos.puck.{}", i + 3));
        let columns: Vec<String> = columns.collect();
        let text = format!("time,{}\n{}\n", columns.join(","), rows.join("\n"));
        std::fs::write(&path, text).unwrap();
        read_mapped(&path, &layout(), &[]).unwrap()
    }

    /// Symptom: rows in which a tracker was lost counted as perfect readings, and one at the first
    /// row ended the work with "qpos holds a value that is not finite". Cause: a quaternion of
    /// zeros was read as an orientation.
    #[test]
    fn a_quaternion_of_zeros_is_a_missing_reading() {
        let (episode, notes) = read(&[
            "0.00,0,0,0,0,0,0,0,0",
            "0.01,0.6,1,0.8,0,0,0,0,0",
            "0.02,1.2,1,0,0,0,0,1.6,0",
            "0.03,0.3,1,0.3,0,0,0,0,0",
            "0.04,,1,0.3,0,0,0,0,0",
        ]);
        let row = |k: usize| episode.reading(k);
        assert!(row(0).iter().chain(row(3)).all(|x| x.is_nan()));
        assert_eq!(row(1), [0.6, 0.8, 0.0, 0.0]);
        // The norm of 2 is that of another unit.
        for (got, want) in row(2).iter().zip([0.6, 0.0, 0.0, 0.8]) {
            assert!((got - want).abs() < 1e-12, "{:?}", row(2));
        }
        assert!(row(4)[0].is_nan() && row(4)[1] == 0.3);
        // So does the initial state, which is then unknown there.
        let initial = episode.initial.as_ref().unwrap();
        assert!(initial.qpos[3..].iter().all(|x| x.is_nan()));
        let lost = [("imu".to_owned(), 2), ("qpos.puck".to_owned(), 1)];
        assert_eq!(notes.lost, lost);
        let said = notes.lines().join("; ");
        assert!(
            said.contains("2 orientations of `imu` are no rotation"),
            "{said}"
        );
    }
}
