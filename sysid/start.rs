//! The initial state of an episode: from its log, its first readings, or else the scene.

use asid_core::Episode;
use asid_core::episode::InitialState;
use asid_core::layout::{JointKind, Layout};
use asid_core::problem::home;
use asid_core::signal::{orientation, rotation_difference, unit_quaternion};
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;
use nalgebra::{UnitQuaternion, Vector3};

/// Rows over which an initial velocity is taken.
///
/// They are enough to outweigh the noise of two readings, and few enough that a motion does not
/// reverse.
const ROWS: usize = 6;

/// The initial state of an episode, and the coordinates of it that the log leaves open.
///
/// Coordinates are `nv` positions, then `nv` velocities.
#[must_use]
pub fn start_of(plant: &Plant, episode: &Episode) -> (InitialState, Vec<usize>) {
    let layout = &plant.layout;
    let (qpos, qvel) = home(layout);
    let mut state = InitialState { qpos, qvel };
    first_readings(plant, episode, &mut state);
    let read = state.qpos.clone();
    let mut open: Vec<usize> = (0..2 * layout.nv).collect();
    if let Some(given) = &episode.initial {
        let fill = |to: &mut [f64], from: &[f64]| {
            for (x, y) in to.iter_mut().zip(from).filter(|(_, y)| y.is_finite()) {
                *x = *y;
            }
        };
        fill(&mut state.qpos, &given.qpos);
        fill(&mut state.qvel, &given.qvel);
        open = open_coordinates(layout, given);
    }
    for at in layout.quaternions() {
        // One that is no orientation gives none.
        match orientation(&state.qpos[at..at + 4]) {
            Some(turn) => {
                state.qpos[at..at + 4].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
            }
            None => state.qpos[at..at + 4].copy_from_slice(&read[at..at + 4]),
        }
    }
    (state, open)
}

/// Index in `qpos` at which the quaternion of a joint begins.
fn quaternion(joint: &asid_core::layout::Joint) -> Option<usize> {
    match joint.kind {
        JointKind::Free => Some(joint.qpos + 3),
        JointKind::Ball => Some(joint.qpos),
        JointKind::Hinge | JointKind::Slide => None,
    }
}

/// Coordinates that a state leaves open.
///
/// A quaternion with a missing component, or that is no orientation, leaves the whole orientation
/// open.
fn open_coordinates(layout: &Layout, given: &InitialState) -> Vec<usize> {
    let mut open = Vec::new();
    for joint in &layout.joints {
        let missing = |i: usize| !given.qpos[i].is_finite();
        let places = match joint.kind {
            JointKind::Free => 3,
            JointKind::Ball => 0,
            JointKind::Hinge | JointKind::Slide => 1,
        };
        open.extend(
            (0..places)
                .filter(|&k| missing(joint.qpos + k))
                .map(|k| joint.qvel + k),
        );
        if let Some(at) = quaternion(joint)
            && orientation(&given.qpos[at..at + 4]).is_none()
        {
            open.extend((0..3).map(|k| joint.qvel + places + k));
        }
    }
    let velocities = given.qvel.iter().enumerate();
    open.extend(
        velocities
            .filter(|(_, x)| !x.is_finite())
            .map(|(i, _)| layout.nv + i),
    );
    open
}

/// Sets the state from the first rows of sensors of joints and of free bodies.
fn first_readings(plant: &Plant, episode: &Episode, state: &mut InitialState) {
    let layout = &plant.layout;
    for (i, sensor) in layout.sensors.iter().enumerate() {
        let Some(range) = episode.channel(&sensor.name) else {
            continue;
        };
        let whole = |k: &usize| {
            let reading = &episode.reading(*k)[range.clone()];
            let is_read = reading.iter().all(|x| x.is_finite());
            is_read && (!sensor.is_orientation() || orientation(reading).is_some())
        };
        let rows: Vec<usize> = (0..episode.rows()).filter(whole).take(ROWS).collect();
        let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else {
            continue;
        };
        let at = |k: usize| &episode.reading(k)[range.clone()];
        let seconds = (episode.time[last] - episode.time[first]).max(f64::MIN_POSITIVE);
        let rate = |k: usize| (at(last)[k] - at(first)[k]) / seconds;
        // Sets an orientation and its spin, which is about the body's own axes.
        let mut orient = |at_qpos: usize, at_qvel: usize| {
            state.qpos[at_qpos..at_qpos + 4].copy_from_slice(at(first));
            // A single reading tells no spin, and its turn by itself is but rounding.
            if last > first {
                let turn = Vector3::from(rotation_difference(at(last), at(first)));
                let own = unit_quaternion(at(first)).inverse() * turn / seconds;
                state.qvel[at_qvel..at_qvel + 3].copy_from_slice(own.as_slice());
            }
        };
        match (plant.sensors[i], &*sensor.kind) {
            (Reads::Joint(j), "jointpos") => {
                state.qpos[layout.joints[j].qpos] = at(first)[0];
                state.qvel[layout.joints[j].qvel] = rate(0);
            }
            (Reads::Joint(j), "ballquat") => orient(layout.joints[j].qpos, layout.joints[j].qvel),
            (Reads::Body(b), kind @ ("framepos" | "framequat")) => {
                let Some(joint) = plant.free_joint(b).map(|j| &layout.joints[j]) else {
                    continue;
                };
                if kind == "framepos" {
                    state.qpos[joint.qpos..joint.qpos + 3].copy_from_slice(at(first));
                    (0..3).for_each(|k| state.qvel[joint.qvel + k] = rate(k));
                } else {
                    orient(joint.qpos + 3, joint.qvel + 3);
                }
            }
            _ => {}
        }
    }
    // A measured speed is better than a difference.
    for (i, sensor) in layout.sensors.iter().enumerate() {
        if let (Reads::Joint(j), "jointvel" | "ballangvel") = (plant.sensors[i], &*sensor.kind)
            && let Some(range) = episode.channel(&sensor.name)
            && let Some(speed) = (0..episode.rows())
                .map(|k| &episode.reading(k)[range.clone()])
                .find(|speed| speed.iter().all(|x| x.is_finite()))
        {
            let place = layout.joints[j].qvel;
            state.qvel[place..place + speed.len()].copy_from_slice(speed);
        }
    }
}

