//! Names and indices in arrays: the layout, keyframes, quaternions, free joints, rows.

use asid_core::{Backend, Capabilities, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::faults::ANY;
use crate::rig::{Rig, STEP, largest, last, relative};

const FREE: Capabilities = Capabilities::FREE_BODIES;
const TREE: Capabilities = Capabilities::ARTICULATION;
const EXACT: Tolerance = Tolerance::by_precision(1e-12, 2e-6);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "arrays/layout",
        needs: ANY,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "names and places follow from the document alone: wrong of nine",
        measure: Figure(crate::layout::layout),
    },
    Check {
        name: "arrays/reset-is-the-first-keyframe",
        needs: ANY,
        unit: "",
        tolerance: EXACT,
        reason: "positions and velocities of the first <key>, its quaternions at length one: rounding",
        measure: Figure(crate::layout::keyframe),
    },
    Check {
        name: "arrays/quaternion-order",
        needs: FREE,
        unit: "",
        tolerance: EXACT,
        reason: "w x y z: a quarter turn about z carries x to y: rounding",
        measure: Figure(quaternion_order),
    },
    Check {
        name: "arrays/quaternions-are-normalised",
        needs: FREE,
        unit: "",
        tolerance: EXACT,
        reason: "set_state takes a quaternion of any length: rounding",
        measure: Figure(normalised),
    },
    Check {
        name: "arrays/free-joint-linear-velocity",
        needs: FREE,
        unit: "m",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "linear velocity is in the world frame and uniform: rounding of 50 steps",
        measure: Figure(free_linear),
    },
    Check {
        name: "arrays/free-joint-angular-velocity",
        needs: FREE,
        unit: "rad",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "angular velocity is in the body frame and uniform about a principal axis: rounding of 250 steps",
        measure: Figure(free_angular),
    },
    Check {
        name: "arrays/readings-are-of-the-end-of-a-frame",
        needs: ANY,
        unit: "m",
        tolerance: EXACT,
        reason: "a sensor and qpos of one row are of one state; a step before it is 4 mm away: rounding",
        measure: Figure(readings_are_fresh),
    },
    Check {
        name: "arrays/substeps",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "a frame lasts its substeps: uniform motion, rounding",
        measure: Figure(substeps),
    },
];

/// A free body without gravity.
///
/// A site lies one metre along its x axis, its centre of mass 0.2 m along its z axis.
pub fn floating(backend: &dyn Backend, qpos: [f64; 7], qvel: [f64; 6]) -> Result<Rig> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
      <inertial pos="0 0 0.2" mass="1" diaginertia="0.1 0.2 0.3"/><site name="s" pos="1 0 0"/></body></worldbody>
      <sensor><framepos name="s" objtype="site" objname="s"/><framepos name="com" objtype="body" objname="b"/>
        <framepos name="origin" objtype="xbody" objname="b"/></sensor>"#;
    let mut rig = Rig::new(backend, inside, &["s", "com", "origin", "qpos.b", "qvel.b"])?;
    rig.place(&qpos, &qvel)?;
    Ok(rig)
}

fn quaternion_order(backend: &dyn Backend) -> Result<f64> {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let qpos = [1.0, 2.0, 3.0, half, 0.0, 0.0, half];
    let read = floating(backend, qpos, [0.0; 6])?.read()?.swap_remove(0);
    let site = (0..3).map(|i| read[i] - [1.0, 3.0, 3.0][i]);
    let back = (0..7).map(|i| read[9 + i] - qpos[i]);
    Ok(largest(site.chain(back)))
}

fn normalised(backend: &dyn Backend) -> Result<f64> {
    let qpos = [0.0, 0.0, 0.0, 3.0, 0.0, 4.0, 0.0];
    let read = floating(backend, qpos, [0.0; 6])?.read()?.swap_remove(0);
    Ok(largest(
        (0..4).map(|i| read[12 + i] - [0.6, 0.0, 0.8, 0.0][i]),
    ))
}

fn free_linear(backend: &dyn Backend) -> Result<f64> {
    let qpos = [0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0];
    let mut rig = floating(backend, qpos, [1.0, 2.0, 3.0, 0.0, 0.0, 0.0])?;
    let rows = rig.run(50, &[])?;
    let end = last(&rows)?;
    Ok(largest(
        (0..3).map(|i| end[9 + i] - 0.1 * [1.0, 2.0, 3.0][i]),
    ))
}

fn free_angular(backend: &dyn Backend) -> Result<f64> {
    // The body lies on its side and rotates about its own z axis, which keeps its direction.
    let start = UnitQuaternion::from_quaternion(Quaternion::new(0.6, 0.8, 0.0, 0.0));
    let qpos = [0.0, 0.0, 0.0, start.w, start.i, start.j, start.k];
    let mut rig = floating(backend, qpos, [0.0, 0.0, 0.0, 0.0, 0.0, 3.0])?;
    let rows = rig.run(250, &[])?;
    let end = last(&rows)?;
    let found =
        UnitQuaternion::from_quaternion(Quaternion::new(end[12], end[13], end[14], end[15]));
    let theory = start * UnitQuaternion::from_scaled_axis(Vector3::z() * 1.5);
    Ok(theory.angle_to(&found))
}

fn readings_are_fresh(backend: &dyn Backend) -> Result<f64> {
    let free = backend.capabilities().contains(FREE);
    let joint = if free {
        r#"<freejoint name="j"/>"#
    } else {
        r#"<joint name="j" type="slide" axis="1 0 0"/>"#
    };
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody><body name="b">{joint}
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.2 0.3"/><site name="s"/></body></worldbody>
        <sensor><framepos name="p" objtype="site" objname="s"/></sensor>"#
    );
    let mut rig = Rig::new(backend, &inside, &["p", "qpos.j"])?;
    let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
    let (mut qpos, mut qvel) = (vec![0.0; nq], vec![0.0; nv]);
    qvel[0] = 2.0;
    if free {
        qpos[3] = 1.0;
    }
    rig.place(&qpos, &qvel)?;
    let rows = rig.run(5, &[])?;
    Ok(largest(rows.iter().enumerate().flat_map(|(i, row)| {
        let travelled = 2.0 * STEP * (i + 1) as f64;
        [row[0] - row[3], row[0] - travelled, row[3] - travelled]
    })))
}

fn substeps(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.j"])?;
    rig.place(&[0.0], &[2.0])?;
    let rows = rig.run_with(10, 7, &[], |_| {})?;
    Ok(largest(rows.iter().enumerate().map(|(i, row)| {
        relative(row[0], 2.0 * STEP * 7.0 * (i + 1) as f64)
    })))
}
