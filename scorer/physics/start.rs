//! The initial state of an episode, from its log or its first readings, and the coordinates that
//! neither gives.

use asid_core::layout::JointKind;
use asid_core::problem::home;
use asid_core::signal::{rotation_difference, unit_quaternion};
use asid_core::{Episode, Layout};
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;
use nalgebra::{UnitQuaternion, Vector3};

/// Rows over which an initial velocity is computed.
const FIRST_ROWS: usize = 6;

/// Positions and velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Positions, `nq` values.
    pub qpos: Vec<f64>,
    /// Velocities, `nv` values.
    pub qvel: Vec<f64>,
}

impl State {
    /// Shifts the state along one coordinate: first the `nv` positions, then the `nv` velocities.
    ///
    /// Orientations rotate about the body's own axes.
    pub fn shift(&mut self, layout: &Layout, coordinate: usize, by: f64) {
        if coordinate >= layout.nv {
            self.qvel[coordinate - layout.nv] += by;
            return;
        }
        let own = |j: &&asid_core::layout::Joint| {
            (j.qvel..j.qvel + j.kind.qvel_len()).contains(&coordinate)
        };
        let Some(joint) = layout.joints.iter().find(own) else {
            return;
        };
        let local = coordinate - joint.qvel;
        let turns_from = match joint.kind {
            JointKind::Ball => Some(0),
            JointKind::Free => Some(3),
            JointKind::Hinge | JointKind::Slide => None,
        };
        match turns_from {
            Some(first) if local >= first => {
                let q = &mut self.qpos[joint.qpos + first..joint.qpos + first + 4];
                let axis = Vector3::ith(local - first, by);
                let turned = unit_quaternion(q) * UnitQuaternion::from_scaled_axis(axis);
                q.copy_from_slice(&[turned.w, turned.i, turned.j, turned.k]);
            }
            _ => self.qpos[joint.qpos + local] += by,
        }
    }
}

/// First complete reading of a sensor, one a few rows later, and the time between them.
fn first_readings(episode: &Episode, sensor: &str) -> Option<([Vec<f64>; 2], f64)> {
    let range = episode.channel(sensor)?;
    let reading = |k: usize| &episode.reading(k)[range.clone()];
    let whole = |k: &usize| reading(*k).iter().all(|x| x.is_finite());
    let mut rows = (0..episode.rows()).filter(whole);
    let first = rows.next()?;
    let later = rows.take(FIRST_ROWS).last().unwrap_or(first);
    let span = episode.time[later] - episode.time[first];
    Some(([reading(first).to_vec(), reading(later).to_vec()], span))
}

/// Initial state of an episode: the scene's own, overwritten by what sensors show, then by what the
/// log gives.
#[must_use]
pub fn first_state(plant: &Plant, episode: &Episode) -> State {
    let layout = &plant.layout;
    let (qpos, qvel) = home(layout);
    let mut state = State { qpos, qvel };
    // Measured velocities come last; they overwrite differences of positions.
    let mut sensors: Vec<usize> = (0..layout.sensors.len()).collect();
    sensors.sort_by_key(|&i| layout.sensors[i].kind == "jointvel");
    for i in sensors {
        let sensor = &layout.sensors[i];
        let Some(([first, later], span)) = first_readings(episode, &sensor.name) else {
            continue;
        };
        let rate = |a: f64, b: f64| if span > 0.0 { (b - a) / span } else { 0.0 };
        match (plant.sensors[i], &*sensor.kind) {
            (Reads::Joint(j), "jointpos") => {
                state.qpos[layout.joints[j].qpos] = first[0];
                state.qvel[layout.joints[j].qvel] = rate(first[0], later[0]);
            }
            (Reads::Joint(j), "jointvel") => state.qvel[layout.joints[j].qvel] = first[0],
            (Reads::Body(b), kind) => {
                let Some(joint) = plant.free_joint(b).map(|j| &layout.joints[j]) else {
                    continue;
                };
                if kind == "framepos" {
                    for k in 0..3 {
                        state.qpos[joint.qpos + k] = first[k];
                        state.qvel[joint.qvel + k] = rate(first[k], later[k]);
                    }
                } else if kind == "framequat" {
                    state.qpos[joint.qpos + 3..joint.qpos + 7].copy_from_slice(&first);
                    let turn = Vector3::from(rotation_difference(&later, &first));
                    let own = unit_quaternion(&first).inverse() * turn;
                    for k in 0..3 {
                        state.qvel[joint.qvel + 3 + k] = rate(0.0, own[k]);
                    }
                }
            }
            _ => {}
        }
    }
    if let Some(given) = &episode.initial {
        let take = |own: &mut Vec<f64>, given: &[f64]| {
            let both = own.iter_mut().zip(given);
            both.filter(|(_, g)| g.is_finite())
                .for_each(|(x, g)| *x = *g);
        };
        take(&mut state.qpos, &given.qpos);
        take(&mut state.qvel, &given.qvel);
    }
    state
}

/// Coordinates of the initial states (`nv` positions, then `nv` velocities) that some log does not
/// give.
#[must_use]
pub fn open_coordinates<'a>(
    layout: &Layout,
    episodes: impl IntoIterator<Item = &'a Episode>,
) -> Vec<usize> {
    let nv = layout.nv;
    let mut open = vec![false; 2 * nv];
    for episode in episodes {
        let Some(given) = &episode.initial else {
            return (0..2 * nv).collect();
        };
        for joint in &layout.joints {
            let places = &given.qpos[joint.qpos..joint.qpos + joint.kind.qpos_len()];
            let scalar = places.len() == joint.kind.qvel_len();
            for local in 0..joint.kind.qvel_len() {
                // A missing position leaves its coordinate open; a missing quaternion component
                // leaves all three rotations open.
                let missing = match (scalar, joint.kind) {
                    (true, _) => !places[local].is_finite(),
                    (false, JointKind::Free) if local < 3 => !places[local].is_finite(),
                    (false, JointKind::Free) => places[3..].iter().any(|x| !x.is_finite()),
                    (false, _) => places.iter().any(|x| !x.is_finite()),
                };
                let dof = joint.qvel + local;
                open[dof] |= missing;
                open[nv + dof] |= !given.qvel[dof].is_finite();
            }
        }
    }
    (0..2 * nv).filter(|&c| open[c]).collect()
}