/// The state moved along a coordinate: of the `nv` positions (`< nv`), then of the `nv` velocities.
///
/// Orientations turn about the body's own axes.
#[must_use]
pub fn moved(layout: &Layout, state: &InitialState, coordinate: usize, by: f64) -> InitialState {
    let mut state = state.clone();
    if coordinate >= layout.nv {
        state.qvel[coordinate - layout.nv] += by;
        return state;
    }
    let holds =
        |j: &&asid_core::layout::Joint| (j.qvel..j.qvel + j.kind.qvel_len()).contains(&coordinate);
    let Some(joint) = layout.joints.iter().find(holds) else {
        return state;
    };
    let local = coordinate - joint.qvel;
    let axis = match joint.kind {
        JointKind::Hinge | JointKind::Slide => None,
        JointKind::Free => local.checked_sub(3),
        JointKind::Ball => Some(local),
    };
    match (axis, quaternion(joint)) {
        (Some(axis), Some(at)) => {
            let old = unit_quaternion(&state.qpos[at..at + 4]);
            let new = old * UnitQuaternion::from_scaled_axis(Vector3::ith(axis, by));
            state.qpos[at..at + 4].copy_from_slice(&[new.w, new.i, new.j, new.k]);
        }
        _ => state.qpos[joint.qpos + local] += by,
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::episode::ChannelColumns;
    use asid_core::scene::Scene;

    /// Spin of the logged body about the world's vertical axis, rad/s.
    const SPIN: f64 = 8.0;

    const FREE: &str = r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="0.1"/></body></worldbody>
        <sensor><framequat name="q" objtype="xbody" objname="b"/></sensor></mujoco>"#;

    const BALL: &str = r#"<mujoco><worldbody><body><joint name="j" type="ball"/><geom size="0.1"/></body></worldbody>
        <sensor><ballquat name="q" joint="j"/></sensor></mujoco>"#;

    /// The start that a log of a turning body without an initial state gives, at 100 Hz.
    fn start_of_turning(xml: &str, rows: usize) -> (InitialState, UnitQuaternion<f64>) {
        let plant = Plant::of(&Scene::from_xml("s", xml, &[]).unwrap()).unwrap();
        let first = UnitQuaternion::from_euler_angles(0.4, -1.2, 3.0);
        let reading = |k: usize| {
            let turn = Vector3::new(0.0, 0.0, SPIN * 0.01 * k as f64);
            let q = UnitQuaternion::from_scaled_axis(turn) * first;
            // A tracker gives either sign.
            let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            [q.w, q.i, q.j, q.k].map(|x| sign * x)
        };
        let episode = Episode {
            time: (0..rows).map(|k| 0.01 * k as f64).collect(),
            channels: vec![ChannelColumns {
                name: "q".into(),
                len: 4,
            }],
            readings: (0..rows).flat_map(reading).collect(),
            ..Episode::default()
        };
        (start_of(&plant, &episode).0, first)
    }

    /// Symptom: "qpos holds a value that is not finite" where a tracker was lost in the first row.
    /// Cause: zeros were taken for an orientation, and have no direction.
    #[test]
    fn zeros_give_no_orientation_of_a_start() {
        let plant = Plant::of(&Scene::from_xml("s", BALL, &[]).unwrap()).unwrap();
        let (lost, read) = ([0.0; 4], [0.6, 0.0, 0.0, 0.8]);
        let episode = Episode {
            time: vec![0.0, 0.01, 0.02],
            channels: vec![ChannelColumns {
                name: "q".into(),
                len: 4,
            }],
            readings: [lost, read, read].concat(),
            initial: Some(InitialState {
                qpos: lost.to_vec(),
                qvel: vec![0.0; 3],
            }),
            ..Episode::default()
        };
        let (start, open) = start_of(&plant, &episode);
        assert_eq!((start.qpos, open), (read.to_vec(), vec![0, 1, 2]));
    }

    /// Symptom: arbitrary estimates and residuals of hundreds of noises on logs of a turning body
    /// that give no start.
    ///
    /// Cause: its spin began at 0, and residuals of an orientation wrap after half a turn, so that
    /// no fit of the start found the spin. A ball joint began where the scene places it.
    #[test]
    fn a_body_starts_with_the_spin_of_its_first_readings() {
        for (xml, qpos, qvel) in [(FREE, 3, 3), (BALL, 0, 0)] {
            let (start, first) = start_of_turning(xml, 100);
            let read = unit_quaternion(&start.qpos[qpos..qpos + 4]);
            assert!(read.angle_to(&first) < 1e-7, "{start:?} {first}");
            let own = first.inverse() * Vector3::new(0.0, 0.0, SPIN);
            for k in 0..3 {
                let spin = start.qvel[qvel + k];
                assert!((spin - own[k]).abs() < 1e-9, "{start:?} {own}");
            }
            // One reading tells none.
            let still = start_of_turning(xml, 1).0.qvel;
            assert_eq!(still, vec![0.0; qvel + 3]);
        }
    }
}
