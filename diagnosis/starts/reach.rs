//! How far a start may lie from where it is first put, coordinate by coordinate.
//!
//! A coordinate that the readings hardly show, such as the spin of a ball about the normal of the floor it touches, has a slope that is next to
//! nothing, and a step of least squares along it is next to endless: ten thousand rad/s, after which the replay has nothing to do with the log.
//! So each coordinate steps against a normal prior whose deviation is twice the largest value that it takes while the model replays the logs, about
//! whichever axis of its joint.

use asid_core::layout::JointKind;
use asid_core::{Layout, Parameter, Result};
use asid_mjcf::Plant;

use crate::data::Logs;
use crate::latent_force::initial::scales;
use crate::machine::Machine;
use crate::predict::Point;
use crate::trajectory::{Path, Trajectory};

/// Deviation of a start, relative to the largest value of its coordinate.
const OPEN: f64 = 2.0;

/// Deviations of the `open` coordinates (`nv` positions, then `nv` velocities) of starts, m or rad or per second, by what a machine does
/// from a point on.
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
    let largest = largest(plant, &shown.episodes);
    Ok(open.iter().map(|&c| OPEN * largest[c]).collect())
}

/// Largest magnitude of each coordinate along some paths, of all axes of its joint that turn, or that shift.
fn largest(plant: &Plant, paths: &[Path]) -> Vec<f64> {
    let Layout { nq, nv, joints, .. } = &plant.layout;
    let states = |path: &Path| -> Vec<f64> {
        let rows = path.qpos.chunks_exact(*nq).zip(path.qvel.chunks_exact(*nv));
        let rows = rows.map(|(q, v)| [q, v].concat());
        // A replay that diverged says nothing from there on.
        let finite = rows.take_while(|row| row.iter().all(|x| x.is_finite()));
        finite.flatten().collect()
    };
    let mut states: Vec<Vec<f64>> = paths.iter().map(states).collect();
    states.retain(|s| !s.is_empty());
    let mut largest = scales(plant, &states);
    for joint in joints {
        let alike: &[(usize, usize)] = match joint.kind {
            JointKind::Hinge | JointKind::Slide => &[(0, 1)],
            JointKind::Ball => &[(0, 3)],
            JointKind::Free => &[(0, 3), (3, 6)],
        };
        for first in [joint.qvel, nv + joint.qvel] {
            for (a, b) in alike {
                let axes = &mut largest[first + a..first + b];
                let most = axes.iter().copied().fold(0.0, f64::max);
                axes.fill(most);
            }
        }
    }
    largest
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use asid_core::Scene;

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
        let largest = largest(&plant, &[path]);
        assert_eq!(largest[..3], [0.3; 3]);
        assert!(largest[3..6].iter().all(|x| *x < 1e-5), "it never turned");
        assert_eq!(largest[6..], [1.0, 1.0, 1.0, 5.0, 5.0, 5.0]);
    }
}
