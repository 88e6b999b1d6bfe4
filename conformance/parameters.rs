//! Parameters: each kind of target acts, on its own simulation only, by the
//! amount that physics says.

use asid_core::simulator::ParameterChange;
use asid_core::{Backend, Capabilities, Result};

use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, Rows, STEP, Size, broken, largest, last, relative};

const CONTACT: Capabilities = Capabilities::CONTACT;
const TREE: Capabilities = Capabilities::ARTICULATION;
const DRIVEN: Capabilities = TREE.union(Capabilities::ACTUATORS);
const IMPEDANCE: Capabilities = DRIVEN.union(Capabilities::JOINT_IMPEDANCE);
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);
const EXACT: &str = "from rest or under constant force the first steps are exact: rounding";

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "parameters/sliding-friction",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "distance v^2 / (2 mu g) by the parameter's mu: as friction/stopping-distance",
        measure: sliding_friction,
    },
    Check {
        name: "parameters/torsional-friction",
        needs: CONTACT.union(Capabilities::TORSIONAL_FRICTION),
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "deceleration mu_t g / (2/5 R^2) by the parameter's mu_t: as friction/spin-down",
        measure: torsional_friction,
    },
    Check {
        name: "parameters/rolling-friction",
        needs: CONTACT.union(Capabilities::ROLLING_FRICTION),
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "deceleration 5/7 mu_r g / R by the parameter's mu_r: as friction/roll-out-distance",
        measure: rolling_friction,
    },
    Check {
        name: "parameters/contact-softness",
        needs: CONTACT.union(Capabilities::CONTACT_STIFFNESS),
        unit: "",
        tolerance: Tolerance::same(0.02),
        reason: "at rest it sinks in by (1 - d) g / (d k) with k falling as the square of the time constant, d being constant",
        measure: softness,
    },
    Check {
        name: "parameters/geom-position",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: geom_position,
    },
    Check {
        name: "parameters/geom-position-moves-its-contact",
        needs: CONTACT,
        unit: "m",
        tolerance: Tolerance::same(5e-4),
        reason: "a ball set 30 mm lower in its body holds that 30 mm higher: softness as contact/rest-height-of-shapes",
        measure: geom_position_contact,
    },
    Check {
        name: "parameters/geom-mass",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: geom_mass,
    },
    Check {
        name: "parameters/body-mass",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: body_mass,
    },
    Check {
        name: "parameters/body-centre-of-mass",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: body_centre,
    },
    Check {
        name: "parameters/body-inertia",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: body_inertia,
    },
    Check {
        name: "parameters/joint-damping",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "terminal speed is torque over damping: exp(-20), and rounding",
        measure: joint_damping,
    },
    Check {
        name: "parameters/joint-friction",
        needs: DRIVEN.union(Capabilities::JOINT_FRICTION),
        unit: "",
        tolerance: Tolerance::same(0.005),
        reason: "torque less friction, constant; one step in 200 may pass at breakaway",
        measure: joint_friction,
    },
    Check {
        name: "parameters/joint-stiffness",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest the angle is torque over stiffness: exp(-20), and rounding",
        measure: joint_stiffness,
    },
    Check {
        name: "parameters/joint-armature",
        needs: IMPEDANCE,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: joint_armature,
    },
    Check {
        name: "parameters/servo-gain",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest kp times the error is the load: exp(-20), and rounding",
        measure: servo_gain,
    },
    Check {
        name: "parameters/velocity-gain",
        needs: IMPEDANCE,
        unit: "",
        tolerance: Tolerance::by_precision(1e-6, 1e-4),
        reason: "at rest kv (c - v) = damping v: exp(-20), and rounding",
        measure: velocity_gain,
    },
    Check {
        name: "parameters/gear",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: EXACT,
        measure: gear,
    },
    Check {
        name: "parameters/gravity",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "speed of fall along each axis: rounding",
        measure: gravity,
    },
    Check {
        name: "parameters/nominal-is-of-the-document",
        needs: IMPEDANCE.union(CONTACT).union(Capabilities::JOINT_FRICTION),
        unit: "",
        tolerance: Tolerance::by_precision(1e-12, 1e-6),
        reason: "what the document says, or follows from it by hand: rounding",
        measure: nominal,
    },
    Check {
        name: "parameters/own-simulation-only",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "readings of a neighbour that differ in any bit",
        measure: own_simulation,
    },
    Check {
        name: "parameters/survive-reset-and-load",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "acceleration by the parameter after reset, set_state, load and copy: rounding",
        measure: survive,
    },
    Check {
        name: "parameters/change-at-their-frame",
        needs: CONTACT.union(Capabilities::PARAMETER_CHANGES),
        unit: "",
        tolerance: ROUNDING,
        reason: "speed grows by the old gravity up to the frame and by the new from it on: rounding",
        measure: change_in_rollout,
    },
    Check {
        name: "parameters/nonsense-is-refused",
        needs: DRIVEN.union(CONTACT),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "an error each for five targets and four values: accepted of nine",
        measure: nonsense,
    },
];

