//! Equality constraints: welds, coincident points, coupled joints.

use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, largest, last, period, relative};

const DRIVEN: Capabilities = Capabilities::ARTICULATION.union(Capabilities::ACTUATORS);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "joints/weld-holds-a-weight",
        needs: Capabilities::FREE_BODIES.union(Capabilities::EQUALITY),
        unit: "m",
        tolerance: Tolerance::same(1e-3),
        reason: "the default softness (20 ms, d = 0.9) yields (1 - d) g / (d k) = 0.4 mm: twice that",
        measure: Figure(weld_holds),
    },
    Check {
        name: "joints/coupling-shares-torque",
        needs: DRIVEN.union(Capabilities::EQUALITY),
        unit: "",
        tolerance: Tolerance::same(0.01),
        reason: "both wheels turn as one inertia of I (1 + 2^2); first order, dt / t = 0.002, and the softness of the coupling delays it by some of its 20 ms",
        measure: Figure(coupling),
    },
    Check {
        name: "joints/connect-holds-a-point",
        needs: Capabilities::FREE_BODIES.union(Capabilities::EQUALITY),
        unit: "m",
        tolerance: Tolerance::same(1.5e-3),
        reason: "the default softness yields 0.4 mm under g, and three times that under the pull of a swing from 1 rad",
        measure: Figure(connect_holds),
    },
    Check {
        name: "joints/connect-swings",
        needs: Capabilities::FREE_BODIES.union(Capabilities::EQUALITY),
        unit: "",
        tolerance: Tolerance::same(5e-3),
        reason: "a free body held by a point is a pendulum: its period, with (w dt)^2, and 1 mm of give in 500",
        measure: Figure(connect_swings),
    },
];

fn weld_holds(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><body name="post" pos="0 0 1"/>
      <body name="b" pos="0.1 0 1"><freejoint name="b"/>
        <geom type="sphere" size=".05" mass="1" contype="0" conaffinity="0"/></body></worldbody>
      <equality><weld body1="post" body2="b"/></equality>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.b"])?;
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    Ok(largest([end[0] - 0.1, end[1], end[2] - 1.0]))
}

/// Two wheels of 0.1 kg m²; the coupling makes the second turn twice as far as the first.
fn coupling(backend: &dyn Backend) -> Result<f64> {
    let wheel = |name: &str| {
        format!(
            r#"<body><joint name="{name}" axis="0 0 1"/>
            <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>"#
        )
    };
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody>{}{}</worldbody>
        <actuator><motor joint="a"/></actuator>
        <equality><joint joint1="b" joint2="a" polycoef="0 2 0 0 0"/></equality>"#,
        wheel("a"),
        wheel("b")
    );
    let mut rig = Rig::new(backend, &inside, &["qpos.a", "qpos.b"])?;
    let rows = rig.run(500, &[1.0])?;
    let end = last(&rows)?;
    Ok(largest([relative(end[0], 1.0), relative(end[1], 2.0)]))
}

/// A bob of 1 kg held by a point half a metre above it, released at 0.3 m/s: 5 s of positions.
fn connected(backend: &dyn Backend) -> Result<Vec<Vec<f64>>> {
    let inside = r#"<worldbody><body name="b" pos="0 0 1"><freejoint name="b"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/></body></worldbody>
      <equality><connect body1="b" body2="world" anchor="0 0 0.5"/></equality>"#;
    let mut rig = Rig::new(backend, inside, &["qpos.b"])?;
    // The velocity is a rotation about the anchor, so that the constraint holds from the start.
    rig.place(
        &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0],
        &[-0.3, 0.0, 0.0, 0.0, 0.6, 0.0],
    )?;
    rig.run(2500, &[])
}

fn connect_holds(backend: &dyn Backend) -> Result<f64> {
    // The anchor, half a metre along the body's z axis, compared with its initial position.
    Ok(largest(connected(backend)?.iter().flat_map(|q| {
        let (w, x, y, z) = (q[3], q[4], q[5], q[6]);
        [
            q[0] + 0.5 * 2.0 * (x * z + w * y),
            q[1] + 0.5 * 2.0 * (y * z - w * x),
            q[2] + 0.5 * (1.0 - 2.0 * (x * x + y * y)) - 1.5,
        ]
    })))
}

fn connect_swings(backend: &dyn Backend) -> Result<f64> {
    let places: Vec<f64> = connected(backend)?.iter().map(|q| q[0]).collect();
    let omega = (G * 0.5 / (0.25 + 1e-3)).sqrt();
    // The initial energy gives the amplitude, and the amplitude gives the period.
    let amplitude = 2.0 * (0.3 / (2.0 * 0.5 * omega)).asin();
    let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
    for _ in 0..5 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let theory = std::f64::consts::TAU / omega / a;
    Ok(relative(period(&places, 0.0), theory))
}
