//! Frames of bodies and sites: sensors against forward kinematics computed by hand.

use asid_core::{Backend, Capabilities, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::arrays::floating;
use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, largest};

const FREE: Capabilities = Capabilities::FREE_BODIES;
const TREE: Capabilities = Capabilities::ARTICULATION;
const EXACT: Tolerance = Tolerance::by_precision(1e-12, 2e-6);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "frames/site-position",
        needs: TREE,
        unit: "m",
        tolerance: EXACT,
        reason: "forward kinematics by hand: rounding of lengths of 1 m",
        measure: Figure(site_position),
    },
    Check {
        name: "frames/site-orientation",
        needs: TREE,
        unit: "",
        tolerance: EXACT,
        reason: "forward kinematics by hand, quaternion w x y z of either sign: rounding",
        measure: Figure(site_orientation),
    },
    Check {
        name: "frames/orientations-of-a-document",
        needs: TREE,
        unit: "",
        tolerance: EXACT,
        reason: "one rotation written as quat, axisangle, euler, xyaxes and zaxis: rounding",
        measure: Figure(orientations),
    },
    Check {
        name: "frames/degrees-of-a-document",
        needs: TREE,
        unit: "",
        tolerance: EXACT,
        reason: "axisangle, euler and ref are degrees where a document says nothing else, keyframes and readings radians, lengths metres: rounding",
        measure: Figure(degrees),
    },
    Check {
        name: "frames/site-velocity",
        needs: TREE,
        unit: "m/s",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "w x r + R v by hand, in the world frame: rounding at 3 m/s",
        measure: Figure(site_velocity),
    },
    Check {
        name: "frames/site-angular-velocity",
        needs: TREE,
        unit: "rad/s",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "sum of the joints' axes in the world frame: rounding at 3 rad/s",
        measure: Figure(site_rate),
    },
    Check {
        name: "frames/joint-sensors",
        needs: TREE,
        unit: "",
        tolerance: EXACT,
        reason: "jointpos and jointvel are qpos and qvel: rounding",
        measure: Figure(joint_sensors),
    },
    Check {
        name: "frames/body-and-inertial-frame",
        needs: FREE,
        unit: "m",
        tolerance: EXACT,
        reason: "objtype body is the centre of mass, xbody the origin of the body: rounding",
        measure: Figure(body_frames),
    },
];

/// A rotated and moving chain: the readings at its tip, and their expected values.
struct Tip {
    read: Vec<f64>,
    place: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
    joints: [f64; 6],
}

fn tip(backend: &dyn Backend) -> Result<Tip> {
    let inside = r#"<worldbody>
      <body pos="0.1 0.2 0.3" quat="0.8 0 0 0.6"><joint name="a" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <body pos="0.4 0 0.1" quat="0.6 0.8 0 0"><joint name="b" type="slide" axis="0 0.6 0.8"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <body pos="0 0.2 0"><joint name="c" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <site name="tip" pos="0.1 -0.2 0.3" quat="0.28 0 0.96 0"/></body></body></body></worldbody>
      <sensor><framepos name="p" objtype="site" objname="tip"/><framequat name="q" objtype="site" objname="tip"/>
        <framelinvel name="v" objtype="site" objname="tip"/><frameangvel name="w" objtype="site" objname="tip"/>
        <jointpos name="ja" joint="a"/><jointpos name="jb" joint="b"/><jointpos name="jc" joint="c"/>
        <jointvel name="va" joint="a"/><jointvel name="vb" joint="b"/><jointvel name="vc" joint="c"/></sensor>"#;
    let channels = ["p", "q", "v", "w", "ja", "jb", "jc", "va", "vb", "vc"];
    let mut rig = Rig::new(backend, inside, &channels)?;
    let ([a, b, c], [va, vb, vc]) = ([0.7, 0.15, -1.1], [1.5, -0.8, 2.0]);
    rig.place(&[a, b, c], &[va, vb, vc])?;

    let turn = |w, x, y, z| UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let about = |axis: Vector3<f64>, angle| UnitQuaternion::from_scaled_axis(axis * angle);
    // The first body rotates about its own origin.
    let first = turn(0.8, 0.0, 0.0, 0.6) * about(Vector3::y(), a);
    let first_at = Vector3::new(0.1, 0.2, 0.3);
    let first_rate = turn(0.8, 0.0, 0.0, 0.6) * Vector3::y() * va;
    // The second body slides along an axis of its own frame.
    let second = first * turn(0.6, 0.8, 0.0, 0.0);
    let along = second * Vector3::new(0.0, 0.6, 0.8);
    let second_at = first_at + first * Vector3::new(0.4, 0.0, 0.1) + along * b;
    let third = second * about(Vector3::z(), c);
    let third_at = second_at + second * Vector3::new(0.0, 0.2, 0.0);
    let third_rate = second * Vector3::z() * vc;
    let place = third_at + third * Vector3::new(0.1, -0.2, 0.3);
    Ok(Tip {
        read: rig.read()?.swap_remove(0),
        place,
        attitude: third * turn(0.28, 0.0, 0.96, 0.0),
        velocity: first_rate.cross(&(place - first_at))
            + along * vb
            + third_rate.cross(&(place - third_at)),
        rate: first_rate + third_rate,
        joints: [a, b, c, va, vb, vc],
    })
}