/// Two simulations, the first with nominal parameters and the second with others.
fn pair(
    backend: &dyn Backend,
    inside: &str,
    channels: &[&str],
    parameters: &[(&str, f64)],
) -> Result<Rig> {
    let targets: Vec<&str> = parameters.iter().map(|p| p.0).collect();
    let size = Size {
        sims: 2,
        threads: 1,
        targets: &targets,
    };
    let mut rig = Rig::with(backend, inside, channels, size)?;
    let values: Vec<f64> = parameters.iter().map(|p| p.1).collect();
    rig.simulator.set_parameters(&[1], &values)?;
    Ok(rig)
}

/// Last row of both.
fn ends(rows: &Rows) -> Result<[Vec<f64>; 2]> {
    let half = rows.len() / 2;
    Ok([last(&rows[..half])?.to_vec(), last(&rows[half..])?.to_vec()])
}

/// Largest deviation of both from theory.
fn both(found: [f64; 2], theory: [f64; 2]) -> f64 {
    largest((0..2).map(|i| relative(found[i], theory[i])))
}

const RADIUS: f64 = 0.05;

/// A ball on a plane, settled and then sent off; the friction of the plane counts.
fn ball(
    backend: &dyn Backend,
    condim: u32,
    parameter: (&str, f64),
    qvel: [f64; 6],
    frames: usize,
) -> Result<Rows> {
    let inside = format!(
        r#"<option cone="elliptic" impratio="100"/><worldbody>
        <geom name="floor" type="plane" size="5 5 .1" condim="{condim}" friction="1 0.01 0.002"/>
        <body name="b" pos="0 0 {RADIUS}"><freejoint name="b"/>
          <geom name="ball" type="sphere" size="{RADIUS}" mass="0.3" friction="0.01 0 0"/></body></worldbody>"#
    );
    let mut rig = pair(backend, &inside, &["qpos.b", "qvel.b"], &[parameter])?;
    let height = last(&rig.run(150, &[])?)?[2];
    rig.place(&[0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0], &qvel)?;
    rig.run(frames, &[])
}

fn sliding_friction(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option cone="elliptic" impratio="100"/><worldbody>
        <geom name="floor" type="plane" size="5 5 .1" friction="0.2"/>
        <body name="b" pos="0 0 0.05"><freejoint name="b"/>
          <geom type="box" size=".1 .08 .05" mass="0.5" friction="0.01"/></body></worldbody>"#;
    let parameter = ("geom/floor/friction/0", 0.4);
    let mut rig = pair(backend, inside, &["qpos.b"], &[parameter])?;
    let height = last(&rig.run(150, &[])?)?[2];
    let speed = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    rig.place(&[0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0], &speed)?;
    let [nominal, changed] = ends(&rig.run(400, &[])?)?;
    let theory = [0.2, 0.4].map(|friction| 1.0 / (2.0 * friction * G));
    Ok(both([nominal[0], changed[0]], theory))
}

fn torsional_friction(backend: &dyn Backend) -> Result<f64> {
    let spin = [0.0, 0.0, 0.0, 0.0, 0.0, 20.0];
    let parameter = ("geom/floor/friction/1", 0.004);
    // The first steps are left out: an engine may need one to know the normal force.
    let rows = ball(backend, 4, parameter, spin, 60)?;
    let slowed = [0, 60].map(|sim| rows[sim + 9][12] - rows[sim + 59][12]);
    let theory = [0.01, 0.004].map(|f| f * G / (0.4 * RADIUS * RADIUS) * 50.0 * STEP);
    Ok(both(slowed, theory))
}

