//! Parameters of contact: friction, softness and position of a geom.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::pair::{both, ends, pair};
use crate::rig::{G, Rows, STEP, largest, last, relative};

const CONTACT: Capabilities = Capabilities::CONTACT.union(Capabilities::FREE_BODIES);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "parameters/sliding-friction",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "distance v^2 / (2 mu g) by the parameter's mu: as friction/stopping-distance",
        measure: Figure(sliding_friction),
    },
    Check {
        name: "parameters/torsional-friction",
        needs: CONTACT.union(Capabilities::TORSIONAL_FRICTION),
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "it turns by w^2 / (2 a) with a = mu_t g / (2/5 R^2) by the parameter's mu_t: as friction/spin-down",
        measure: Figure(torsional_friction),
    },
    Check {
        name: "parameters/rolling-friction",
        needs: CONTACT.union(Capabilities::ROLLING_FRICTION),
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "deceleration 5/7 mu_r g / R by the parameter's mu_r: as friction/roll-out-distance",
        measure: Figure(rolling_friction),
    },
    Check {
        name: "parameters/contact-softness",
        needs: CONTACT.union(Capabilities::CONTACT_STIFFNESS),
        unit: "",
        tolerance: Tolerance::same(0.02),
        reason: "at rest it sinks in by (1 - d) g / (d k) with k falling as the square of the time constant, d being constant",
        measure: Figure(softness),
    },
    Check {
        name: "parameters/geom-position-moves-its-contact",
        needs: CONTACT.union(Capabilities::MASS_PARAMETERS),
        unit: "m",
        tolerance: Tolerance::same(5e-4),
        reason: "a ball set 30 mm lower in its body holds that 30 mm higher: softness as contact/rest-height-of-shapes",
        measure: Figure(geom_position_contact),
    },
];

/// Radius of the ball, m.
const RADIUS: f64 = 0.05;

/// A ball that settles on a plane and is then launched; the plane's friction counts.
fn ball(
    backend: &dyn Backend,
    (condim, friction): (u32, &str),
    parameter: (&str, f64),
    qvel: [f64; 6],
    frames: usize,
) -> Result<Rows> {
    let inside = format!(
        r#"<option cone="elliptic" impratio="100"/><worldbody>
        <geom name="floor" type="plane" size="5 5 .1" condim="{condim}" friction="{friction}"/>
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
    let spin = [0.0, 0.0, 0.0, 0.0, 0.0, 60.0];
    let parameter = ("geom/floor/friction/1", 0.005);
    let rows = ball(backend, (4, "1 0.01 0"), parameter, spin, 700)?;
    let turned = |rows: &[Vec<f64>]| rows.iter().map(|row| row[12] * STEP).sum::<f64>();
    let slowing = |friction: f64| friction * G / (0.4 * RADIUS * RADIUS);
    let theory = [0.01, 0.005].map(|friction| 60.0 * 60.0 / (2.0 * slowing(friction)));
    Ok(both([turned(&rows[..700]), turned(&rows[700..])], theory))
}

fn rolling_friction(backend: &dyn Backend) -> Result<f64> {
    let roll = [0.5, 0.0, 0.0, 0.0, 10.0, 0.0];
    let parameter = ("geom/floor/friction/2", 0.004);
    let rows = ends(&ball(backend, (6, "1 0 0.002"), parameter, roll, 1250)?)?;
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
