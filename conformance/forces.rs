//! External wrenches.

use asid_core::simulator::ExternalForce;
use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, STEP, largest, last, relative};
use crate::subject::falling;

const PUSHED: Capabilities = Capabilities::FREE_BODIES.union(Capabilities::EXTERNAL_FORCES);
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "forces/force-over-mass",
        needs: PUSHED,
        unit: "",
        tolerance: ROUNDING,
        reason: "constant acceleration is exact: rounding",
        measure: Figure(force_over_mass),
    },
    Check {
        name: "forces/force-acts-at-the-centre-of-mass",
        needs: PUSHED,
        unit: "rad/s",
        tolerance: ROUNDING,
        reason: "a force at the centre of mass turns nothing: rounding",
        measure: Figure(force_turns_nothing),
    },
    Check {
        name: "forces/torque-over-inertia",
        needs: PUSHED,
        unit: "",
        tolerance: ROUNDING,
        reason: "from rest about a principal axis, in the world frame: rounding",
        measure: Figure(torque_over_inertia),
    },
    Check {
        name: "forces/torque-moves-no-centre-of-mass",
        needs: PUSHED,
        unit: "m/s",
        tolerance: Tolerance::same(4.2e-3),
        reason: "the centre of mass is 0.2 m off the origin: first order, r w^2 dt at w = 3.2 rad/s",
        measure: Figure(torque_moves_nothing),
    },
    Check {
        name: "forces/wrench-on-a-link",
        needs: Capabilities::ARTICULATION.union(Capabilities::EXTERNAL_FORCES),
        unit: "",
        tolerance: Tolerance::by_precision(2e-5, 1e-4),
        reason: "one step from rest, lever times force and torque over inertia: an integrator may see that the link turns by 2.7e-6 rad within it, times 7 N m / 2 over 1 N m",
        measure: Figure(wrench_on_link),
    },
    Check {
        name: "forces/wrench-only-in-its-frames",
        needs: Capabilities::EXTERNAL_FORCES,
        unit: "m/s",
        tolerance: ROUNDING,
        reason: "speed grows in the frame with the force, and neither before, after, nor in the next rollout: rounding",
        measure: Figure(only_in_its_frames),
    },
];

/// A body of 2 kg with its centre of mass off its origin, under one wrench per frame.
///
/// The readings are the velocity of its centre of mass, then `qvel`.
fn pushed(backend: &dyn Backend, wrenches: &[[f64; 6]]) -> Result<(Rig, Vec<Vec<f64>>)> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
      <inertial pos="0.2 0 0" mass="2" diaginertia="0.1 0.2 0.25"/></body></worldbody>
      <sensor><framelinvel name="com" objtype="body" objname="b"/></sensor>"#;
    let mut rig = Rig::new(backend, inside, &["com", "qvel.b"])?;
    let body = rig.simulator.layout().body("b")?;
    let wrench: Vec<f64> = wrenches.concat();
    let rows = rig.run_with(wrenches.len(), 1, &[], |extras| {
        extras.forces.push(ExternalForce {
            body,
            wrench: &wrench,
        });
    })?;
    Ok((rig, rows))
}

fn force_over_mass(backend: &dyn Backend) -> Result<f64> {
    let (_, rows) = pushed(backend, &[[1.0, -2.0, 3.0, 0.0, 0.0, 0.0]; 50])?;
    let end = last(&rows)?;
    Ok(largest((0..3).map(|i| {
        relative(end[i], [1.0, -2.0, 3.0][i] / 2.0 * 50.0 * STEP)
    })))
}

fn force_turns_nothing(backend: &dyn Backend) -> Result<f64> {
    let (_, rows) = pushed(backend, &[[1.0, -2.0, 3.0, 0.0, 0.0, 0.0]; 50])?;
    Ok(largest(last(&rows)?[6..9].iter().copied()))
}

fn torque_over_inertia(backend: &dyn Backend) -> Result<f64> {
    let mut errors = Vec::new();
    for (axis, inertia) in [0.1, 0.2, 0.25].into_iter().enumerate() {
        let mut wrench = [0.0; 6];
        wrench[3 + axis] = 0.3;
        let (_, rows) = pushed(backend, &[wrench])?;
        errors.push(relative(rows[0][6 + axis], 0.3 / inertia * STEP));
    }
    Ok(largest(errors))
}

fn torque_moves_nothing(backend: &dyn Backend) -> Result<f64> {
    let (_, rows) = pushed(backend, &[[0.0, 0.0, 0.0, 0.0, 0.0, 8.0]; 50])?;
    Ok(largest(last(&rows)?[..3].iter().copied()))
}

fn wrench_on_link(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b" pos="1 2 3"><joint name="j" axis="0 0 1"/>
      <inertial pos="0.5 0 0" mass="2" diaginertia="0.1 0.2 0.25"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.j"])?;
    let body = rig.simulator.layout().body("b")?;
    let wrench = [7.0, 3.0, 0.0, 0.0, 0.0, -0.5];
    let rows = rig.run_with(1, 1, &[], |extras| {
        extras.forces.push(ExternalForce {
            body,
            wrench: &wrench,
        });
    })?;
    let theory = (0.5 * 3.0 - 0.5) / (0.25 + 2.0 * 0.25) * STEP;
    Ok(relative(rows[0][0], theory))
}

fn only_in_its_frames(backend: &dyn Backend) -> Result<f64> {
    let falling = falling(backend);
    let inside = format!(r#"<option gravity="0 0 0"/>{}"#, falling.inside);
    let mut rig = Rig::new(backend, &inside, falling.velocity)?;
    let body = rig.simulator.layout().body(falling.body)?;
    let wrench = [[0.0; 6], [2.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 6]].concat();
    let rows = rig.run_with(3, 1, &[], |extras| {
        extras.forces.push(ExternalForce {
            body,
            wrench: &wrench,
        });
    })?;
    let after = rig.run(1, &[])?[0][0];
    let speed = 2.0 * STEP;
    Ok(largest([
        rows[0][0],
        rows[1][0] - speed,
        rows[2][0] - speed,
        after - speed,
    ]))
}
