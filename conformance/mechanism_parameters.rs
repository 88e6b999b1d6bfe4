//! Parameters of masses, joints and actuators: each must change the motion by the physical amount.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::pair::{both, ends, pair};
use crate::rig::{G, STEP, largest};

const DRIVEN: Capabilities = Capabilities::ARTICULATION.union(Capabilities::ACTUATORS);
const IMPEDANCE: Capabilities = DRIVEN.union(Capabilities::JOINT_IMPEDANCE);
const MASS: Capabilities = Capabilities::MASS_PARAMETERS;
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);
const EXACT: &str = "from rest or under constant force the first steps are exact: rounding";

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "parameters/geom-position",
        needs: Capabilities::ARTICULATION.union(MASS),
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(geom_position),
    },
    Check {
        name: "parameters/geom-mass",
        needs: Capabilities::ARTICULATION.union(MASS),
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(geom_mass),
    },
    Check {
        name: "parameters/body-mass",
        needs: DRIVEN.union(MASS),
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(body_mass),
    },
    Check {
        name: "parameters/body-centre-of-mass",
        needs: DRIVEN.union(MASS),
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(body_center),
    },
    Check {
        name: "parameters/body-inertia",
        needs: DRIVEN.union(MASS),
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(body_inertia),
    },
    Check {
        name: "parameters/joint-anchor",
        needs: Capabilities::ARTICULATION.union(Capabilities::JOINT_ANCHORS),
        unit: "",
        tolerance: ROUNDING,
        reason: "place by geometry, and acceleration by the inertia about the new axis: rounding",
        measure: Figure(joint_anchor),
    },
    Check {
        name: "parameters/joint-axis",
        needs: Capabilities::ARTICULATION.union(Capabilities::JOINT_ANCHORS),
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(joint_axis),
    },
    Check {
        name: "parameters/body-place",
        needs: Capabilities::ARTICULATION.union(Capabilities::JOINT_ANCHORS),
        unit: "",
        tolerance: ROUNDING,
        reason: "place by geometry, and acceleration by the inertia of both links: rounding",
        measure: Figure(body_place),
    },
    Check {
        name: "parameters/joint-armature",
        needs: IMPEDANCE,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(joint_armature),
    },
    Check {
        name: "parameters/joint-damping",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "terminal speed is torque over damping: exp(-20), and rounding",
        measure: Figure(joint_damping),
    },
    Check {
        name: "parameters/joint-friction",
        needs: DRIVEN.union(Capabilities::JOINT_FRICTION),
        unit: "",
        tolerance: Tolerance::same(0.005),
        reason: "torque less friction, constant; one step in 200 may pass at breakaway",
        measure: Figure(joint_friction),
    },
    Check {
        name: "parameters/joint-stiffness",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest the angle is torque over stiffness: exp(-20), and rounding",
        measure: Figure(joint_stiffness),
    },
    Check {
        name: "parameters/servo-gain",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest kp times the error is the load: exp(-20), and rounding",
        measure: Figure(servo_gain),
    },
    Check {
        name: "parameters/velocity-gain",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest kv (c - v) = damping v: exp(-20), and rounding",
        measure: Figure(velocity_gain),
    },
    Check {
        name: "parameters/gear",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: Figure(gear),
    },
];

/// A hinge about y under gravity with two small balls, released with the arm horizontal.
fn arm(backend: &dyn Backend, parameter: (&str, f64)) -> Result<[f64; 2]> {
    let inside = r#"<worldbody><body name="arm"><joint name="j" axis="0 1 0"/>
      <geom name="near" type="sphere" size=".05" pos=".2 0 0" mass="1" contype="0" conaffinity="0"/>
      <geom name="far" type="sphere" size=".02" pos=".5 0 0" mass=".4" contype="0" conaffinity="0"/></body></worldbody>"#;
    let mut rig = pair(backend, inside, &["qvel.j"], &[parameter])?;
    let rows = rig.run(1, &[])?;
    Ok([rows[0][0] / STEP, rows[1][0] / STEP])
}

/// Acceleration of this arm if its far ball has mass `m` and is at `r`.
fn arm_theory(m: f64, r: f64) -> f64 {
    let near = 0.04 + 0.4 * 0.05 * 0.05;
    G * (0.2 + m * r) / (near + m * (r * r + 0.4 * 0.02 * 0.02))
}