fn rolling_friction(backend: &dyn Backend) -> Result<f64> {
    let roll = [0.5, 0.0, 0.0, 0.0, 10.0, 0.0];
    let parameter = ("geom/floor/friction/2", 0.004);
    let rows = ends(&ball(backend, 6, parameter, roll, 1250)?)?;
    let theory = [0.002, 0.004].map(|f| 0.25 / (2.0 * 5.0 / 7.0 * f * G / RADIUS));
    Ok(both(rows.map(|row| row[0]), theory))
}

fn softness(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><geom type="plane" size="5 5 .1"/>
        <body pos="0 0 .05"><freejoint name="b"/>
          <geom name="ball" type="sphere" size=".05" mass="0.3" priority="1" solimp="0.9 0.9 0.001"/></body></worldbody>"#;
    let parameter = ("geom/ball/solref/0", 0.04);
    let mut rig = pair(backend, inside, &["qpos.b"], &[parameter])?;
    let [nominal, changed] = ends(&rig.run(1000, &[])?)?;
    let depth = |row: Vec<f64>| 0.05 - row[2];
    Ok(relative(depth(changed) / depth(nominal), 4.0))
}

/// A hinge about y under gravity with two small balls, let go with the arm level.
fn arm(backend: &dyn Backend, parameter: (&str, f64)) -> Result<[f64; 2]> {
    let inside = r#"<worldbody><body name="arm"><joint name="j" axis="0 1 0"/>
      <geom name="near" type="sphere" size=".05" pos=".2 0 0" mass="1"/>
      <geom name="far" type="sphere" size=".02" pos=".5 0 0" mass=".4"/></body></worldbody>"#;
    let mut rig = pair(backend, inside, &["qvel.j"], &[parameter])?;
    let rows = rig.run(1, &[])?;
    Ok([rows[0][0] / STEP, rows[1][0] / STEP])
}

/// Acceleration of that arm with its far ball of mass `m` at `r`.
fn arm_theory(m: f64, r: f64) -> f64 {
    let near = 0.04 + 0.4 * 0.05 * 0.05;
    G * (0.2 + m * r) / (near + m * (r * r + 0.4 * 0.02 * 0.02))
}

fn geom_position(backend: &dyn Backend) -> Result<f64> {
    let found = arm(backend, ("geom/far/pos/0", 0.3))?;
    Ok(both(found, [arm_theory(0.4, 0.5), arm_theory(0.4, 0.3)]))
}

fn geom_mass(backend: &dyn Backend) -> Result<f64> {
    let found = arm(backend, ("geom/far/mass", 0.9))?;
    Ok(both(found, [arm_theory(0.4, 0.5), arm_theory(0.9, 0.5)]))
}

fn geom_position_contact(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><geom type="plane" size="5 5 .1"/>
        <body pos="0 0 .05"><freejoint name="b"/><geom name="ball" type="sphere" size=".05" mass="0.3"/></body></worldbody>"#;
    let parameter = ("geom/ball/pos/2", -0.03);
    let mut rig = pair(backend, inside, &["qpos.b"], &[parameter])?;
    let qpos = |z: f64| [0.0, 0.0, z, 1.0, 0.0, 0.0, 0.0];
    rig.simulator
        .set_state(&[0, 1], &[qpos(0.05), qpos(0.08)].concat(), &[0.0; 12])?;
    let [nominal, changed] = ends(&rig.run(300, &[])?)?;
    Ok(largest([nominal[2] - 0.05, changed[2] - 0.08]))
}

fn body_mass(backend: &dyn Backend) -> Result<f64> {
    // Along a slide, and about a hinge, where the inertia grows with the mass.
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body name="cart" pos="0 2 0"><joint name="s" type="slide" axis="1 0 0"/><geom type="box" size=".1 .1 .1" mass="2"/></body>
      <body name="door"><joint name="h" axis="0 0 1"/><geom type="box" size=".2 .05 .1" pos=".2 0 0" mass="1"/></body></worldbody>
      <actuator><motor joint="s"/><motor joint="h"/></actuator>"#;
    let parameters = [("body/cart/mass", 4.0), ("body/door/mass", 3.0)];
    let mut rig = pair(backend, inside, &["qvel.s", "qvel.h"], &parameters)?;
    let [nominal, changed] = ends(&rig.run(20, &[1.0, 1.0])?)?;
    let inertia = 0.04 + (0.4 * 0.4 + 0.1 * 0.1) / 12.0;
    let time = 20.0 * STEP;
    Ok(largest([
        both([nominal[0], changed[0]], [0.5 * time, 0.25 * time]),
        both([nominal[1], changed[1]], [1.0, 3.0].map(|m| time / (m * inertia))),
    ]))
}

