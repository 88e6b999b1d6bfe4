//! Springs, dampers, dry friction, rotor inertia, limits and equalities of joints.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, STEP, largest, last, period, relative};

const IMPEDANCE: Capabilities = Capabilities::ARTICULATION.union(Capabilities::JOINT_IMPEDANCE);
const DRIVEN: Capabilities = Capabilities::ARTICULATION.union(Capabilities::ACTUATORS);
const DRY: Capabilities = DRIVEN.union(Capabilities::JOINT_FRICTION);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "joints/armature",
        needs: IMPEDANCE.union(DRIVEN),
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "constant acceleration is exact: rounding",
        measure: Figure(armature),
    },
    Check {
        name: "joints/defaults-are-inherited",
        needs: IMPEDANCE.union(DRIVEN),
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "armature from the default class, a class below it, childclass and the joint itself: constant acceleration, rounding",
        measure: Figure(defaults),
    },
    Check {
        name: "joints/damping-decay",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::same(1.05e-3),
        reason: "first order in the step: rate dt / 2 = 0.001 after one time constant",
        measure: Figure(damping_decay),
    },
    Check {
        name: "joints/terminal-speed",
        needs: IMPEDANCE.union(DRIVEN),
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "exp(-20) is left of the start after 20 time constants, and rounding",
        measure: Figure(terminal_speed),
    },
    Check {
        name: "joints/spring-frequency",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::same(4e-4),
        reason: "second order in the step: (w dt)^2 at w = 10 rad/s",
        measure: Figure(spring_frequency),
    },
    Check {
        name: "joints/spring-amplitude",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::same(0.1),
        reason: "an implicit spring of first order takes w^2 dt t / 2 out of the amplitude in t = 1 s",
        measure: Figure(spring_amplitude),
    },
    Check {
        name: "joints/spring-rest",
        needs: IMPEDANCE,
        unit: "rad",
        tolerance: Tolerance::by_precision(1e-6, 1e-5),
        reason: "damped over 20 time constants it rests at springref, whatever ref is: rounding",
        measure: Figure(spring_rest),
    },
    Check {
        name: "joints/dry-friction-holds",
        needs: DRY,
        unit: "rad/s",
        tolerance: Tolerance::same(5e-4),
        reason: "friction softened to d = 0.999 creeps by (1 - d) a / b with a = 9 rad/s^2, b = 100 /s: five times that",
        measure: Figure(dry_friction_holds),
    },
    Check {
        name: "joints/dry-friction-breaks-away",
        needs: DRY,
        unit: "",
        tolerance: Tolerance::same(0.005),
        reason: "saturated friction is constant; one step in 200 may pass at breakaway",
        measure: Figure(dry_friction_breakaway),
    },
    Check {
        name: "joints/dry-friction-slows",
        needs: Capabilities::ARTICULATION.union(Capabilities::JOINT_FRICTION),
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "saturated friction is constant and its deceleration exact: rounding",
        measure: Figure(dry_friction_slows),
    },
    Check {
        name: "joints/limit-holds",
        needs: DRIVEN.union(Capabilities::JOINT_LIMITS),
        unit: "rad",
        tolerance: Tolerance::same(1e-3),
        reason: "the default softness (20 ms, d = 0.9) yields (1 - d) a / (d k) = 0.2 mrad at a = 5 rad/s^2: five times that",
        measure: Figure(limit_holds),
    },
    Check {
        name: "joints/limit-in-degrees",
        needs: DRIVEN.union(Capabilities::JOINT_LIMITS),
        unit: "rad",
        tolerance: Tolerance::same(1e-3),
        reason: "as limit-holds; angles of a document are degrees unless it says otherwise",
        measure: Figure(limit_in_degrees),
    },
    Check {
        name: "joints/slide-limit-is-in-metres",
        needs: Capabilities::ARTICULATION.union(Capabilities::JOINT_LIMITS),
        unit: "m",
        tolerance: Tolerance::same(1e-3),
        reason: "as limit-holds at g in place of 5 rad/s^2: 0.4 mm, twice that; lengths of a document are metres whatever its angles are",
        measure: Figure(slide_limit),
    },
];

/// A wheel of 0.1 kg m² on a hinge without gravity.
fn wheel(backend: &dyn Backend, joint: &str, channels: &[&str]) -> Result<Rig> {
    driven(backend, joint, "", channels)
}

/// The wheel with a motor.
fn motor(backend: &dyn Backend, joint: &str, channels: &[&str]) -> Result<Rig> {
    let actuator = r#"<actuator><motor name="m" joint="j"/></actuator>"#;
    driven(backend, joint, actuator, channels)
}

fn driven(backend: &dyn Backend, joint: &str, actuator: &str, channels: &[&str]) -> Result<Rig> {
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody><body name="wheel"><joint name="j" axis="0 0 1" {joint}/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>{actuator}"#
    );
    Rig::new(backend, &inside, channels)
}

