//! Checks the limits along a trajectory and in its initial posture.

use asid_core::error::Result;
use asid_mjcf::plant::Drive;

use crate::columns;
use crate::limits::{DIVERGED, Excess};
use crate::play::{Played, Player, TOUCH};

impl Player<'_> {
    /// Checks the initial posture of motions, at parameter values.
    ///
    /// A joint that rests there at an end of its range (or a hair within or beyond it, as a stop
    /// yields) may stay. Returns the names of such joints, and the violations of other limits.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn look_at_begin(&mut self, point: &[f64]) -> Result<(Vec<String>, Excess)> {
        self.begin(&[point])?;
        let layout = &self.plant.layout;
        let (nq, nv) = (layout.nq, layout.nv);
        let mut row = vec![0.0; self.record.width()];
        self.simulator.read(&[0], &self.record, &mut row)?;
        let state = &row[self.readings..self.readings + nq + nv];
        let joints = self.limits.joints.iter_mut();
        let at_stop = joints
            .filter_map(|j| j.stay_at_stop(state[j.qpos]).then(|| j.name.clone()))
            .collect();
        let mut excess = Excess::default();
        let drives = self.drives_at(point);
        self.look_at_joints(&state[..nq], &state[nq..], 1, &mut excess);
        self.look_at_drives(
            &drives,
            &self.base,
            (&state[..nq], &state[nq..], 1),
            &mut excess,
        );
        self.look_at_boxes(&state[..nq], 1, &mut excess);
        Ok((at_stop, excess))
    }

    /// The drives at parameter values.
    pub(crate) fn drives_at(&self, point: &[f64]) -> Vec<Option<Drive>> {
        let values = columns(&self.parameters, point);
        let mut drives = self.plant.drives.clone();
        for d in &self.drives {
            let drive = &mut drives[d.actuator];
            let at = [d.nominal, values[d.column]];
            *drive = drive.map(|law| law.with(&d.attribute, d.index, at));
        }
        drives
    }

    /// Checks one trajectory against the limits: a row before the motion, and one after each frame.
    ///
    /// A drive's force is largest as its command begins, at the state before the frame. Within a
    /// frame of several physics steps the last one begins near the state after it.
    pub(crate) fn look(
        &self,
        (first, rows): (&[f64], &[f64]),
        (commands, drives): (&[f64], &[Option<Drive>]),
        (frames, substeps): (usize, usize),
    ) -> Played {
        let layout = &self.plant.layout;
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let width = self.record.width();
        let mut excess = Excess::default();
        let mut played = Played {
            readings: Vec::with_capacity(frames * self.readings),
            qpos: Vec::with_capacity(frames * nq),
            excess: Excess::default(),
        };
        if rows.iter().any(|x| !x.is_finite()) {
            excess.add(DIVERGED, 1, || "the simulation diverges".into());
            played.excess = excess;
            return played;
        }
        let state = |row: &'_ [f64]| -> (Vec<f64>, Vec<f64>) {
            let (q, v) = row[self.readings..self.readings + nq + nv].split_at(nq);
            (q.to_vec(), v.to_vec())
        };
        let mut before = state(first);
        for (k, row) in rows.chunks_exact(width).enumerate() {
            let (q, v) = &state(row);
            let contact = &row[self.readings + nq + nv..];
            self.look_at_joints(q, v, frames, &mut excess);
            let command = &commands[k * nu..(k + 1) * nu];
            let at_begin = (&before.0[..], &before.1[..], frames);
            self.look_at_drives(drives, command, at_begin, &mut excess);
            if substeps > 1 {
                self.look_at_drives(drives, command, (q, v, frames), &mut excess);
            }
            let pairs = self.limits.apart.iter().zip(&self.touching);
            for ((pair, touching), force) in pairs.zip(contact) {
                if !touching && force.abs() > TOUCH {
                    excess.add(1.0, frames, || {
                        let [a, b] = pair.map(|b| &layout.bodies[b]);
                        format!("`{a}` touches `{b}`")
                    });
                }
            }
            self.look_at_boxes(q, frames, &mut excess);
            played.readings.extend_from_slice(&row[..self.readings]);
            played.qpos.extend_from_slice(q);
            before = (q.clone(), v.clone());
        }
        if let (Some(rest), Some(last)) = (self.limits.rest, rows.chunks_exact(width).last()) {
            let v = &last[self.readings + nq..self.readings + nq + nv];
            let fastest = v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            excess.add(fastest / rest - 1.0, 1, || {
                format!("speed at the end {fastest:.3}, limit {rest}")
            });
        }
        played.excess = excess;
        played
    }

    fn look_at_joints(&self, q: &[f64], v: &[f64], frames: usize, excess: &mut Excess) {
        for joint in &self.limits.joints {
            if let Some([low, high]) = joint.position {
                let at = q[joint.qpos];
                let beyond = (low - at).max(at - high);
                excess.add(beyond / (high - low), frames, || {
                    format!(
                        "position of `{}` {at:.3}, {} beyond its limit of {low:.3} to {high:.3}",
                        joint.name,
                        measured(beyond)
                    )
                });
            }
            if let Some(limit) = joint.speed {
                let speed = v[joint.dof].abs();
                excess.add(speed / limit - 1.0, frames, || {
                    let speed = measured(speed);
                    format!("speed of `{}` {speed}, limit {limit}", joint.name)
                });
            }
        }
    }

    /// Checks the forces of the drives under a row of commands.
    fn look_at_drives(
        &self,
        drives: &[Option<Drive>],
        command: &[f64],
        (q, v, frames): (&[f64], &[f64], usize),
        excess: &mut Excess,
    ) {
        let layout = &self.plant.layout;
        for limit in &self.limits.drives {
            let Some(drive) = drives[limit.actuator] else {
                continue;
            };
            let joint = &layout.joints[drive.joint];
            let command = command[limit.actuator];
            let force = drive.force(command, q[joint.qpos], v[joint.qvel]).abs();
            excess.add(force / limit.force - 1.0, frames, || {
                format!(
                    "force of `{}` {}, limit {}",
                    layout.actuators[limit.actuator].name,
                    measured(force),
                    limit.force
                )
            });
        }
    }

    fn look_at_boxes(&self, q: &[f64], frames: usize, excess: &mut Excess) {
        if self.limits.boxes.is_empty() {
            return;
        }
        let mut jacobian = vec![0.0; 6 * self.plant.layout.nv];
        for limit in &self.limits.boxes {
            let pose = self
                .plant
                .point_jacobian(q, limit.body, [0.0; 3], &mut jacobian);
            let place = pose.translation.vector;
            let [low, high] = limit.corners;
            for k in 0..3 {
                let beyond = (low[k] - place[k]).max(place[k] - high[k]) / (high[k] - low[k]);
                excess.add(beyond, frames, || {
                    format!(
                        "`{}` at {:.3} m along {}, limit {} to {}",
                        limit.name,
                        place[k],
                        ["x", "y", "z"][k],
                        low[k],
                        high[k]
                    )
                });
            }
        }
    }
}

/// A distance, speed or force in SI units, with its significant digits.
fn measured(x: f64) -> String {
    if x < 0.01 {
        format!("{x:.1e}")
    } else {
        format!("{x:.3}")
    }
}
