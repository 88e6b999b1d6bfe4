//! Initial states of episodes: what their logs give, what their first readings show, and which
//! coordinates stay unknown.

pub(crate) mod reach;

use asid_core::Layout;
use asid_core::layout::{JointKind, Sensor};
use asid_core::problem::home;
use asid_core::signal::{orientation, rotation_difference, unit_quaternion};
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use crate::predict::State;
use crate::study::Study;

/// Returns the initial state of an episode: as its log gives it, else from its first readings, else
/// from the scene.
pub fn given_start(plant: &Plant, episode: &asid_core::Episode) -> State {
    let layout = &plant.layout;
    let (mut qpos, mut qvel) = home(layout);
    first_readings(plant, episode, &mut qpos, &mut qvel);
    if let Some(initial) = &episode.initial {
        let read = qpos.clone();
        for (x, given) in qpos.iter_mut().zip(&initial.qpos) {
            if given.is_finite() {
                *x = *given;
            }
        }
        // A mixture of given and read components is not a unit quaternion yet. One that is no
        // orientation gives none.
        for first in layout.quaternions() {
            let own = first..first + 4;
            match orientation(&qpos[own.clone()]) {
                Some(turn) => qpos[own].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]),
                None => qpos[own.clone()].copy_from_slice(&read[own]),
            }
        }
        for (x, given) in qvel.iter_mut().zip(&initial.qvel) {
            if given.is_finite() {
                *x = *given;
            }
        }
    }
    State { qpos, qvel }
}

/// Number of rows over which a first velocity is taken.
const FIRST_ROWS: usize = 6;

/// Sets what sensors of joints and of free bodies read of the initial state.
fn first_readings(plant: &Plant, episode: &asid_core::Episode, qpos: &mut [f64], qvel: &mut [f64]) {
    let layout = &plant.layout;
    // The first row with a reading of a sensor and one a little later, with the time between.
    let seen = |sensor: &Sensor| -> Option<(Vec<f64>, Vec<f64>, f64)> {
        let range = episode.channel(&sensor.name)?;
        let whole = |k: &usize| {
            let reading = &episode.reading(*k)[range.clone()];
            let is_read = reading.iter().all(|x| x.is_finite());
            is_read && (!sensor.is_orientation() || orientation(reading).is_some())
        };
        let mut rows = (0..episode.rows()).filter(whole);
        let first = rows.next()?;
        let later = rows.take(FIRST_ROWS).last().unwrap_or(first);
        let get = |k: usize| episode.reading(k)[range.clone()].to_vec();
        Some((
            get(first),
            get(later),
            episode.time[later] - episode.time[first],
        ))
    };
    for (i, sensor) in layout.sensors.iter().enumerate() {
        let Some((first, later, dt)) = seen(sensor) else {
            continue;
        };
        let rate = |k: usize| {
            if dt > 0.0 {
                (later[k] - first[k]) / dt
            } else {
                0.0
            }
        };
        // Spins are about the body's own axes.
        let spin = || {
            let turn = nalgebra::Vector3::from(rotation_difference(&later, &first));
            unit_quaternion(&first).inverse() * turn / dt.max(1e-9)
        };
        match plant.sensors[i] {
            Reads::Joint(j) => {
                let joint = &layout.joints[j];
                match &*sensor.kind {
                    "jointpos" => {
                        qpos[joint.qpos] = first[0];
                        qvel[joint.qvel] = rate(0);
                    }
                    "ballquat" => {
                        qpos[joint.qpos..joint.qpos + 4].copy_from_slice(&first);
                        qvel[joint.qvel..joint.qvel + 3].copy_from_slice(spin().as_slice());
                    }
                    _ => {}
                }
            }
            Reads::Body(b) => {
                let Some(joint) = plant.free_joint(b).map(|j| &layout.joints[j]) else {
                    continue;
                };
                match &*sensor.kind {
                    "framepos" => {
                        qpos[joint.qpos..joint.qpos + 3].copy_from_slice(&first);
                        for k in 0..3 {
                            qvel[joint.qvel + k] = rate(k);
                        }
                    }
                    "framequat" => {
                        qpos[joint.qpos + 3..joint.qpos + 7].copy_from_slice(&first);
                        qvel[joint.qvel + 3..joint.qvel + 6].copy_from_slice(spin().as_slice());
                    }
                    _ => {}
                }
            }
            Reads::Other => {}
        }
    }
    // A measured speed is better than a difference.
    for (i, sensor) in layout.sensors.iter().enumerate() {
        let joint = match (plant.sensors[i], &*sensor.kind) {
            (Reads::Joint(j), "jointvel" | "ballangvel") => Some(j),
            (Reads::Body(b), "framelinvel" | "frameangvel") => plant.free_joint(b),
            _ => None,
        };
        let Some((joint, (mut first, ..))) = joint.zip(seen(sensor)) else {
            continue;
        };
        let joint = &layout.joints[joint];
        let mut place = joint.qvel;
        if sensor.kind == "frameangvel" {
            // About the axes of the world.
            let turn = unit_quaternion(&qpos[joint.qpos + 3..joint.qpos + 7]);
            let own = turn.inverse() * nalgebra::Vector3::from_column_slice(&first);
            first.copy_from_slice(own.as_slice());
            place += 3;
        }
        qvel[place..place + first.len()].copy_from_slice(&first);
    }
}