fn armature(backend: &dyn Backend) -> Result<f64> {
    let mut rig = motor(backend, r#"armature="0.15""#, &["qvel.j"])?;
    Ok(relative(last(&rig.run(50, &[1.0])?)?[0], 0.1 / 0.25))
}

/// Wheels of 0.1 kg m² whose armature comes from four different places of a document.
fn defaults(backend: &dyn Backend) -> Result<f64> {
    let wheel = |body: &str, joint: &str| {
        format!(
            r#"<body {body}><joint {joint} axis="0 0 1"/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>"#
        )
    };
    let inside = format!(
        r#"<option gravity="0 0 0"/>
        <default><joint armature="0.1"/><motor gear="2"/>
          <default class="heavy"><joint armature="0.3"/></default></default>
        <worldbody>{}{}{}{}</worldbody>
        <actuator><motor joint="a"/><motor joint="b"/><motor joint="c"/><motor joint="d" gear="1"/></actuator>"#,
        wheel("", r#"name="a""#),
        wheel("", r#"name="b" class="heavy""#),
        wheel(r#"childclass="heavy""#, r#"name="c""#),
        wheel(r#"childclass="heavy""#, r#"name="d" armature="0.4""#)
    );
    let mut rig = Rig::new(backend, &inside, &["qvel.a", "qvel.b", "qvel.c", "qvel.d"])?;
    let rows = rig.run(50, &[1.0; 4])?;
    let theory = [2.0 / 0.2, 2.0 / 0.4, 2.0 / 0.4, 1.0 / 0.5];
    let end = last(&rows)?;
    Ok(largest((0..4).map(|i| relative(end[i], 0.1 * theory[i]))))
}

fn damping_decay(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(backend, r#"damping="0.1""#, &["qvel.j"])?;
    rig.place(&[0.0], &[2.0])?;
    Ok(relative(last(&rig.run(500, &[])?)?[0], 2.0 * (-1f64).exp()))
}

fn terminal_speed(backend: &dyn Backend) -> Result<f64> {
    let mut rig = motor(backend, r#"damping="1""#, &["qvel.j"])?;
    Ok(relative(last(&rig.run(1000, &[0.7])?)?[0], 0.7))
}

/// A spring with 10 rad/s, released at 0.1 m: positions over 1.34 s.
fn spring(backend: &dyn Backend) -> Result<Vec<f64>> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body>
      <joint name="j" type="slide" axis="1 0 0" stiffness="200"/>
      <geom type="sphere" size=".05" mass="2" contype="0" conaffinity="0"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.j"])?;
    rig.place(&[0.1], &[0.0])?;
    // Two periods and an eighth: two upward crossings and their peaks.
    Ok(rig.run(670, &[])?.iter().map(|r| r[0]).collect())
}

fn spring_frequency(backend: &dyn Backend) -> Result<f64> {
    let found = period(&spring(backend)?, 0.0);
    Ok(relative(found, std::f64::consts::TAU / 10.0))
}

fn spring_amplitude(backend: &dyn Backend) -> Result<f64> {
    // The extremum nearest to one second is the trough after one and a half periods.
    let samples = spring(backend)?;
    let trough = largest(samples[400..550].iter().copied());
    Ok(relative(trough, 0.1))
}

fn spring_rest(backend: &dyn Backend) -> Result<f64> {
    let joint = r#"ref="0.2" springref="0.5" stiffness="5" damping="1.4""#;
    let mut rig = wheel(backend, joint, &["qpos.j"])?;
    let start = rig.read()?[0][0] - 0.2;
    let rest = last(&rig.run(3000, &[])?)?[0] - 0.5;
    Ok(largest([start, rest]))
}

/// The hardest dry friction that MJCF allows without becoming stiff.
const HARD: &str = r#"solreffriction="0.02 1" solimpfriction="0.999 0.999 0.001""#;

fn dry_friction_holds(backend: &dyn Backend) -> Result<f64> {
    let mut rig = motor(backend, &format!(r#"frictionloss="1" {HARD}"#), &["qpos.j"])?;
    let rows = rig.run(500, &[0.9])?;
    Ok((rows[499][0] - rows[249][0]) / 0.5)
}

fn dry_friction_breakaway(backend: &dyn Backend) -> Result<f64> {
    let mut rig = motor(backend, &format!(r#"frictionloss="1" {HARD}"#), &["qvel.j"])?;
    let rows = rig.run(200, &[1.2])?;
    Ok(relative(rows[199][0], 0.2 / 0.1 * 200.0 * STEP))
}

fn dry_friction_slows(backend: &dyn Backend) -> Result<f64> {
    let mut rig = wheel(
        backend,
        &format!(r#"frictionloss="0.3" {HARD}"#),
        &["qvel.j"],
    )?;
    rig.place(&[0.0], &[4.0])?;
    Ok(relative(last(&rig.run(500, &[])?)?[0], 4.0 - 3.0))
}

fn limit_holds(backend: &dyn Backend) -> Result<f64> {
    let joint = r#"range="-1 0.3""#;
    let mut rig = motor(backend, joint, &["qpos.j"])?;
    let up = last(&rig.run(1000, &[0.5])?)?[0] - 0.3;
    let down = last(&rig.run(2000, &[-0.5])?)?[0] + 1.0;
    Ok(largest([up, down]))
}

fn limit_in_degrees(backend: &dyn Backend) -> Result<f64> {
    let xml = format!(
        r#"<mujoco><option timestep="{STEP}" gravity="0 0 0"/><worldbody><body>
        <joint name="j" axis="0 0 1" range="-30 30"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
        <actuator><motor name="m" joint="j"/></actuator></mujoco>"#
    );
    let scene = asid_core::Scene::from_xml("conformance", &xml, &[])?;
    let mut rig = Rig::of(backend.load(&scene)?, &["qpos.j"], crate::rig::ONE)?;
    Ok(last(&rig.run(1000, &[0.5])?)?[0] - std::f64::consts::FRAC_PI_6)
}

fn slide_limit(backend: &dyn Backend) -> Result<f64> {
    let xml = format!(
        r#"<mujoco><option timestep="{STEP}"/><worldbody><body>
        <joint name="j" type="slide" axis="0 0 -1" range="-1 0.05"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"#
    );
    let scene = asid_core::Scene::from_xml("conformance", &xml, &[])?;
    let mut rig = Rig::of(backend.load(&scene)?, &["qpos.j"], crate::rig::ONE)?;
    Ok(last(&rig.run(500, &[])?)?[0] - 0.05)
}
