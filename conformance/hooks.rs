//! The door for effects: a hook before each physics step, and what effects do there.

use std::sync::Mutex;

use asid_core::registry::{self, EffectEntry};
use asid_core::simulator::{StepHook, StepView};
use asid_core::{Backend, Capabilities, Error, Result};

use crate::check::{Check, Tolerance};
use crate::rig::{Rig, STEP, broken, differing_bits, largest, last, relative, state_channels};
use crate::subject::{batch, stirred};

const HOOKS: Capabilities = Capabilities::STEP_HOOKS;
const TREE: Capabilities = HOOKS.union(Capabilities::ARTICULATION);
const DRIVEN: Capabilities = TREE.union(Capabilities::ACTUATORS);
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);
const NONE: Tolerance = Tolerance::same(0.0);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "effects/hook-adds-force",
        needs: TREE,
        unit: "",
        tolerance: ROUNDING,
        reason: "a generalised force of 0.5 N m on 0.1 kg m^2, constant: rounding",
        measure: adds,
    },
    Check {
        name: "effects/hook-pushes-a-free-body",
        needs: HOOKS.union(Capabilities::FREE_BODIES),
        unit: "",
        tolerance: ROUNDING,
        reason: "force over mass in the world frame, torque over inertia in the body's: one step from rest, rounding",
        measure: pushes,
    },
    Check {
        name: "effects/hook-changes-a-command",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "a command set in every second step acts in those only: rounding",
        measure: commands,
    },
    Check {
        name: "effects/gain-and-bias",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "a motor behind gain 0.8 and bias -0.1 turns by 0.8 c - 0.1, a command as large as itself: rounding",
        measure: gain_and_bias,
    },
    Check {
        name: "effects/command-limit-holds-behind-a-hook",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "effects act on the way to the drive, whose range then counts: rounding",
        measure: limit_behind_hook,
    },
    Check {
        name: "effects/friction-by-hook-is-damping",
        needs: TREE.union(Capabilities::JOINT_IMPEDANCE),
        unit: "",
        tolerance: Tolerance::same(2.1e-3),
        reason: "a force of -d v by hook and a joint of damping d slow alike: each is off by rate dt / 2 = 0.001 after one time constant",
        measure: friction_is_damping,
    },
    Check {
        name: "effects/hook-sees-the-state",
        needs: TREE,
        unit: "",
        tolerance: Tolerance::same(1.1e-3),
        reason: "damping by hook from the velocity it is shown: first order, rate dt / 2 after one time constant",
        measure: sees_state,
    },
    Check {
        name: "effects/hook-sees-the-step-before",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "positions and velocities shown are those recorded at the end of the step before: readings that differ in any bit",
        measure: sees_step_before,
    },
    Check {
        name: "effects/hook-is-called-once-a-step",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "each row of the rollout, each step, in order, with the command of its frame and no force: broken of four",
        measure: once_a_step,
    },
    Check {
        name: "effects/hook-sees-the-time-of-the-state",
        needs: HOOKS,
        unit: "s",
        tolerance: Tolerance::by_precision(1e-9, 1e-6),
        reason: "zero after a reset, on by a step each step, back to its own where a state is loaded: rounding",
        measure: sees_time,
    },
    Check {
        name: "effects/hook-that-does-nothing",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "to the bit: readings that differ from those without a hook",
        measure: idle,
    },
    Check {
        name: "effects/null-values-change-nothing",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "every effect that is registered, at each of its sites, to the bit: readings that differ from those without it",
        measure: null_values,
    },
];

/// A hook made of a function of the step and the view.
struct By<F>(F);

impl<F: Fn(usize, &mut StepView<'_>) + Sync> StepHook for By<F> {
    fn before_step(&self, _: usize, step: usize, view: &mut StepView<'_>) {
        (self.0)(step, view);
    }
}

/// A wheel of 0.1 kg m² with what acts on its joint and what drives it.
fn wheel(backend: &dyn Backend, joint: &str, actuator: &str) -> Result<Rig> {
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody><body><joint name="j" axis="0 0 1" {joint}/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>{actuator}"#
    );
    Rig::new(backend, &inside, &["qvel.j"])
}

const MOTOR: &str = r#"<actuator><motor joint="j"/></actuator>"#;

/// Rate of a wheel after some frames of two steps under a hook.
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

