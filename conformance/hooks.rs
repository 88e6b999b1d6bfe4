//! What a hook sees, and when: the state before the step, once per step, at its time.

use std::sync::Mutex;

use asid_core::registry;
use asid_core::simulator::{StepHook, StepView};
use asid_core::{Backend, Capabilities, Error, Result};
use asid_effects::EffectEntry;
use asid_effects::{Acts, Site};
use asid_mjcf::Plant;

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::effects::By;
use crate::rig::{Rig, STEP, broken, differing_bits, largest, saves, scene, state_channels};
use crate::subject::{batch, stirred, subject};

const HOOKS: Capabilities = Capabilities::STEP_HOOKS;
const NONE: Tolerance = Tolerance::same(0.0);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "effects/hook-sees-the-step-before",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "positions and velocities shown are those recorded at the end of the step before: readings that differ in any bit",
        measure: Figure(sees_step_before),
    },
    Check {
        name: "effects/hook-is-called-once-a-step",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "each row of the rollout, each step, in order, with the command of its frame and no force: broken of four",
        measure: Figure(once_a_step),
    },
    Check {
        name: "effects/hook-sees-the-time-of-the-state",
        needs: HOOKS,
        unit: "s",
        tolerance: Tolerance::by_precision(1e-9, 1e-6),
        reason: "zero after a reset, on by a step each step, back to its own where a state is loaded: rounding",
        measure: Figure(sees_time),
    },
    Check {
        name: "effects/hook-that-does-nothing",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "to the bit: readings that differ from those without a hook",
        measure: Figure(idle),
    },
    Check {
        name: "effects/null-values-change-nothing",
        needs: HOOKS,
        unit: "",
        tolerance: NONE,
        reason: "every effect that is registered, at each of its sites, to the bit: readings that differ from those without it",
        measure: Figure(null_values),
    },
];

/// What a hook saw in one call.
struct Call {
    row: usize,
    step: usize,
    time: f64,
    state: Vec<f64>,
    ctrl: Vec<f64>,
    force: Vec<f64>,
}

/// Records what it sees.
#[derive(Default)]
struct Diary(Mutex<Vec<Call>>);

impl Diary {
    /// The calls of a row in their order.
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

/// Records positions of all joints, then their velocities, in the order of a hook's view.
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
    let saved = saves(backend)
        .then(|| rig.simulator.save(&[0]))
        .transpose()?;
    compare(times(&mut rig)?, 10);
    if let Some(saved) = saved {
        rig.simulator.load(&saved, &[0], &[0])?;
        compare(times(&mut rig)?, 10);
    }
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
    let without = rig.run(30, &ctrl)?;
    let plant = Plant::of(&scene(&subject(backend).inside)?)?;
    let mut different = 0.0;
    for entry in registry::all::<EffectEntry>() {
        let effect = (entry.make)();
        if effect.acts() == Acts::Measurement || !effect.targets(&plant, "").is_empty() {
            continue;
        }
        let values: Vec<f64> = effect.parameters().iter().map(|p| p.null).collect();
        for name in effect.sites(&plant) {
            if !effect.targets(&plant, &name).is_empty() {
                continue;
            }
            let acting = effect.attach(&Site {
                plant: &plant,
                name: &name,
                values: &values,
                columns: &[],
                episode: 0,
            })?;
            let acting = Mutex::new(acting);
            let hook = By(|_, view: &mut StepView<'_>| {
                if let Ok(mut acting) = acting.lock() {
                    acting.before_step(view);
                }
            });
            rig.simulator.reset(&[0])?;
            let with = rig.run_with(30, 1, &ctrl, |extras| extras.hook = Some(&hook))?;
            different += differing_bits(&with, &without);
        }
    }
    Ok(different)
}