/// Returns the degrees of freedom of a joint that the missing values of its position leave unknown.
///
/// Of a quaternion these are the axes of the missing components; all axes if that is not a single
/// one.
fn open_places(kind: JointKind, places: &[f64]) -> Vec<usize> {
    let missing = |i: usize| !places[i].is_finite();
    let turn = |first: usize, axes: std::ops::Range<usize>| -> Vec<usize> {
        let of: Vec<usize> = axes
            .clone()
            .filter(|a| missing(first + 1 + a - axes.start))
            .collect();
        match (missing(first), of.len()) {
            (false, 0) => Vec::new(),
            (_, 1) => of,
            _ => axes.collect(),
        }
    };
    match kind {
        JointKind::Hinge | JointKind::Slide => (0..1).filter(|&i| missing(i)).collect(),
        JointKind::Ball => turn(0, 0..3),
        JointKind::Free => {
            let mut open: Vec<usize> = (0..3).filter(|&i| missing(i)).collect();
            open.extend(turn(3, 3..6));
            open
        }
    }
}

/// Returns the coordinates of the initial states (`nv` positions, then `nv` velocities) that at
/// least one log does not give.
pub(crate) fn open_coordinates(layout: &Layout, study: &Study) -> Vec<usize> {
    let nv = layout.nv;
    let mut open = vec![false; 2 * nv];
    for (_, episode) in study.train.iter().chain(&study.test) {
        let Some(initial) = &episode.initial else {
            return (0..2 * nv).collect();
        };
        for joint in &layout.joints {
            let dofs = joint.qvel..joint.qvel + joint.kind.qvel_len();
            let places = &initial.qpos[joint.qpos..joint.qpos + joint.kind.qpos_len()];
            for d in open_places(joint.kind, places) {
                open[joint.qvel + d] = true;
            }
            for d in dofs {
                open[nv + d] |= !initial.qvel[d].is_finite();
            }
        }
    }
    (0..2 * nv).filter(|&c| open[c]).collect()
}

#[cfg(test)]
mod tests {
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    const PENDULUM: &str = r#"<mujoco><worldbody><body><joint name="pivot" type="ball"/>
        <geom size="0.05" pos="0 0 -0.3" mass="1"/></body></worldbody>
        <sensor><ballquat name="turn" joint="pivot"/><ballangvel name="spin" joint="pivot"/></sensor></mujoco>"#;

