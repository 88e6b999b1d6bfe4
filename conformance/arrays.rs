//! Names and places in arrays: the layout, keyframes, quaternions, free joints, rows.

use asid_core::layout::JointKind;
use asid_core::{Backend, Capabilities, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::check::{Check, Tolerance};
use crate::rig::{Rig, STEP, broken, largest, last, relative};

const FREE: Capabilities = Capabilities::CONTACT;
const TREE: Capabilities = Capabilities::ARTICULATION;
const BOTH: Capabilities = FREE.union(TREE);
const EXACT: Tolerance = Tolerance::by_precision(1e-12, 2e-6);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "arrays/layout",
        needs: BOTH.union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "names and places follow from the document alone: wrong of nine",
        measure: layout,
    },
    Check {
        name: "arrays/reset-is-the-first-keyframe",
        needs: BOTH.union(Capabilities::ACTUATORS),
        unit: "",
        tolerance: EXACT,
        reason: "positions and velocities of the first <key>: rounding",
        measure: keyframe,
    },
    Check {
        name: "arrays/quaternion-order",
        needs: FREE,
        unit: "",
        tolerance: EXACT,
        reason: "w x y z: a quarter turn about z carries x to y: rounding",
        measure: quaternion_order,
    },
    Check {
        name: "arrays/quaternions-are-normalised",
        needs: FREE,
        unit: "",
        tolerance: EXACT,
        reason: "set_state takes a quaternion of any length: rounding",
        measure: normalised,
    },
    Check {
        name: "arrays/free-joint-linear-velocity",
        needs: FREE,
        unit: "m",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "linear velocity is in the world frame and uniform: rounding of 50 steps",
        measure: free_linear,
    },
    Check {
        name: "arrays/free-joint-angular-velocity",
        needs: FREE,
        unit: "rad",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "angular velocity is in the body frame and uniform about a principal axis: rounding of 250 steps",
        measure: free_angular,
    },
    Check {
        name: "arrays/readings-are-of-the-end-of-a-frame",
        needs: FREE,
        unit: "m",
        tolerance: EXACT,
        reason: "a sensor and qpos of one row are of one state; a step before it is 4 mm away: rounding",
        measure: readings_are_fresh,
    },
    Check {
        name: "arrays/substeps",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "a frame lasts its substeps: uniform motion, rounding",
        measure: substeps,
    },
];

const SCENE: &str = r#"
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="arm" pos="0 0 3"><joint name="swing" axis="0 1 0"/>
      <geom type="sphere" size=".05" mass="1"/>
      <body name="hand" pos=".3 0 0"><joint name="reach" type="slide" axis="1 0 0"/>
        <geom name="finger" type="sphere" size=".05" mass="1"/></body>
      <body pos="0 .3 0"><joint name="wrist" type="ball"/><geom type="sphere" size=".05" mass="1"/></body>
    </body>
    <body name="box" pos="2 0 1"><freejoint name="box"/><geom type="box" size=".1 .1 .1" mass="1"/></body>
  </worldbody>
  <actuator><motor name="push" joint="reach" ctrlrange="-2 3"/><motor name="turn" joint="swing"/></actuator>
  <sensor><jointpos name="angle" joint="swing"/><framepos name="place" objtype="body" objname="box"/>
    <framequat name="attitude" objtype="body" objname="box"/><jointvel name="speed" joint="reach"/></sensor>
  <keyframe><key name="up" qpos="0.5 0.1 0.6 0.8 0 0 2 0 1 0 1 0 0" qvel="1 2 3 4 5 6 7 8 9 10 11"/></keyframe>"#;

fn layout(backend: &dyn Backend) -> Result<f64> {
    let rig = Rig::new(backend, SCENE, &[])?;
    let layout = rig.simulator.layout();
    let joints = [
        ("swing", JointKind::Hinge, 0, 0),
        ("reach", JointKind::Slide, 1, 1),
        ("wrist", JointKind::Ball, 2, 2),
        ("box", JointKind::Free, 6, 5),
    ];
    let sensors = [
        ("angle", "jointpos", 0, 1),
        ("place", "framepos", 1, 3),
        ("attitude", "framequat", 4, 4),
        ("speed", "jointvel", 8, 1),
    ];
    Ok(broken([
        layout.timestep == STEP,
        layout.nq == 13 && layout.nv == 11 && layout.nu() == 2,
        layout.bodies.len() == 5
            && [0, 1, 2, 4].map(|i| layout.bodies[i].as_str()) == ["world", "arm", "hand", "box"],
        layout.geoms.len() == 5
            && [0, 2].map(|i| layout.geoms[i].as_str()) == ["floor", "finger"]
            && layout.geoms[1] == "geom1",
        layout.joints.len() == joints.len()
            && (layout.joints.iter().zip(joints)).all(|(j, (name, kind, qpos, qvel))| {
                j.name == name && j.kind == kind && j.qpos == qpos && j.qvel == qvel
            }),
        layout
            .joints
            .iter()
            .any(|j| j.name == "reach" && j.body == "hand"),
        layout.actuators.len() == 2
            && layout.actuators[0].name == "push"
            && layout.actuators[0].ctrl_range == Some([-2.0, 3.0])
            && layout.actuators[1].name == "turn"
            && layout.actuators[1].ctrl_range.is_none(),
        layout.sensors.len() == sensors.len()
            && (layout.sensors.iter().zip(sensors)).all(|(s, (name, kind, address, len))| {
                s.name == name && s.kind == kind && s.address == address && s.len == len
            }),
        layout.keyframes.len() == 1 && layout.keyframes[0].name == "up",
    ]))
}

fn keyframe(backend: &dyn Backend) -> Result<f64> {
    let channels = [
        "qpos.swing",
        "qpos.reach",
        "qpos.wrist",
        "qpos.box",
        "qvel.swing",
        "qvel.reach",
        "qvel.wrist",
        "qvel.box",
    ];
    let mut rig = Rig::new(backend, SCENE, &channels)?;
    let key = [
        0.5, 0.1, 0.6, 0.8, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0,
        6.0, 7.0, 8.0, 9.0, 10.0, 11.0,
    ];
    let found = rig.read()?;
    Ok(largest(
        found[0]
            .iter()
            .zip(key)
            .map(|(a, b)| (a - b) / b.abs().max(1.0)),
    ))
}

/// A weightless free body with a site a metre along its x axis, and its centre
/// of mass 0.2 m up its z axis.
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
    // Lying on its side, it turns about its own z axis, which keeps its direction.
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
    let qpos = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let mut rig = floating(backend, qpos, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
    let rows = rig.run(5, &[])?;
    Ok(largest(rows.iter().enumerate().flat_map(|(i, row)| {
        let travelled = 2.0 * STEP * (i + 1) as f64;
        [row[6] - row[9], row[6] - travelled, row[9] - travelled]
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
