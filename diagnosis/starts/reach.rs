//! How far each coordinate of an initial state may lie from its first guess.
//!
//! The readings hardly show some coordinates, such as the spin of a ball about the normal of the
//! floor that it touches. The derivative by such a coordinate is nearly zero, and a least-squares
//! step along it nearly infinite: ten thousand rad/s, after which the replay has nothing to do with
//! the log. So each coordinate has a normal prior. Its standard deviation is twice the largest
//! value of the coordinate, about any axis of its joint, while the model replays the logs.

use std::ops::Range;

use asid_core::layout::{Joint, JointKind};
use asid_core::signal::rotation_difference;
use asid_core::{Layout, Parameter, Result};

use crate::data::Logs;
use crate::machine::Machine;
use crate::predict::Point;
use crate::trajectory::{Path, Trajectory};

/// Standard deviation of an initial state's coordinate, relative to its largest value.
const OPEN: f64 = 2.0;

/// Returns the standard deviations of the `open` coordinates (`nv` positions, then `nv` velocities)
/// of initial states, m or rad or per second.
///
/// They follow from what a machine does from a point on.
///
/// # Errors
/// When the engine fails.
pub(crate) fn reach(
    machine: &Machine,
    parameters: &[Parameter],
    (logs, point): (&Logs, &Point),
    open: &[usize],
) -> Result<Vec<f64>> {
    if open.is_empty() {
        return Ok(Vec::new());
    }
    let plant = &machine.plant;
    let model = machine.with(&[])?;
    let shown = Trajectory::of(&*model, plant, parameters, logs, point, machine.threads)?;
    let largest = largest(&plant.layout, &shown.episodes);
    Ok(open.iter().map(|&c| OPEN * largest[c]).collect())
}

/// Least value of `largest` for a coordinate, m or rad or per second.
const LEAST: f64 = 1e-6;

/// Returns the largest magnitude of each coordinate along some paths; that of a position is its
/// distance from the first row's.
///
/// All rotational axes of a joint share one value, and so do all translational axes.
fn largest(layout: &Layout, paths: &[Path]) -> Vec<f64> {
    let nv = layout.nv;
    let mut largest = vec![LEAST; 2 * nv];
    for path in paths {
        let rows = path.qpos.chunks_exact(layout.nq);
        let rows = rows.zip(path.qvel.chunks_exact(nv));
        // A replay that diverged carries no information from there on.
        let finite = rows.take_while(|(q, v)| q.iter().chain(*v).all(|x| x.is_finite()));
        for (q, v) in finite {
            for joint in &layout.joints {
                for (dofs, moved) in shifts_and_turns(joint, &path.qpos, q) {
                    let speeds = v[dofs.clone()].iter().map(|x| x.abs());
                    let speed = speeds.fold(0.0, f64::max);
                    for d in dofs {
                        largest[d] = largest[d].max(moved);
                        largest[nv + d] = largest[nv + d].max(speed);
                    }
                }
            }
        }
    }
    largest
}

/// Returns the translational and the rotational degrees of freedom of a joint, each with the
/// largest move of one axis between two configurations, m or rad.
fn shifts_and_turns(joint: &Joint, from: &[f64], to: &[f64]) -> Vec<(Range<usize>, f64)> {
    let (place, dof) = (joint.qpos, joint.qvel);
    let shift = |axes: usize| {
        let axes = place..place + axes;
        let moves = axes.map(|i| (to[i] - from[i]).abs());
        moves.fold(0.0, f64::max)
    };
    let turn = |first: usize| {
        let moves = rotation_difference(&to[first..first + 4], &from[first..first + 4]);
        moves.iter().fold(0.0_f64, |most, x| most.max(x.abs()))
    };
    match joint.kind {
        JointKind::Hinge | JointKind::Slide => vec![(dof..dof + 1, shift(1))],
        JointKind::Ball => vec![(dof..dof + 3, turn(place))],
        JointKind::Free => vec![
            (dof..dof + 3, shift(3)),
            (dof + 3..dof + 6, turn(place + 3)),
        ],
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use asid_core::Scene;
    use asid_mjcf::Plant;

    use super::*;

    const BALL: &str = r#"<mujoco><worldbody><body name="b"><freejoint name="b"/><geom size="0.1" mass="1"/></body></worldbody>
      <sensor><framepos name="p" objtype="xbody" objname="b"/></sensor></mujoco>"#;

    #[test]
    fn a_body_that_turns_about_one_axis_may_turn_as_fast_about_any() {
        let plant = Plant::of(&Scene::from_xml("ball", BALL, &[]).unwrap()).unwrap();
        let qpos =
            [[0.0, 0.0, 0.0], [0.3, 0.0, -0.1]].map(|p| [&p[..], &[1.0, 0.0, 0.0, 0.0]].concat());
        let path = Path {
            qpos: [qpos.concat(), vec![f64::NAN; 7]].concat(),
            qvel: [[1.0, 0.0, 0.0, 0.0, 5.0, 0.0].repeat(2), vec![f64::NAN; 6]].concat(),
            ctrl: Vec::new(),
            contact: Vec::new(),
        };
        let largest = largest(&plant.layout, &[path]);
        assert_eq!(largest[..3], [0.3; 3]);
        assert!(largest[3..6].iter().all(|x| *x < 1e-5), "it never turned");
        assert_eq!(largest[6..], [1.0, 1.0, 1.0, 5.0, 5.0, 5.0]);
    }
}