/// A wheel on a hinge, with a centre of mass, a motor, and what acts on its joint.
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

/// Rates after 20 steps under a unit torque, against those of two inertias.
fn inertia_is(backend: &dyn Backend, parameter: (&str, f64), inertia: f64) -> Result<f64> {
    let rows = wheel(backend, "", MOTOR, parameter, 20, 1.0)?;
    let time = 20.0 * STEP;
    Ok(both(rows.map(|r| r[1]), [time / INERTIA, time / inertia]))
}

fn body_centre(backend: &dyn Backend) -> Result<f64> {
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
    let joint =
        r#"frictionloss="0.2" solreffriction="0.02 1" solimpfriction="0.999 0.999 0.001""#;
    let rows = wheel(backend, joint, MOTOR, ("joint/j/frictionloss", 0.6), 200, 1.0)?;
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
    // A spring of stiffness 2 pulls against the servo.
    let joint = r#"stiffness="2" damping="0.9""#;
    let servo = r#"<position name="p" joint="j" kp="8"/>"#;
    let rows = wheel(backend, joint, servo, ("actuator/p/kp", 18.0), 3000, 0.5)?;
    Ok(both(rows.map(|r| r[0]), [0.4, 0.45]))
}

fn velocity_gain(backend: &dyn Backend) -> Result<f64> {
    let servo = r#"<velocity name="v" joint="j" kv="1"/>"#;
    let rows = wheel(backend, r#"damping="1""#, servo, ("actuator/v/kv", 4.0), 1500, 0.5)?;
    Ok(both(rows.map(|r| r[1]), [0.25, 0.4]))
}

fn gear(backend: &dyn Backend) -> Result<f64> {
    let motor = r#"<motor name="m" joint="j" gear="2"/>"#;
    let rows = wheel(backend, "", motor, ("actuator/m/gear", -0.5), 20, 1.0)?;
    let time = 20.0 * STEP;
    Ok(both(rows.map(|r| r[1]), [2.0, -0.5].map(|g| g / INERTIA * time)))
}

const FALLING: &str = r#"<worldbody><body name="b"><freejoint name="b"/>
    <geom type="sphere" size=".1" mass="1"/></body></worldbody>"#;

fn gravity(backend: &dyn Backend) -> Result<f64> {
    let field = [1.5, -2.5, -3.0];
    let targets = ["option/gravity/0", "option/gravity/1", "option/gravity/2"];
    let parameters: Vec<(&str, f64)> = targets.into_iter().zip(field).collect();
    let mut rig = pair(backend, FALLING, &["qvel.b"], &parameters)?;
    let [nominal, changed] = ends(&rig.run(50, &[])?)?;
    let time = 50.0 * STEP;
    let parts = (0..3).map(|i| relative(changed[i], field[i] * time));
    Ok(largest(parts.chain([relative(nominal[2], -G * time)])))
}

fn nominal(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody>
      <geom name="floor" type="plane" size="5 5 .1" friction="0.7 0.02 0.003"/>
      <body name="arm"><joint name="j" axis="0 1 0" damping="0.3" frictionloss="0.04" stiffness="1.5" armature="0.02"/>
        <geom name="near" type="sphere" size=".05" pos=".2 .1 0" mass="1"/>
        <geom name="far" type="sphere" size=".05" pos=".6 .1 0" mass="3"/></body>
      <body name="lump" pos="0 0 1"><freejoint name="l"/><inertial pos=".01 .02 .03" mass=".7" diaginertia=".03 .04 .05"/>
        <geom type="sphere" size=".1"/></body></worldbody>
      <actuator><position name="p" joint="j" kp="30" kv="4"/><motor name="m" joint="j" gear="6"/></actuator>"#;
    let model = backend.load(&crate::rig::scene(inside)?)?;
    let expected = [
        ("geom/floor/friction/0", 0.7),
        ("geom/floor/friction/1", 0.02),
        ("geom/floor/friction/2", 0.003),
        ("geom/near/pos/1", 0.1),
        ("geom/far/mass", 3.0),
        ("body/arm/mass", 4.0),
        ("body/arm/ipos/0", 0.5),
        ("body/lump/mass", 0.7),
        ("body/lump/ipos/2", 0.03),
        ("body/lump/inertia/1", 0.04),
        ("joint/j/damping", 0.3),
        ("joint/j/frictionloss", 0.04),
        ("joint/j/stiffness", 1.5),
        ("joint/j/armature", 0.02),
        ("actuator/p/kp", 30.0),
        ("actuator/p/kv", 4.0),
        ("actuator/m/gear", 6.0),
        ("option/gravity/2", -9.81),
    ];
    let mut errors = Vec::new();
    for (target, value) in expected {
        errors.push(relative(model.nominal(&target.parse()?)?, value));
    }
    Ok(largest(errors))
}

fn own_simulation(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><body name="b"><joint name="j" axis="0 1 0" damping="0.1"/>
      <geom name="g" type="sphere" size=".05" pos=".2 0 0" mass="1"/></body></worldbody>"#;
    let targets = ["geom/g/mass", "geom/g/pos/0", "option/gravity/2"];
    let size = Size {
        sims: 3,
        threads: 2,
        targets: &targets,
    };
    let mut rig = Rig::with(backend, inside, &["qpos.j"], size)?;
    let nominal = [1.0, 0.2, -9.81];
    rig.set(&nominal.repeat(3))?;
    let mut alone = Rig::with(backend, inside, &["qpos.j"], size)?;
    alone.set(&nominal.repeat(3))?;
    rig.simulator.set_parameters(&[1], &[2.0, 0.1, -3.0])?;
    let (rows, plain) = (rig.run(100, &[])?, alone.run(100, &[])?);
    let differ = |sim: usize| {
        let range = 100 * sim..100 * (sim + 1);
        crate::rig::differing_bits(&rows[range.clone()], &plain[range])
    };
    if differ(1) == 0.0 {
        return Ok(f64::NAN);
    }
    Ok(differ(0) + differ(2))
}

fn survive(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pair(backend, FALLING, &["qvel.b"], &[("option/gravity/2", -3.0)])?;
    let start = rig.simulator.save(&[0])?;
    let mut errors = Vec::new();
    for way in 0..4 {
        match way {
            0 => rig.simulator.reset(&[0, 1])?,
            1 => rig.simulator.load(&start, &[0, 0], &[0, 1])?,
            2 => rig.place(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])?,
            _ => {
                rig.simulator.reset(&[0])?;
                rig.simulator.copy_state(&[0], &[1])?;
            }
        }
        let [nominal, changed] = ends(&rig.run(20, &[])?)?;
        let time = 20.0 * STEP;
        errors.push(both([nominal[2], changed[2]], [-G * time, -3.0 * time]));
    }
    Ok(largest(errors))
}

