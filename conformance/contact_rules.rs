//! Which geoms collide, whose friction counts, and between which bodies a force is read.

use asid_core::simulator::ExternalForce;
use asid_core::{Backend, Capabilities, Result};
use nalgebra::{UnitQuaternion, Vector3};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, STEP, broken, largest, last, relative};

const CONTACT: Capabilities = Capabilities::CONTACT.union(Capabilities::FREE_BODIES);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "contact/who-meets-whom",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "contype and conaffinity of either side suffice, <exclude> counts: wrong of three",
        measure: Figure(who_meets),
    },
    Check {
        name: "contact/parent-and-child-do-not-meet",
        needs: Capabilities::CONTACT.union(Capabilities::ARTICULATION),
        unit: "",
        tolerance: Tolerance::by_precision(1e-7, 1e-4),
        reason: "one step of fall about the hinge: the lever shortens by half the square of 1.8e-4 rad within it",
        measure: Figure(parent_and_child),
    },
    Check {
        name: "contact/explicit-pair",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "a <pair> meets whatever contype says, and its friction counts: as friction/stopping-distance",
        measure: Figure(explicit_pair),
    },
    Check {
        name: "friction/priority-decides",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "the friction of the geom of higher priority counts, even where it is the smaller: as friction/stopping-distance",
        measure: Figure(priority),
    },
    Check {
        name: "friction/ball-rolls-down-a-tilted-plane",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(4e-3),
        reason: "5/7 g sin a t^2 / 2: first order, dt / t = 0.002, and 2/7 of 0.8 % for the radius that softness leaves",
        measure: Figure(tilted_plane),
    },
    Check {
        name: "contact/tips-over-when-pushed",
        needs: CONTACT.union(Capabilities::EXTERNAL_FORCES),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "a block of half width b and half height h stands under 0.9 m g b / h and tips under 1.1 of it: wrong of two",
        measure: Figure(tips_when_pushed),
    },
    Check {
        name: "contact/does-not-bounce-by-default",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "the default contact is critically damped: a hundredth of the height for the step in which it begins",
        measure: Figure(no_bounce),
    },
    Check {
        name: "contact/force-between-whom",
        needs: CONTACT.union(Capabilities::CONTACT_FORCES),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "the same for either order of the bodies, zero between bodies that do not touch: wrong of four",
        measure: Figure(force_between),
    },
];

fn who_meets(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody>
        <geom type="plane" size="5 5 .1" contype="1" conaffinity="0"/>
        <body name="falls" pos="0 0 0.05"><freejoint name="falls"/>
          <geom type="box" size=".05 .05 .05" mass="1" contype="2" conaffinity="4"/></body>
        <body name="stands" pos="1 0 0.05"><freejoint name="stands"/>
          <geom type="box" size=".05 .05 .05" mass="1" contype="0" conaffinity="1"/></body>
        <body name="excluded" pos="2 0 0.05"><freejoint name="excluded"/>
          <geom type="box" size=".05 .05 .05" mass="1" contype="0" conaffinity="1"/></body>
      </worldbody><contact><exclude body1="world" body2="excluded"/></contact>"#;
    let channels = ["qpos.falls", "qpos.stands", "qpos.excluded"];
    let mut rig = Rig::new(backend, inside, &channels)?;
    let rows = rig.run(250, &[])?;
    let end = last(&rows)?;
    // A body that collides with nothing has fallen freely for half a second.
    let fallen = 0.05 - 0.5 * G * 0.25;
    let near = |z: f64, height: f64| (z - height).abs() < 2.0 * G * STEP;
    Ok(broken([
        near(end[2], fallen),
        near(end[9], 0.05),
        near(end[16], fallen),
    ]))
}

fn parent_and_child(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 -9.81"/><worldbody><body><joint name="a" axis="0 0 1"/>
        <geom type="box" size=".2 .2 .2" mass="5"/>
        <body><joint name="b" axis="0 1 0"/>
          <geom type="sphere" size=".05" pos=".1 0 0" mass="1"/></body></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.b"])?;
    let rows = rig.run(1, &[])?;
    let inertia = 0.1 * 0.1 + 0.4 * 0.05 * 0.05;
    Ok(relative(rows[0][0], G * 0.1 / inertia * STEP))
}

/// Position at which a block with an initial speed of 1 m/s stops, on a plane with these
/// attributes.
fn stop(backend: &dyn Backend, plane: &str, block: &str, more: &str) -> Result<f64> {
    let inside = format!(
        r#"<option cone="elliptic" impratio="100"/><worldbody>
        <geom name="floor" type="plane" size="5 5 .1" {plane}/>
        <body pos="0 0 0.05"><freejoint name="b"/>
          <geom name="block" type="box" size=".1 .08 .05" mass="0.5" {block}/></body></worldbody>{more}"#
    );
    let mut rig = Rig::new(backend, &inside, &["qpos.b"])?;
    let height = last(&rig.run(150, &[])?)?[2];
    rig.place(
        &[0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0],
        &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    )?;
    Ok(last(&rig.run(400, &[])?)?[0])
}

