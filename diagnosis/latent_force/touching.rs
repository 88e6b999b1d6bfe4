//! In which rows bodies touch in a way that the motion depends on.
//!
//! Many models have bodies that touch all the time and never move relative to each other. Examples
//! are an object that lies on a table beside the arm, and a base on its stand. Such a contact only
//! holds what is at rest anyway. Its rows need no segments.

use asid_core::layout::JointKind;
use asid_mjcf::Plant;

use crate::data::Logs;
use crate::trajectory::Trajectory;

use super::initial::position_noise;
use super::tangent::difference;

/// A joint counts as at rest up to this standard deviation, in standard deviations of its reading.
///
/// Noise alone makes 1, and an estimated noise may be half of the actual one.
const AT_REST: f64 = 3.0;

/// For each walk, one flag a row: whether two bodies touch that move relative to each other in some
/// log.
#[must_use]
pub fn touching(plant: &Plant, logs: &Logs, shown: &Trajectory) -> Vec<Vec<bool>> {
    let episodes: Vec<&[f64]> = shown.episodes.iter().map(|e| &e.qpos[..]).collect();
    let rests = joints_at_rest(plant, &position_noise(plant, logs), &episodes);
    let matters: Vec<bool> = shown
        .pairs
        .iter()
        .map(|pair| !between(plant, *pair).all(|joint| rests[joint]))
        .collect();
    let pairs = shown.pairs.len();
    let of_path = |contact: &[f64], rows: usize| -> Vec<bool> {
        let row = |k: usize| contact[k * pairs..(k + 1) * pairs].iter().zip(&matters);
        (0..rows)
            .map(|k| row(k).any(|(force, matters)| *matters && *force > 0.0))
            .collect()
    };
    let nq = plant.layout.nq;
    let paths = shown.episodes.iter();
    paths
        .map(|path| of_path(&path.contact, path.qpos.len() / nq))
        .collect()
}

/// Pairs of bodies that touch anywhere along a trajectory.
#[must_use]
pub fn pairs_touching(shown: &Trajectory) -> Vec<[usize; 2]> {
    let n = shown.pairs.len();
    let touch = |&(i, _): &(usize, &[usize; 2])| {
        let mut paths = shown.episodes.iter();
        paths.any(|p| {
            p.contact
                .iter()
                .skip(i)
                .step_by(n)
                .any(|force| *force > 0.0)
        })
    };
    let pairs = shown.pairs.iter().enumerate();
    pairs.filter(touch).map(|(_, pair)| *pair).collect()
}

/// Whether each joint is at rest along some positions (`rows x nq` an episode).
///
/// `noise` is the standard deviation of the readings, one a degree of freedom, 0 if no sensor reads
/// it. A joint that no sensor reads may move.
fn joints_at_rest(plant: &Plant, noise: &[f64], episodes: &[&[f64]]) -> Vec<bool> {
    let layout = &plant.layout;
    let (nq, nv) = (layout.nq, layout.nv);
    let still = vec![0.0; nv];
    let rows: Vec<&[f64]> = episodes.iter().flat_map(|e| e.chunks_exact(nq)).collect();
    let changes: Vec<Vec<f64>> = rows
        .iter()
        .map(|qpos| {
            let [now, first] = [qpos, &rows[0]].map(|q| [q, &still[..]].concat());
            let mut change = vec![0.0; 2 * nv];
            difference(layout, &now, &first, &mut change);
            change
        })
        .collect();
    let n = rows.len().max(1) as f64;
    let rests = |d: usize| {
        let mean = changes.iter().map(|c| c[d]).sum::<f64>() / n;
        let variance = changes.iter().map(|c| (c[d] - mean).powi(2)).sum::<f64>() / n;
        noise[d] > 0.0 && variance <= (AT_REST * noise[d]).powi(2)
    };
    let dofs = |kind| match kind {
        JointKind::Free => 6,
        JointKind::Ball => 3,
        JointKind::Hinge | JointKind::Slide => 1,
    };
    let joints = layout.joints.iter();
    joints
        .map(|j| (j.qvel..j.qvel + dofs(j.kind)).all(rests))
        .collect()
}

/// The joints between two bodies.
fn between(plant: &Plant, [a, b]: [usize; 2]) -> impl Iterator<Item = usize> {
    let chain = |mut body: usize| {
        let mut bodies = vec![body];
        while body != 0 {
            body = plant.bodies[body].parent;
            bodies.push(body);
        }
        bodies
    };
    let (of_a, of_b) = (chain(a), chain(b));
    let one_sided = |own: &[usize], other: &[usize]| -> Vec<usize> {
        let own = own.iter().filter(|body| !other.contains(body));
        own.flat_map(|&body| plant.bodies[body].joints.clone())
            .collect()
    };
    let mut joints = one_sided(&of_a, &of_b);
    joints.extend(one_sided(&of_b, &of_a));
    joints.into_iter()
}

#[cfg(test)]
mod tests {
    use asid_core::Scene;

    use super::*;

    #[test]
    fn the_way_between_two_bodies_leads_over_the_joints_of_both_sides() {
        let scene = r#"<mujoco><worldbody>
            <body name="arm"><joint name="shoulder" type="hinge"/><geom name="a" size="0.1" mass="1"/>
              <body name="hand"><joint name="wrist" type="hinge"/><geom name="h" size="0.1" mass="1"/></body>
              <body name="tool"><joint name="slide" type="slide"/><geom name="t" size="0.1" mass="1"/></body></body>
            <body name="box"><freejoint name="box"/><geom name="b" size="0.1" mass="1"/></body>
          </worldbody></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("scene", scene, &[]).unwrap()).unwrap();
        let joint = |name: &str| {
            let joints = &plant.layout.joints;
            joints.iter().position(|j| j.name == name).unwrap()
        };
        let body = |name: &str| {
            let bodies = &plant.layout.bodies;
            bodies.iter().position(|b| b == name).unwrap()
        };
        let way = |a, b| {
            let mut way: Vec<usize> = between(&plant, [body(a), body(b)]).collect();
            way.sort_unstable();
            way
        };
        let sorted = |names: &[&str]| {
            let mut all: Vec<usize> = names.iter().map(|n| joint(n)).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(way("hand", "tool"), sorted(&["wrist", "slide"]));
        assert_eq!(way("hand", "box"), sorted(&["shoulder", "wrist", "box"]));
        assert_eq!(way("arm", "hand"), sorted(&["wrist"]));
    }

    #[test]
    fn a_joint_rests_whose_readings_scatter_by_no_more_than_their_noise() {
        let scene = r#"<mujoco><worldbody>
            <body><joint name="still" type="slide"/><geom size="0.1" mass="1"/></body>
            <body><joint name="moved" type="slide"/><geom size="0.1" mass="1"/></body>
            <body><joint name="unseen" type="slide"/><geom size="0.1" mass="1"/></body>
          </worldbody></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("scene", scene, &[]).unwrap()).unwrap();
        let rows: Vec<f64> = (0..50)
            .flat_map(|k| {
                let noise = if k % 2 == 0 { 0.001 } else { -0.001 };
                [2.0 + noise, 0.001 * f64::from(k), 0.0]
            })
            .collect();
        let found = joints_at_rest(&plant, &[0.001, 0.001, 0.0], &[&rows]);
        assert_eq!(found, [true, false, false]);
    }
}
