//! States and their tangent space.
//!
//! A state is `qpos` then `qvel` (`nq + nv` numbers). A small change of it has `2 nv` coordinates:
//! those of the positions, then those of the speeds. Orientations are rotated about the body's own
//! axes, as their angular velocity is expressed.

use asid_core::layout::{JointKind, Layout};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Index of a joint's quaternion in `qpos` and of its angular velocity in `qvel`, if it has one.
pub(crate) fn rotation(joint: &asid_core::layout::Joint) -> Option<(usize, usize)> {
    match joint.kind {
        JointKind::Free => Some((joint.qpos + 3, joint.qvel + 3)),
        JointKind::Ball => Some((joint.qpos, joint.qvel)),
        JointKind::Hinge | JointKind::Slide => None,
    }
}

/// Indices in `qpos` and `qvel` of the position coordinates that are plain numbers.
fn scalars(layout: &Layout) -> impl Iterator<Item = (usize, usize)> {
    layout.joints.iter().flat_map(|j| {
        let n = match j.kind {
            JointKind::Free => 3,
            JointKind::Ball => 0,
            JointKind::Hinge | JointKind::Slide => 1,
        };
        (0..n).map(move |i| (j.qpos + i, j.qvel + i))
    })
}

fn quaternion(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

/// Moves a state (`nq + nv`) by a change (`2 nv`).
pub fn retract(layout: &Layout, state: &mut [f64], change: &[f64]) {
    let (nq, nv) = (layout.nq, layout.nv);
    for (p, d) in scalars(layout) {
        state[p] += change[d];
    }
    for (p, d) in layout.joints.iter().filter_map(rotation) {
        let turn = Vector3::new(change[d], change[d + 1], change[d + 2]);
        let new = quaternion(&state[p..p + 4]) * UnitQuaternion::from_scaled_axis(turn);
        state[p..p + 4].copy_from_slice(&[new.w, new.i, new.j, new.k]);
    }
    for (v, d) in state[nq..nq + nv].iter_mut().zip(&change[nv..]) {
        *v += d;
    }
}

/// Computes the change (`2 nv`) that moves state `b` to state `a`.
pub fn difference(layout: &Layout, a: &[f64], b: &[f64], out: &mut [f64]) {
    let (nq, nv) = (layout.nq, layout.nv);
    for (p, d) in scalars(layout) {
        out[d] = a[p] - b[p];
    }
    for (p, d) in layout.joints.iter().filter_map(rotation) {
        let turn = (quaternion(&b[p..p + 4]).inverse() * quaternion(&a[p..p + 4])).scaled_axis();
        out[d..d + 3].copy_from_slice(turn.as_slice());
    }
    for i in 0..nv {
        out[nv + i] = a[nq + i] - b[nq + i];
    }
}

/// Moves state `to` back until it is only `part` of the way from state `from`.
pub fn part_way(layout: &Layout, from: &[f64], to: &mut [f64], part: f64) {
    let mut change = vec![0.0; 2 * layout.nv];
    difference(layout, to, from, &mut change);
    change.iter_mut().for_each(|c| *c *= part);
    to.copy_from_slice(from);
    retract(layout, to, &change);
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::layout::Joint;

    fn layout() -> Layout {
        let joint = |name: &str, kind, qpos, qvel| Joint {
            name: name.into(),
            kind,
            body: name.into(),
            qpos,
            qvel,
        };
        Layout {
            timestep: 0.01,
            nq: 12,
            nv: 10,
            bodies: Vec::new(),
            geoms: Vec::new(),
            joints: vec![
                joint("slide", JointKind::Slide, 0, 0),
                joint("free", JointKind::Free, 1, 1),
                joint("ball", JointKind::Ball, 8, 7),
            ],
            actuators: Vec::new(),
            sensors: Vec::new(),
            keyframes: Vec::new(),
        }
    }

    #[test]
    fn a_state_moved_by_a_change_differs_by_that_change() {
        let layout = layout();
        let mut state: Vec<f64> = (0..22).map(|i| 0.1 * f64::from(i)).collect();
        for first in [4, 8] {
            let q = quaternion(&state[first..first + 4]);
            state[first..first + 4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
        }
        let change: Vec<f64> = (0..20).map(|i| 0.3 - 0.04 * f64::from(i)).collect();
        let mut moved = state.clone();
        retract(&layout, &mut moved, &change);
        let mut back = vec![0.0; 20];
        difference(&layout, &moved, &state, &mut back);
        for (a, b) in back.iter().zip(&change) {
            assert!((a - b).abs() < 1e-12, "{back:?}");
        }
    }

    #[test]
    fn a_part_of_the_way_is_that_part_of_the_change() {
        let layout = layout();
        let mut from = vec![0.0; 22];
        (from[4], from[8]) = (1.0, 1.0);
        let change: Vec<f64> = (0..20).map(|i| 0.3 - 0.04 * f64::from(i)).collect();
        let mut to = from.clone();
        retract(&layout, &mut to, &change);
        part_way(&layout, &from, &mut to, 0.25);
        let mut part = vec![0.0; 20];
        difference(&layout, &to, &from, &mut part);
        for (part, whole) in part.iter().zip(&change) {
            assert!((part - 0.25 * whole).abs() < 1e-12, "{part}");
        }
    }

    #[test]
    fn a_turn_about_the_bodys_own_axis_is_its_angular_speed_times_the_time() {
        // A body that lies on its side and spins about its own z turns about the world's x.
        let layout = layout();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let mut state = vec![0.0; 22];
        state[4..8].copy_from_slice(&[half, 0.0, half, 0.0]);
        state[8] = 1.0;
        let mut change = vec![0.0; 20];
        change[6] = 0.2;
        retract(&layout, &mut state, &change);
        let side = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let want = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.2) * side;
        let got = quaternion(&state[4..8]);
        assert!(got.angle_to(&want) < 1e-12);
    }
}