fn change_in_rollout(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pair(backend, FALLING, &["qvel.b"], &[("option/gravity/2", -3.0)])?;
    let rows = rig.run_with(10, 2, &[], |extras| {
        extras.changes.push(ParameterChange {
            frame: 6,
            column: 0,
            values: &[-1.0, -2.0],
        });
    })?;
    let frame = 2.0 * STEP;
    Ok(largest([
        relative(rows[5][2], -6.0 * G * frame),
        relative(rows[9][2], (-6.0 * G - 4.0) * frame),
        relative(rows[15][2], -18.0 * frame),
        relative(rows[19][2], -26.0 * frame),
    ]))
}

fn nonsense(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><geom name="floor" type="plane" size="1 1 .1"/>
      <body name="b"><joint name="j"/><geom name="g" type="sphere" size=".1" mass="1"/></body></worldbody>
      <actuator><motor name="m" joint="j"/></actuator>"#;
    let refused = |target: &str| {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &[target],
        };
        Rig::with(backend, inside, &[], size).is_err()
    };
    let forbidden = |target: &str, value: f64| {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &[target],
        };
        Rig::with(backend, inside, &[], size).map(|mut rig| rig.set(&[value]).is_err())
    };
    Ok(broken([
        refused("geom/missing/mass"),
        refused("geom/g/colour"),
        refused("geom/g/friction/3"),
        refused("body/world/mass"),
        refused("actuator/m/kp"),
        forbidden("body/b/mass", -1.0)?,
        forbidden("geom/g/friction/0", -0.1)?,
        forbidden("joint/j/damping", -0.1)?,
        forbidden("option/gravity/2", f64::INFINITY)?,
    ]))
}
