//! Initial state of a window, read off the log: positions from local parabolas, speeds from their
//! derivatives.

use asid_core::problem::home;
use asid_core::signal::{rotation_difference, unit_quaternion};
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;
use nalgebra::{UnitQuaternion, Vector3};

use super::placement::Window;
use super::{LOCAL, Windows};
use crate::wiring::record::Recorded;
use crate::wiring::view::{ColumnView, View};

impl Windows<'_> {
    /// Returns the initial state of a window under a view.
    pub(super) fn state(&self, view: &View, window: Window) -> (Vec<f64>, Vec<f64>) {
        let record = &self.record[window.episode];
        if let (true, Some(start)) = (window.given, &record.start) {
            return (start.qpos.clone(), start.qvel.clone());
        }
        let half = LOCAL * self.duration;
        state_at(
            self.plant,
            &self.sensors,
            (record, view),
            (window.start, half),
        )
    }
}

/// Reads the state at a time off a log, from its readings within `half` a duration, s; what no
/// sensor reads is as the scene places it.
///
/// `sensors` are indices in the layout, each with its first entry in a row of readings.
fn state_at(
    plant: &Plant,
    sensors: &[(usize, usize)],
    (record, view): (&Recorded, &View),
    (time, half): (f64, f64),
) -> (Vec<f64>, Vec<f64>) {
    let layout = &plant.layout;
    let (mut qpos, mut qvel) = home(layout);
    let local = |entry: usize| record.local(view.readings[entry], time, half);
    let turns = |first: usize| [0, 1, 2, 3].map(|i| view.readings[first + i]);
    let mut placed = vec![false; layout.nv];
    for &(index, first) in sensors {
        match (plant.sensors[index], &*layout.sensors[index].kind) {
            (Reads::Joint(j), "jointpos") => {
                if let Some((q, v)) = local(first) {
                    qpos[layout.joints[j].qpos] = q;
                    qvel[layout.joints[j].qvel] = v;
                    placed[layout.joints[j].qvel] = true;
                }
            }
            (Reads::Joint(j), "ballquat") => {
                if let Some(turned) = orientation(record, &turns(first), time, half) {
                    let joint = &layout.joints[j];
                    set(turned, (&mut qpos[joint.qpos..], &mut qvel[joint.qvel..]));
                    placed[joint.qvel] = true;
                }
            }
            (Reads::Body(b), "framepos") => {
                let Some(j) = plant.free_joint(b) else {
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
                let Some(j) = plant.free_joint(b) else {
                    continue;
                };
                if let Some(turned) = orientation(record, &turns(first), time, half) {
                    let (q, v) = (layout.joints[j].qpos + 3, layout.joints[j].qvel + 3);
                    set(turned, (&mut qpos[q..], &mut qvel[v..]));
                }
            }
            _ => {}
        }
    }
    // Speeds that only a velocity sensor reads.
    for &(index, first) in sensors {
        let sensor = &layout.sensors[index];
        if let (Reads::Joint(j), "jointvel" | "ballangvel") = (plant.sensors[index], &*sensor.kind)
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

#[cfg(test)]
mod tests {
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};

    use super::*;

    /// Symptom: a machine with a ball joint was predicted from where the document places it, so
    /// that a swapped axis of its sensor was not seen. Cause: windows took positions and speeds of
    /// hinges, slides and free bodies alone.
    #[test]
    fn a_window_places_a_ball_joint_as_its_sensors_read_it() {
        let scene = r#"<mujoco><worldbody><body><joint name="pivot" type="ball"/>
            <geom size="0.05" pos="0 0 -0.3" mass="1"/></body></worldbody>
            <sensor><ballquat name="turn" joint="pivot"/><ballangvel name="spin" joint="pivot"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("pendulum", scene, &[]).unwrap()).unwrap();
        let spin = Vector3::new(0.3, -0.8, 2.0);
        let begin = UnitQuaternion::from_euler_angles(1.0, 0.2, -0.4);
        let turned = |t: f64| begin * UnitQuaternion::from_scaled_axis(t * spin);
        let row = |k: u32| {
            let q = turned(0.01 * f64::from(k));
            [q.w, q.i, q.j, q.k, spin.x, spin.y, spin.z]
        };
        let channel = |(name, len): (&str, usize)| ChannelColumns {
            name: name.into(),
            len,
        };
        let episode = Episode {
            time: (0..60).map(|k| 0.01 * f64::from(k)).collect(),
            channels: [("turn", 4), ("spin", 3)].map(channel).into(),
            readings: (0..60).flat_map(row).collect(),
            ..Episode::default()
        };
        let view = View {
            readings: (0..7).map(ColumnView::own).collect(),
            commands: Vec::new(),
        };
        let names = ["turn", "spin"].map(str::to_owned);
        let record = Recorded::of(&plant.layout, &names, &episode).unwrap();
        let at =
            |sensors: &[(usize, usize)]| state_at(&plant, sensors, (&record, &view), (0.3, 0.05));
        let (qpos, qvel) = at(&[(0, 0), (1, 4)]);
        // A reading between two rows is a point of their chord.
        let off = unit_quaternion(&qpos).angle_to(&turned(0.3));
        assert!(off < 1e-6, "{off}");
        assert!(
            (Vector3::from_column_slice(&qvel) - spin).norm() < 1e-2,
            "{qvel:?}"
        );
        // Without its orientation, the speed is the one that is read.
        let (qpos, qvel) = at(&[(1, 4)]);
        assert_eq!(qpos, home(&plant.layout).0);
        assert!(
            (Vector3::from_column_slice(&qvel) - spin).norm() < 1e-9,
            "{qvel:?}"
        );
    }
}