/// A horizontal bar whose hinge is moved along it; it is rotated by a right angle, then released.
fn joint_anchor(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><body name="bar" pos="0 0 1"><joint name="j" axis="0 1 0"/>
      <geom type="sphere" size=".05" pos=".4 0 0" mass="1" contype="0" conaffinity="0"/></body></worldbody>
      <sensor><framepos name="at" objtype="xbody" objname="bar"/></sensor>"#;
    let anchor = ("joint/j/pos/0", 0.1);
    let mut rig = pair(backend, inside, &["qvel.j", "at"], &[anchor])?;
    let fall = |arm: f64| G * arm / (arm * arm + 0.4 * 0.05 * 0.05);
    let rows = rig.run(1, &[])?;
    let falls = both(
        [rows[0][0] / STEP, rows[1][0] / STEP],
        [fall(0.4), fall(0.3)],
    );
    // The axis stays at x = 0.1. The body's origin lies 0.1 m behind it and rises by that distance.
    let quarter = std::f64::consts::FRAC_PI_2;
    rig.simulator.set_state(&[0, 1], &[quarter; 2], &[0.0; 2])?;
    let mut at = vec![0.0; 2 * rig.record.width()];
    rig.simulator.read(&[0, 1], &rig.record, &mut at)?;
    let wanted = [[0.0, 0.0, 1.0], [0.1, 0.0, 1.1]].concat();
    let found = [&at[1..4], &at[5..8]].concat();
    let places = found.iter().zip(wanted).map(|(a, b)| (a - b).abs());
    Ok(largest(places.chain([falls])))
}

fn joint_axis(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><body name="bar" pos="0 0 1"><joint name="j" axis="0 1 0"/>
      <geom type="sphere" size=".05" pos=".4 0 0" mass="1" contype="0" conaffinity="0"/></body></worldbody>"#;
    let mut rig = pair(backend, inside, &["qvel.j"], &[("joint/j/axis/2", 0.75)])?;
    let rows = rig.run(1, &[])?;
    let about = 0.4 * 0.4 + 0.4 * 0.05 * 0.05;
    // The component of the weight's torque, which is about y, along (0, 0.8, 0.6).
    let wanted = [1.0, 0.8].map(|along| along * G * 0.4 / about);
    Ok(both([rows[0][0] / STEP, rows[1][0] / STEP], wanted))
}

fn body_place(backend: &dyn Backend) -> Result<f64> {
    // The outer link rotates about the vertical, so its weight causes no torque.
    let inside = r#"<worldbody><body name="inner" pos="0 0 1"><joint name="j" axis="0 1 0"/>
      <geom type="sphere" size=".05" pos=".2 0 0" mass="1" contype="0" conaffinity="0"/>
      <body name="outer" pos=".4 0 0"><joint name="k" axis="0 0 1"/>
        <geom type="sphere" size=".05" mass="1" contype="0" conaffinity="0"/></body></body></worldbody>
      <sensor><framepos name="at" objtype="xbody" objname="outer"/></sensor>"#;
    let place = ("body/outer/pos/0", 0.3);
    let mut rig = pair(backend, inside, &["qvel.j", "at"], &[place])?;
    let mut at = vec![0.0; 2 * rig.record.width()];
    rig.simulator.read(&[0, 1], &rig.record, &mut at)?;
    let wanted = [[0.4, 0.0, 1.0], [0.3, 0.0, 1.0]].concat();
    let found = [&at[1..4], &at[5..8]].concat();
    let places = found.iter().zip(wanted).map(|(a, b)| (a - b).abs());
    let own = 0.4 * 0.05 * 0.05;
    let fall = |x: f64| G * (0.2 + x) / (0.2 * 0.2 + x * x + 2.0 * own);
    let rows = rig.run(1, &[])?;
    let falls = both(
        [rows[0][0] / STEP, rows[1][0] / STEP],
        [fall(0.4), fall(0.3)],
    );
    Ok(largest(places.chain([falls])))
}

fn geom_position(backend: &dyn Backend) -> Result<f64> {
    let found = arm(backend, ("geom/far/pos/0", 0.3))?;
    Ok(both(found, [arm_theory(0.4, 0.5), arm_theory(0.4, 0.3)]))
}

fn geom_mass(backend: &dyn Backend) -> Result<f64> {
    let found = arm(backend, ("geom/far/mass", 0.9))?;
    Ok(both(found, [arm_theory(0.4, 0.5), arm_theory(0.9, 0.5)]))
}

fn body_mass(backend: &dyn Backend) -> Result<f64> {
    // Along a slide, and about a hinge, where the inertia grows with the mass.
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body name="cart" pos="0 2 0"><joint name="s" type="slide" axis="1 0 0"/>
        <geom type="box" size=".1 .1 .1" mass="2" contype="0" conaffinity="0"/></body>
      <body name="door"><joint name="h" axis="0 0 1"/>
        <geom type="box" size=".2 .05 .1" pos=".2 0 0" mass="1" contype="0" conaffinity="0"/></body></worldbody>
      <actuator><motor joint="s"/><motor joint="h"/></actuator>"#;
    let parameters = [("body/cart/mass", 4.0), ("body/door/mass", 3.0)];
    let mut rig = pair(backend, inside, &["qvel.s", "qvel.h"], &parameters)?;
    let [nominal, changed] = ends(&rig.run(20, &[1.0, 1.0])?)?;
    let inertia = 0.04 + (0.4 * 0.4 + 0.1 * 0.1) / 12.0;
    let time = 20.0 * STEP;
    Ok(largest([
        both([nominal[0], changed[0]], [0.5 * time, 0.25 * time]),
        both(
            [nominal[1], changed[1]],
            [1.0, 3.0].map(|m| time / (m * inertia)),
        ),
    ]))
}