    /// Symptom: the gap of a right pendulum on a ball joint was enormous in logs that begin at 60
    /// degrees and do not give the initial state.
    ///
    /// Cause: its sensor counted as reading no joint, so that it began where the document places
    /// it, at rest. A replay from there does not move, and the prior of the start had no width.
    #[test]
    fn a_ball_joint_begins_where_its_sensors_read_it() {
        let plant = Plant::of(&Scene::from_xml("pendulum", PENDULUM, &[]).unwrap()).unwrap();
        let (begin, spin) = (
            UnitQuaternion::from_euler_angles(1.0, 0.2, -0.4),
            Vector3::new(0.3, -0.8, 2.0),
        );
        let turn = |k: usize| {
            // The spin is about the pendulum's own axes.
            let q = begin * UnitQuaternion::from_scaled_axis(0.01 * k as f64 * spin);
            vec![q.w, q.i, q.j, q.k]
        };
        let log = |name: &str, reading: &dyn Fn(usize) -> Vec<f64>| Episode {
            time: (0..20).map(|k| 0.01 * f64::from(k)).collect(),
            channels: vec![ChannelColumns {
                name: name.into(),
                len: reading(0).len(),
            }],
            readings: (0..20).flat_map(reading).collect(),
            ..Episode::default()
        };
        let is_near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        let found = given_start(&plant, &log("turn", &turn));
        assert!(is_near(&found.qpos, &turn(0)), "{:?}", found.qpos);
        assert!(is_near(&found.qvel, spin.as_slice()), "{:?}", found.qvel);
        let found = given_start(&plant, &log("spin", &|_| vec![1.0, 2.0, 3.0]));
        assert_eq!(found.qvel, [1.0, 2.0, 3.0]);
    }

    /// Symptom: "qpos holds a value that is not finite" where a tracker was lost in the first rows.
    /// Cause: a quaternion of zeros has no direction, and the start took it for an orientation.
    #[test]
    fn a_start_takes_no_orientation_from_zeros() {
        let plant = Plant::of(&Scene::from_xml("pendulum", PENDULUM, &[]).unwrap()).unwrap();
        let turn = |k: usize| match k {
            0..3 => [0.0; 4],
            _ => [0.6, 0.0, 0.8, 0.0],
        };
        let mut episode = Episode {
            time: (0..20).map(|k| 0.01 * f64::from(k)).collect(),
            channels: vec![ChannelColumns {
                name: "turn".into(),
                len: 4,
            }],
            readings: (0..20).flat_map(turn).collect(),
            ..Episode::default()
        };
        let found = given_start(&plant, &episode);
        assert_eq!((found.qpos, found.qvel), (turn(3).to_vec(), vec![0.0; 3]));
        episode.initial = Some(asid_core::episode::InitialState {
            qpos: vec![0.0; 4],
            qvel: vec![0.0; 3],
        });
        assert_eq!(given_start(&plant, &episode).qpos, turn(3));
    }

    /// Symptom: replays of a thrown body began without the spin that a sensor reads. Cause: speeds
    /// were read of joints alone.
    #[test]
    fn a_free_body_begins_with_the_speeds_that_its_sensors_read() {
        let scene = r#"<mujoco><worldbody>
            <body name="b"><freejoint name="b"/><geom size="0.05" mass="1"/></body></worldbody>
            <sensor><frameangvel name="spin" objtype="xbody" objname="b"/>
            <framelinvel name="speed" objtype="xbody" objname="b"/>
            <framequat name="turn" objtype="xbody" objname="b"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("thrown", scene, &[]).unwrap()).unwrap();
        // A quarter turn about z: the body's own x is the world's y.
        let side = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
        let turn = [side.w, side.i, side.j, side.k];
        let row = [&[7.0, 2.0, 3.0, -1.0, 0.5, 4.0][..], &turn].concat();
        let channel = |(name, len): (&str, usize)| ChannelColumns {
            name: name.into(),
            len,
        };
        let channels = [("spin", 3), ("speed", 3), ("turn", 4)];
        let episode = Episode {
            time: vec![0.0, 0.01],
            channels: channels.map(channel).into(),
            readings: row.repeat(2),
            ..Episode::default()
        };
        let found = given_start(&plant, &episode);
        let want = [-1.0, 0.5, 4.0, 2.0, -7.0, 3.0];
        for (got, want) in found.qvel.iter().zip(want) {
            assert!((got - want).abs() < 1e-12, "{:?}", found.qvel);
        }
    }
}
