//! Effects that act through a hook before each physics step: forces and commands.

use asid_core::simulator::{StepHook, StepView};
use asid_core::{Backend, Capabilities, Result};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, STEP, largest, last, relative};

const HOOKS: Capabilities = Capabilities::STEP_HOOKS;
const TREE: Capabilities = HOOKS.union(Capabilities::ARTICULATION);
const DRIVEN: Capabilities = TREE.union(Capabilities::ACTUATORS);
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "effects/hook-adds-force",
        needs: TREE,
        unit: "",
        tolerance: ROUNDING,
        reason: "a generalised force of 0.5 N m on 0.1 kg m^2, constant: rounding",
        measure: Figure(adds),
    },
    Check {
        name: "effects/hook-pushes-a-free-body",
        needs: HOOKS.union(Capabilities::FREE_BODIES),
        unit: "",
        tolerance: Tolerance::by_precision(1e-4, 2e-4),
        reason: "force at the origin in the world frame, torque in the body's, one step from rest: an integrator may see that the body turns by a dt^2 / 2 = 2e-5 rad within it",
        measure: Figure(pushes),
    },
    Check {
        name: "effects/hook-changes-a-command",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "a command set in every second step acts in those only: rounding",
        measure: Figure(commands),
    },
    Check {
        name: "effects/gain-and-bias",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "a motor behind gain 0.8 and bias -0.1 turns by 0.8 c - 0.1, a command as large as itself: rounding",
        measure: Figure(gain_and_bias),
    },
    Check {
        name: "effects/command-limit-holds-behind-a-hook",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "effects act on the way to the drive, whose range then counts: rounding",
        measure: Figure(limit_behind_hook),
    },
    Check {
        name: "effects/friction-by-hook-is-damping",
        needs: TREE.union(Capabilities::JOINT_IMPEDANCE),
        unit: "",
        tolerance: Tolerance::same(2.1e-3),
        reason: "a force of -d v by hook and a joint of damping d slow alike: each is off by rate dt / 2 = 0.001 after one time constant",
        measure: Figure(friction_is_damping),
    },
    Check {
        name: "effects/hook-sees-the-state",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::same(1.1e-3),
        reason: "damping by hook from the velocity it is shown: first order, rate dt / 2 after one time constant",
        measure: Figure(sees_state),
    },
];

/// A hook given by a function of the step and the view.
pub struct By<F>(pub F);

impl<F: Fn(usize, &mut StepView<'_>) + Sync> StepHook for By<F> {
    fn before_step(&self, _: usize, step: usize, view: &mut StepView<'_>) {
        (self.0)(step, view);
    }
}

/// A wheel of 0.1 kg m² with attributes of its joint and an actuator.
fn wheel(backend: &dyn Backend, joint: &str, actuator: &str) -> Result<Rig> {
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" {joint}/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>{actuator}"#
    );
    Rig::new(backend, &inside, &["qvel.j"])
}

const MOTOR: &str = r#"<actuator><motor joint="j"/></actuator>"#;

/// Rate of a wheel after some frames of two steps each under a hook.
fn rate(
    mut rig: Rig,
    start: f64,
    ctrl: &[f64],
    frames: usize,
    hook: impl Fn(usize, &mut StepView<'_>) + Sync,
) -> Result<f64> {
    rig.place(&[0.0], &[start])?;
    let hook = By(hook);
    let rows = rig.run_with(frames, 2, ctrl, |extras| extras.hook = Some(&hook))?;
    Ok(last(&rows)?[0])
}

fn adds(backend: &dyn Backend) -> Result<f64> {
    let rig = wheel(backend, "", "")?;
    let found = rate(rig, 0.0, &[], 25, |_, view| view.force[0] += 0.5)?;
    Ok(relative(found, 0.5 / 0.1 * 50.0 * STEP))
}

/// Velocities after one step under a force and a torque.
///
/// The force acts at the origin along the world's axes, the torque along the body's axes. The body
/// is rotated, and its centre of mass is not at its origin.
fn pushes(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
      <inertial pos=".1 -.05 .2" mass="2" diaginertia="0.1 0.2 0.25"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.b"])?;
    // A quarter turn about x makes the two frames differ.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    rig.place(&[0.0, 0.0, 0.0, half, half, 0.0, 0.0], &[0.0; 6])?;
    let (force, torque) = (Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.2, -0.3, 0.4));
    let both = [force.as_slice(), torque.as_slice()].concat();
    let hook = By(|_, view: &mut StepView<'_>| view.force.copy_from_slice(&both));
    let rows = rig.run_with(1, 1, &[], |extras| extras.hook = Some(&hook))?;
    let attitude = UnitQuaternion::from_quaternion(Quaternion::new(half, half, 0.0, 0.0));
    let center = Vector3::new(0.1, -0.05, 0.2);
    let about_center = torque - center.cross(&(attitude.inverse() * force));
    let turned = about_center.component_div(&Vector3::new(0.1, 0.2, 0.25));
    let moved = force / 2.0 - attitude * turned.cross(&center);
    let found = |from: usize| Vector3::from_column_slice(&rows[0][from..from + 3]);
    Ok(largest([
        (found(0) - moved * STEP).norm() / (moved * STEP).norm(),
        (found(3) - turned * STEP).norm() / (turned * STEP).norm(),
    ]))
}

fn commands(backend: &dyn Backend) -> Result<f64> {
    let rig = wheel(backend, "", MOTOR)?;
    let found = rate(rig, 0.0, &[1.0], 25, |step, view| {
        if step.is_multiple_of(2) {
            view.ctrl[0] = 3.0;
        }
    })?;
    Ok(relative(found, 2.0 / 0.1 * 50.0 * STEP))
}

fn gain_and_bias(backend: &dyn Backend) -> Result<f64> {
    let mut errors = Vec::new();
    for command in [1.0, -0.5] {
        let rig = wheel(backend, "", MOTOR)?;
        let found = rate(rig, 0.0, &[command], 25, |_, view| {
            view.ctrl[0] = 0.8 * view.ctrl[0] - 0.1;
        })?;
        let theory = (0.8 * command - 0.1) / 0.1 * 50.0 * STEP;
        errors.push(relative(found, theory));
    }
    Ok(largest(errors))
}

fn limit_behind_hook(backend: &dyn Backend) -> Result<f64> {
    let motor = r#"<actuator><motor joint="j" ctrlrange="-0.5 0.25"/></actuator>"#;
    let rig = wheel(backend, "", motor)?;
    let found = rate(rig, 0.0, &[0.2], 25, |_, view| view.ctrl[0] += 7.0)?;
    Ok(relative(found, 0.25 / 0.1 * 50.0 * STEP))
}

fn friction_is_damping(backend: &dyn Backend) -> Result<f64> {
    let hooked = rate(wheel(backend, "", "")?, 2.0, &[], 250, |_, view| {
        view.force[0] -= 0.1 * view.qvel[0];
    })?;
    let damped = wheel(backend, r#"damping="0.1""#, "")?;
    Ok(relative(hooked, rate(damped, 2.0, &[], 250, |_, _| {})?))
}

fn sees_state(backend: &dyn Backend) -> Result<f64> {
    let found = rate(wheel(backend, "", "")?, 2.0, &[], 250, |_, view| {
        view.force[0] -= 0.1 * view.qvel[0];
    })?;
    Ok(relative(found, 2.0 * (-1f64).exp()))
}