/// A wheel on a hinge with its centre of mass off the axis, a motor, and attributes of its joint.
fn wheel(
    backend: &dyn Backend,
    joint: &str,
    actuator: &str,
    parameter: (&str, f64),
    frames: usize,
    ctrl: f64,
) -> Result<[Vec<f64>; 2]> {
    let inside = format!(
        r#"<option gravity="0 0 0" integrator="implicitfast"/><worldbody><body name="wheel">
        <joint name="j" axis="0 0 1" {joint}/>
        <inertial pos=".1 0 0" mass="2" diaginertia=".08 .08 .08"/></body></worldbody>
        <actuator>{actuator}</actuator>"#
    );
    let mut rig = pair(backend, &inside, &["qpos.j", "qvel.j"], &[parameter])?;
    ends(&rig.run(frames, &[ctrl])?)
}

/// The wheel's inertia about its hinge, kg m².
const INERTIA: f64 = 0.08 + 2.0 * 0.01;
const MOTOR: &str = r#"<motor name="m" joint="j"/>"#;

/// Compares rates after 20 steps under a unit torque with those of two inertias.
fn inertia_is(backend: &dyn Backend, parameter: (&str, f64), inertia: f64) -> Result<f64> {
    let rows = wheel(backend, "", MOTOR, parameter, 20, 1.0)?;
    let time = 20.0 * STEP;
    Ok(both(rows.map(|r| r[1]), [time / INERTIA, time / inertia]))
}

fn body_center(backend: &dyn Backend) -> Result<f64> {
    inertia_is(backend, ("body/wheel/ipos/0", 0.3), 0.08 + 2.0 * 0.09)
}

fn body_inertia(backend: &dyn Backend) -> Result<f64> {
    inertia_is(backend, ("body/wheel/inertia/2", 0.12), 0.12 + 0.02)
}

fn joint_armature(backend: &dyn Backend) -> Result<f64> {
    inertia_is(backend, ("joint/j/armature", 0.05), INERTIA + 0.05)
}

fn joint_damping(backend: &dyn Backend) -> Result<f64> {
    let joint = r#"damping="1""#;
    let rows = wheel(backend, joint, MOTOR, ("joint/j/damping", 2.5), 1000, 0.5)?;
    Ok(both(rows.map(|r| r[1]), [0.5, 0.2]))
}

fn joint_friction(backend: &dyn Backend) -> Result<f64> {
    let joint = r#"frictionloss="0.2" solreffriction="0.02 1" solimpfriction="0.999 0.999 0.001""#;
    let rows = wheel(
        backend,
        joint,
        MOTOR,
        ("joint/j/frictionloss", 0.6),
        200,
        1.0,
    )?;
    let time = 200.0 * STEP;
    Ok(both(
        rows.map(|r| r[1]),
        [0.8, 0.4].map(|torque| torque / INERTIA * time),
    ))
}

fn joint_stiffness(backend: &dyn Backend) -> Result<f64> {
    let joint = r#"stiffness="2" damping="0.9""#;
    let rows = wheel(backend, joint, MOTOR, ("joint/j/stiffness", 5.0), 6000, 0.5)?;
    Ok(both(rows.map(|r| r[0]), [0.25, 0.1]))
}

fn servo_gain(backend: &dyn Backend) -> Result<f64> {
    // A spring of stiffness 2 acts against the servo.
    let joint = r#"stiffness="2" damping="0.9""#;
    let servo = r#"<position name="p" joint="j" kp="8"/>"#;
    let rows = wheel(backend, joint, servo, ("actuator/p/kp", 18.0), 3000, 0.5)?;
    Ok(both(rows.map(|r| r[0]), [0.4, 0.45]))
}

fn velocity_gain(backend: &dyn Backend) -> Result<f64> {
    let servo = r#"<velocity name="v" joint="j" kv="1"/>"#;
    let rows = wheel(
        backend,
        r#"damping="1""#,
        servo,
        ("actuator/v/kv", 4.0),
        1500,
        0.5,
    )?;
    Ok(both(rows.map(|r| r[1]), [0.25, 0.4]))
}

fn gear(backend: &dyn Backend) -> Result<f64> {
    let motor = r#"<motor name="m" joint="j" gear="2"/>"#;
    let rows = wheel(backend, "", motor, ("actuator/m/gear", -0.5), 20, 1.0)?;
    let time = 20.0 * STEP;
    Ok(both(
        rows.map(|r| r[1]),
        [2.0, -0.5].map(|g| g / INERTIA * time),
    ))
}
