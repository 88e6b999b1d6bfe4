//! Initial state of a window, read off the log: positions from local parabolas, speeds from their
//! derivatives.

use asid_core::problem::home;
use asid_core::signal::{rotation_difference, unit_quaternion};
use asid_mjcf::plant::Reads;
use nalgebra::{UnitQuaternion, Vector3};

use super::placement::Window;
use super::{LOCAL, Windows};
use crate::wiring::record::Recorded;
use crate::wiring::view::{ColumnView, View};

impl Windows<'_> {
    /// Returns the initial state of a window under a view.
    pub(super) fn state(&self, view: &View, window: Window) -> (Vec<f64>, Vec<f64>) {
        let layout = &self.plant.layout;
        let record = &self.record[window.episode];
        if let (true, Some(start)) = (window.given, &record.start) {
            return (start.qpos.clone(), start.qvel.clone());
        }
        let (mut qpos, mut qvel) = home(layout);
        let half = LOCAL * self.duration;
        let local = |entry: usize| record.local(view.readings[entry], window.start, half);
        let turns = |first: usize| [0, 1, 2, 3].map(|i| view.readings[first + i]);
        let mut placed = vec![false; layout.nv];
        for &(index, first) in &self.sensors {
            match (self.plant.sensors[index], &*layout.sensors[index].kind) {
                (Reads::Joint(j), "jointpos") => {
                    if let Some((q, v)) = local(first) {
                        qpos[layout.joints[j].qpos] = q;
                        qvel[layout.joints[j].qvel] = v;
                        placed[layout.joints[j].qvel] = true;
                    }
                }
                (Reads::Joint(j), "ballquat") => {
                    if let Some(turned) = orientation(record, &turns(first), window.start, half) {
                        let joint = &layout.joints[j];
                        set(turned, (&mut qpos[joint.qpos..], &mut qvel[joint.qvel..]));
                        placed[joint.qvel] = true;
                    }
                }
                (Reads::Body(b), "framepos") => {
                    let Some(j) = self.plant.free_joint(b) else {
                        continue;
                    };
                    for i in 0..3 {
                        if let Some((q, v)) = local(first + i) {
                            qpos[layout.joints[j].qpos + i] = q;
                            qvel[layout.joints[j].qvel + i] = v;
                        }
                    }
                }
                (Reads::Body(b), "framequat") => {
                    let Some(j) = self.plant.free_joint(b) else {
                        continue;
                    };
                    if let Some(turned) = orientation(record, &turns(first), window.start, half) {
                        let (q, v) = (layout.joints[j].qpos + 3, layout.joints[j].qvel + 3);
                        set(turned, (&mut qpos[q..], &mut qvel[v..]));
                    }
                }
                _ => {}
            }
        }
        // Speeds that only a velocity sensor reads.
        for &(index, first) in &self.sensors {
            let sensor = &layout.sensors[index];
            if let (Reads::Joint(j), "jointvel" | "ballangvel") =
                (self.plant.sensors[index], &*sensor.kind)
                && !placed[layout.joints[j].qvel]
            {
                for i in 0..sensor.len {
                    if let Some((v, _)) = local(first + i) {
                        qvel[layout.joints[j].qvel + i] = v;
                    }
                }
            }
        }
        (qpos, qvel)
    }
}

/// Writes an orientation and the angular velocity about the body's own axes to where a joint has
/// them in `qpos` and `qvel`.
fn set((turn, own): (UnitQuaternion<f64>, Vector3<f64>), (qpos, qvel): (&mut [f64], &mut [f64])) {
    qpos[..4].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
    qvel[..3].copy_from_slice(own.as_slice());
}

/// Orientation at a time, and the angular velocity about the body's own axes, rad/s.
///
/// The velocity is taken from `half` a second before and after. `None` if a reading is missing.
fn orientation(
    record: &Recorded,
    views: &[ColumnView; 4],
    time: f64,
    half: f64,
) -> Option<(UnitQuaternion<f64>, Vector3<f64>)> {
    let at = |time: f64| views.map(|view| record.reading(view, time, half));
    let here = at(time);
    let (before, after) = (at((time - half).max(0.0)), at(time + half));
    let all = here.iter().chain(&before).chain(&after);
    if !all.copied().all(f64::is_finite) {
        return None;
    }
    let turn = unit_quaternion(&here);
    let span = time + half - (time - half).max(0.0);
    let way = Vector3::from(rotation_difference(&after, &before));
    Some((turn, turn.inverse() * way / span))
}