fn site_position(backend: &dyn Backend) -> Result<f64> {
    let tip = tip(backend)?;
    Ok(largest((0..3).map(|i| tip.read[i] - tip.place[i])))
}

fn site_orientation(backend: &dyn Backend) -> Result<f64> {
    let tip = tip(backend)?;
    let q = tip.attitude;
    let theory = [q.w, q.i, q.j, q.k];
    let sign = if tip.read[3] * q.w < 0.0 { -1.0 } else { 1.0 };
    Ok(largest((0..4).map(|i| sign * tip.read[3 + i] - theory[i])))
}

fn site_velocity(backend: &dyn Backend) -> Result<f64> {
    let tip = tip(backend)?;
    Ok(largest((0..3).map(|i| tip.read[7 + i] - tip.velocity[i])))
}

fn site_rate(backend: &dyn Backend) -> Result<f64> {
    let tip = tip(backend)?;
    Ok(largest((0..3).map(|i| tip.read[10 + i] - tip.rate[i])))
}

fn joint_sensors(backend: &dyn Backend) -> Result<f64> {
    let tip = tip(backend)?;
    Ok(largest((0..6).map(|i| tip.read[13 + i] - tip.joints[i])))
}

fn body_frames(backend: &dyn Backend) -> Result<f64> {
    // After a quarter turn about x its z axis points along -y.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let qpos = [1.0, 2.0, 3.0, half, half, 0.0, 0.0];
    let read = floating(backend, qpos, [0.0; 6])?.read()?.swap_remove(0);
    let theory = [1.0, 1.8, 3.0, 1.0, 2.0, 3.0];
    Ok(largest((0..6).map(|i| read[3 + i] - theory[i])))
}

/// Sites of one body whose orientations are written in each of MJCF's ways.
fn orientations(backend: &dyn Backend) -> Result<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::x() * 0.6)
        * UnitQuaternion::from_scaled_axis(Vector3::y() * -0.4)
        * UnitQuaternion::from_scaled_axis(Vector3::z() * 1.1);
    let written = |v: Vector3<f64>| format!("{:?} {:?} {:?}", v.x, v.y, v.z);
    let axis = turn.axis().map_or(Vector3::zeros(), |a| a.into_inner());
    // The smallest rotation that takes the z axis to its rotated direction.
    let least =
        UnitQuaternion::rotation_between(&Vector3::z(), &(turn * Vector3::z())).unwrap_or_default();
    let ways = [
        (
            format!(
                r#"quat="{:?} {:?} {:?} {:?}""#,
                turn.w, turn.i, turn.j, turn.k
            ),
            turn,
        ),
        (
            format!(r#"axisangle="{} {:?}""#, written(axis), turn.angle()),
            turn,
        ),
        // By default the angles are about the rotated axes, x first.
        (r#"euler="0.6 -0.4 1.1""#.to_owned(), turn),
        (
            format!(
                r#"xyaxes="{} {}""#,
                written(turn * Vector3::x() * 2.0),
                written(turn * Vector3::new(0.3, 0.5, 0.0))
            ),
            turn,
        ),
        (
            format!(r#"zaxis="{}""#, written(turn * Vector3::z() * 3.0)),
            least,
        ),
    ];
    let mut errors = Vec::new();
    for (way, theory) in ways {
        let inside = format!(
            r#"<worldbody><body><joint name="j"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
            <site name="s" {way}/></body></worldbody>
            <sensor><framequat name="q" objtype="site" objname="s"/></sensor>"#
        );
        let q = Rig::new(backend, &inside, &["q"])?.read()?.swap_remove(0);
        let sign = if q[0] * theory.w < 0.0 { -1.0 } else { 1.0 };
        let theory = [theory.w, theory.i, theory.j, theory.k];
        errors.extend((0..4).map(|i| sign * q[i] - theory[i]));
    }
    Ok(largest(errors))
}

/// A document in degrees, the unit of documents that name none.
fn degrees(backend: &dyn Backend) -> Result<f64> {
    let xml = r#"<mujoco><worldbody>
      <body euler="0 0 30"><joint name="h" axis="0 0 1" ref="45"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <body axisangle="1 0 0 60"><joint name="s" type="slide" axis="1 0 0" ref="0.2"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="tip" pos="0 1 0"/></body></body></worldbody>
      <sensor><jointpos name="ph" joint="h"/><jointpos name="ps" joint="s"/>
        <framepos name="p" objtype="site" objname="tip"/></sensor>
      <keyframe><key qpos="1 0.5"/></keyframe></mujoco>"#;
    let scene = asid_core::Scene::from_xml("conformance", xml, &[])?;
    let mut rig = Rig::of(backend.load(&scene)?, &["ph", "ps", "p"], crate::rig::ONE)?;
    let found = rig.read()?.swap_remove(0);
    let about = |axis: Vector3<f64>, degrees: f64| {
        UnitQuaternion::from_scaled_axis(axis * degrees.to_radians())
    };
    let first = about(Vector3::z(), 30.0 - 45.0) * UnitQuaternion::from_scaled_axis(Vector3::z());
    let second = first * about(Vector3::x(), 60.0);
    let tip = second * Vector3::new(0.3, 1.0, 0.0);
    let theory = [1.0, 0.5, tip.x, tip.y, tip.z];
    Ok(largest((0..5).map(|i| found[i] - theory[i])))
}
