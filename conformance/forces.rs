//! External wrenches and hooks.

use asid_core::simulator::{ExternalForce, StepHook, StepView};
use asid_core::{Backend, Capabilities, Result};

use crate::check::{Check, Tolerance};
use crate::rig::{G, Rig, STEP, largest, last, relative};

const PUSHED: Capabilities = Capabilities::CONTACT.union(Capabilities::EXTERNAL_FORCES);
const HOOKED: Capabilities = Capabilities::ARTICULATION
    .union(Capabilities::ACTUATORS)
    .union(Capabilities::STEP_HOOKS);
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "forces/force-over-mass",
        needs: PUSHED,
        unit: "",
        tolerance: ROUNDING,
        reason: "constant acceleration is exact: rounding",
        measure: force_over_mass,
    },
    Check {
        name: "forces/force-acts-at-the-centre-of-mass",
        needs: PUSHED,
        unit: "rad/s",
        tolerance: ROUNDING,
        reason: "a force at the centre of mass turns nothing: rounding",
        measure: force_turns_nothing,
    },
    Check {
        name: "forces/torque-over-inertia",
        needs: PUSHED,
        unit: "",
        tolerance: ROUNDING,
        reason: "from rest about a principal axis, in the world frame: rounding",
        measure: torque_over_inertia,
    },
    Check {
        name: "forces/torque-moves-no-centre-of-mass",
        needs: PUSHED,
        unit: "m/s",
        tolerance: Tolerance::same(4.2e-3),
        reason: "the centre of mass is 0.2 m off the origin: first order, r w^2 dt at w = 3.2 rad/s",
        measure: torque_moves_nothing,
    },
    Check {
        name: "forces/wrench-on-a-link",
        needs: PUSHED.union(Capabilities::ARTICULATION),
        unit: "",
        tolerance: ROUNDING,
        reason: "one step from rest: lever times force and torque over inertia: rounding",
        measure: wrench_on_link,
    },
    Check {
        name: "forces/wrench-only-in-its-frames",
        needs: PUSHED,
        unit: "m/s",
        tolerance: ROUNDING,
        reason: "speed grows in the frame with the force, and neither before, after, nor in the next rollout: rounding",
        measure: only_in_its_frames,
    },
    Check {
        name: "forces/hook-adds-force",
        needs: HOOKED,
        unit: "",
        tolerance: ROUNDING,
        reason: "a generalised force of 0.5 N m beside a motor of 1 N m: rounding",
        measure: hook_adds,
    },
    Check {
        name: "forces/hook-changes-a-command",
        needs: HOOKED,
        unit: "",
        tolerance: ROUNDING,
        reason: "a command set in every second step acts in those only: rounding",
        measure: hook_commands,
    },
    Check {
        name: "forces/hook-sees-the-state",
        needs: HOOKED,
        unit: "",
        tolerance: Tolerance::same(1.1e-3),
        reason: "damping by hook from the velocity it is shown: first order, rate dt / 2 after one time constant",
        measure: hook_sees,
    },
];

/// A body of 2 kg whose centre of mass is not its origin, under a wrench on
/// each frame, and what it reads: centre of mass's velocity, then `qvel`.
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
    let on = [2.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut rig, rows) = pushed(backend, &[[0.0; 6], on, [0.0; 6]])?;
    let after = rig.run(1, &[])?[0][0];
    Ok(largest([
        rows[0][0],
        rows[1][0] - STEP,
        rows[2][0] - STEP,
        after - STEP,
    ]))
}

struct Adds;

impl StepHook for Adds {
    fn before_step(&self, _: usize, _: usize, view: &mut StepView<'_>) {
        view.force[0] += 0.5;
    }
}

struct Alternates;

impl StepHook for Alternates {
    fn before_step(&self, _: usize, step: usize, view: &mut StepView<'_>) {
        if step.is_multiple_of(2) {
            view.ctrl[0] = 3.0;
        }
    }
}

struct Damps;

impl StepHook for Damps {
    fn before_step(&self, _: usize, _: usize, view: &mut StepView<'_>) {
        view.force[0] -= 0.1 * view.qvel[0];
    }
}

/// A wheel of 0.1 kg m² under a motor and a hook: its rate after `frames` of two steps.
fn hooked(
    backend: &dyn Backend,
    hook: &dyn StepHook,
    start: f64,
    command: f64,
    frames: usize,
) -> Result<f64> {
    let inside = format!(
        r#"<option gravity="0 0 -{G}"/><worldbody><body><joint name="j" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
        <actuator><motor joint="j"/></actuator>"#
    );
    let mut rig = Rig::new(backend, &inside, &["qvel.j"])?;
    rig.place(&[0.0], &[start])?;
    let rows = rig.run_with(frames, 2, &[command], |extras| extras.hook = Some(hook))?;
    Ok(last(&rows)?[0])
}

fn hook_adds(backend: &dyn Backend) -> Result<f64> {
    let rate = hooked(backend, &Adds, 0.0, 1.0, 25)?;
    Ok(relative(rate, 1.5 / 0.1 * 50.0 * STEP))
}

fn hook_commands(backend: &dyn Backend) -> Result<f64> {
    let rate = hooked(backend, &Alternates, 0.0, 1.0, 25)?;
    Ok(relative(rate, 2.0 / 0.1 * 50.0 * STEP))
}

fn hook_sees(backend: &dyn Backend) -> Result<f64> {
    let rate = hooked(backend, &Damps, 2.0, 0.0, 250)?;
    Ok(relative(rate, 2.0 * (-1f64).exp()))
}