fn pushes(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.1 0.2 0.25"/></body></worldbody>"#;
    let mut rig = Rig::new(backend, inside, &["qvel.b"])?;
    // A quarter turn about x, so that the frames differ.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    rig.place(&[0.0, 0.0, 0.0, half, half, 0.0, 0.0], &[0.0; 6])?;
    let force = [1.0, -2.0, 3.0, 0.2, -0.3, 0.4];
    let hook = By(|_, view: &mut StepView<'_>| view.force.copy_from_slice(&force));
    let rows = rig.run_with(1, 1, &[], |extras| extras.hook = Some(&hook))?;
    let inertia = [2.0, 2.0, 2.0, 0.1, 0.2, 0.25];
    Ok(largest((0..6).map(|i| {
        relative(rows[0][i], force[i] / inertia[i] * STEP)
    })))
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

/// What a hook was shown in one call.
struct Call {
    row: usize,
    step: usize,
    time: f64,
    state: Vec<f64>,
    ctrl: Vec<f64>,
    force: Vec<f64>,
}

/// Writes down what it is shown.
#[derive(Default)]
struct Diary(Mutex<Vec<Call>>);

impl Diary {
    /// The calls of a row, in the order in which they came.
    fn of(self, row: usize) -> Result<Vec<Call>> {
        let calls = self.0.into_inner();
        let calls = calls.map_err(|_| Error::Failed("a hook panicked".into()))?;
        Ok(calls.into_iter().filter(|call| call.row == row).collect())
    }
}

impl StepHook for Diary {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        if let Ok(mut calls) = self.0.lock() {
            calls.push(Call {
                row,
                step,
                time: view.time,
                state: [view.qpos, view.qvel].concat(),
                ctrl: view.ctrl.to_vec(),
                force: view.force.to_vec(),
            });
        }
    }
}

/// Positions of all joints, then their velocities, as a hook is shown them.
fn record_state(rig: &mut Rig) -> Result<()> {
    let layout = rig.model.layout();
    let names = state_channels(layout);
    rig.record = layout.recording(&names)?;
    Ok(())
}

fn sees_step_before(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 1, 1)?;
    record_state(&mut rig)?;
    let mut expected = rig.read()?;
    let diary = Diary::default();
    let ctrl = rig.command(0.4);
    expected.extend(rig.run_with(40, 1, &ctrl, |extras| extras.hook = Some(&diary))?);
    expected.pop();
    let shown: Vec<Vec<f64>> = diary.of(0)?.into_iter().map(|call| call.state).collect();
    Ok(differing_bits(&shown, &expected))
}

fn once_a_step(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 2)?;
    let diary = Diary::default();
    let ctrl = rig.command(0.4);
    rig.run_with(5, 3, &ctrl, |extras| {
        extras.sims = vec![0, 2];
        extras.hook = Some(&diary);
    })?;
    let calls = diary.0.into_inner();
    let calls = calls.map_err(|_| Error::Failed("a hook panicked".into()))?;
    let in_order = |row: usize| {
        let steps = calls.iter().filter(|c| c.row == row).map(|c| c.step);
        steps.eq(0..15)
    };
    Ok(broken([
        calls.len() == 30,
        in_order(0) && in_order(1),
        calls.iter().all(|c| c.ctrl == ctrl),
        calls.iter().all(|c| c.force.iter().all(|f| *f == 0.0)),
    ]))
}

fn sees_time(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 1, 1)?;
    let ctrl = rig.command(0.4);
    let times = |rig: &mut Rig| -> Result<Vec<f64>> {
        let diary = Diary::default();
        rig.run_with(5, 2, &ctrl, |extras| extras.hook = Some(&diary))?;
        Ok(diary.of(0)?.into_iter().map(|call| call.time).collect())
    };
    let mut errors = Vec::new();
    let mut compare = |found: Vec<f64>, from: usize| {
        errors.push(found.len() as f64 - 10.0);
        errors.extend((found.iter().enumerate()).map(|(i, t)| t - (from + i) as f64 * STEP));
    };
    compare(times(&mut rig)?, 0);
    let saved = rig.simulator.save(&[0])?;
    compare(times(&mut rig)?, 10);
    rig.simulator.load(&saved, &[0], &[0])?;
    compare(times(&mut rig)?, 10);
    rig.simulator.reset(&[0])?;
    compare(times(&mut rig)?, 0);
    Ok(largest(errors))
}

fn idle(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, mut other) = (stirred(backend, 3, 2)?, stirred(backend, 3, 2)?);
    let ctrl = rig.command(0.4);
    let nothing = By(|_, _: &mut StepView<'_>| {});
    let with = rig.run_with(60, 2, &ctrl, |extras| extras.hook = Some(&nothing))?;
    let without = other.run_with(60, 2, &ctrl, |_| {})?;
    Ok(differing_bits(&with, &without))
}

fn null_values(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 1, 1)?;
    let ctrl = rig.command(0.4);
    let start = rig.simulator.save(&[0])?;
    let without = rig.run(30, &ctrl)?;
    let mut different = 0.0;
    for entry in registry::all::<EffectEntry>() {
        let effect = (entry.make)();
        let nulls: Vec<f64> = effect.parameters().iter().map(|p| p.null).collect();
        let layout = rig.model.layout();
        let hooks: Result<Vec<_>> = (effect.sites(layout).iter())
            .map(|site| effect.attach(layout, site, &nulls))
            .collect();
        for hook in hooks? {
            rig.simulator.load(&start, &[0], &[0])?;
            let with = rig.run_with(30, 1, &ctrl, |extras| extras.hook = Some(&*hook))?;
            different += differing_bits(&with, &without);
        }
    }
    Ok(different)
}