fn explicit_pair(backend: &dyn Backend) -> Result<f64> {
    let ghost = r#"friction="0.9" contype="0" conaffinity="0""#;
    let pair = r#"<contact><pair geom1="floor" geom2="block" condim="3" friction="0.3 0.3 0 0 0"/></contact>"#;
    let found = stop(backend, ghost, ghost, pair)?;
    Ok(relative(found, 1.0 / (2.0 * 0.3 * G)))
}

fn priority(backend: &dyn Backend) -> Result<f64> {
    let (low, high) = (r#"friction="0.9""#, r#"friction="0.3" priority="1""#);
    let theory = 1.0 / (2.0 * 0.3 * G);
    let found = [stop(backend, low, high, "")?, stop(backend, high, low, "")?];
    Ok(largest(found.map(|x| relative(x, theory))))
}

fn tilted_plane(backend: &dyn Backend) -> Result<f64> {
    let (angle, radius) = (0.2f64, 0.05);
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.4, 0.0) / 0.5 * angle);
    let normal = tilt * Vector3::z();
    let at = normal * radius;
    let inside = format!(
        r#"<option cone="elliptic" impratio="1000"/><worldbody>
        <geom type="plane" size="9 9 .1" friction="1 0 0" quat="{:?} {:?} {:?} {:?}"/>
        <body pos="{:?} {:?} {:?}"><freejoint name="b"/>
          <geom type="sphere" size="{radius}" mass="0.3" friction="1 0 0"/></body></worldbody>"#,
        tilt.w, tilt.i, tilt.j, tilt.k, at.x, at.y, at.z
    );
    let mut rig = Rig::new(backend, &inside, &["qpos.b"])?;
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    let moved = Vector3::new(end[0], end[1], end[2]) - at;
    let down = (-Vector3::z() + normal * normal.z).normalize();
    let theory = 5.0 / 7.0 * G * angle.sin() / 2.0;
    let aside = (moved - down * moved.dot(&down)).norm();
    Ok(largest([
        relative(moved.dot(&down), theory),
        aside / theory,
    ]))
}

fn tips_when_pushed(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option cone="elliptic" impratio="100"/><worldbody>
        <geom type="plane" size="5 5 .1" friction="1"/>
        <body name="b" pos="0 0 .1"><freejoint name="b"/>
          <geom type="box" size=".05 .08 .1" mass="0.5" friction="1"/></body></worldbody>"#;
    let mut stands = [false; 2];
    for (stands, share) in stands.iter_mut().zip([0.9, 1.1]) {
        let mut rig = Rig::new(backend, inside, &["qpos.b"])?;
        let body = rig.simulator.layout().body("b")?;
        rig.run(150, &[])?;
        let force = [share * 0.5 * G * 0.05 / 0.1, 0.0, 0.0, 0.0, 0.0, 0.0];
        let wrench = force.repeat(500);
        let rows = rig.run_with(500, 1, &[], |extras| {
            extras.forces.push(ExternalForce {
                body,
                wrench: &wrench,
            });
        })?;
        // The vertical component of its axis: 1 if it stands, 0.995 at a tilt of a tenth of a
        // radian.
        let end = last(&rows)?;
        *stands = 1.0 - 2.0 * (end[4] * end[4] + end[5] * end[5]) > 0.995;
    }
    Ok(broken([stands[0], !stands[1]]))
}

fn no_bounce(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><geom type="plane" size="1 1 .1"/>
      <body pos="0 0 0.3"><freejoint name="b"/><geom type="sphere" size=".1" mass="0.5"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.b"])?;
    let rows = rig.run(500, &[])?;
    let heights: Vec<f64> = rows.iter().map(|r| r[2] - 0.1).collect();
    let landed = heights.iter().position(|h| *h < 0.0);
    let landed = landed.unwrap_or(heights.len());
    let highest = heights[landed..].iter().copied().fold(f64::NAN, f64::max);
    Ok(highest.max(0.0) / 0.2)
}

fn force_between(backend: &dyn Backend) -> Result<f64> {
    let cube = |name: &str, z: f64| {
        format!(
            r#"<body name="{name}" pos="0 0 {z}"><freejoint name="{name}"/>
            <geom type="box" size=".05 .05 .05" mass="0.3"/></body>"#
        )
    };
    let inside = format!(
        r#"<worldbody><geom type="plane" size="1 1 .1"/>{}{}{}</worldbody>"#,
        cube("low", 0.05),
        cube("high", 0.15),
        cube("far", 5.0)
    );
    let channels = [
        "contact.low/high",
        "contact.high/low",
        "contact.world/high",
        "contact.low/far",
    ];
    let mut rig = Rig::new(backend, &inside, &channels)?;
    let rows = rig.run(200, &[])?;
    let end = last(&rows)?;
    Ok(broken([
        end[0].to_bits() == end[1].to_bits(),
        end[0] > 0.0,
        end[2] == 0.0,
        end[3] == 0.0,
    ]))
}
