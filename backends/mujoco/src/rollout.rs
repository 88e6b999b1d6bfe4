//! Frames and physics steps of one simulation, on its thread.

use asid_core::layout::{Channel, Recording};
use asid_core::simulator::{Control, Rollout, StepHook, StepView};
use mujoco_rs::mujoco_c::{mjtIntegrator, mjtStage};
use mujoco_rs::wrappers::mj_model::MjModel;

use crate::ffi::{BadNumber, Sim, is_bad};
use crate::history::CommandMemory;
use crate::target::Column;

/// What must be computed before a row can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Nothing: the row is part of the state.
    State,
    /// Positions, velocities and quantities derived from them.
    Velocity,
    /// Accelerations and forces.
    Acceleration,
}

impl Stage {
    /// The stage that a recording needs.
    #[must_use]
    pub fn of(record: &Recording, model: &MjModel) -> Self {
        let of = |channel: &Channel| match *channel {
            Channel::Position { .. } | Channel::Velocity { .. } => Self::State,
            Channel::ContactForce { .. } => Self::Acceleration,
            Channel::Sensor { index } => match model.sensor_needstage()[index] {
                mjtStage::mjSTAGE_ACC => Self::Acceleration,
                _ => Self::Velocity,
            },
        };
        record
            .channels()
            .iter()
            .map(of)
            .max()
            .unwrap_or(Self::State)
    }
}

/// What all simulations of a rollout share.
pub struct Frames<'a> {
    /// The rollout.
    pub rollout: &'a Rollout<'a>,
    /// The frames of the rollout to run.
    pub range: std::ops::Range<usize>,
    /// Length of a control row.
    pub nu: usize,
    /// What a row requires.
    pub stage: Stage,
    /// Address and length of each sensor.
    pub sensors: &'a [(usize, usize)],
    /// Whether a step can be taken in two halves.
    pub halves: bool,
    /// The batch's columns, which a hook may change.
    pub columns: &'a [Column],
    /// What actuators remember of commands.
    pub memory: &'a CommandMemory,
}

/// Whether the model's integrator allows a step in two halves; Runge-Kutta's stages do not.
#[must_use]
pub fn has_halves(model: &MjModel) -> bool {
    model.opt().integrator != mjtIntegrator::mjINT_RK4 as i32
}

/// One simulation's part of a rollout.
pub struct Job<'a> {
    /// Row of the rollout.
    pub row: usize,
    /// Whether its episode has begun but taken no step: actuators with a memory then settle on the
    /// first command.
    pub begun: bool,
    /// Its readings, `frames x width`.
    pub out: &'a mut [f64],
    /// Frames completed.
    pub frames: usize,
    /// Physics steps taken.
    pub steps: u64,
    /// Why and when it stopped; `None` if it did not.
    pub stopped: Option<(f64, BadNumber)>,
    /// The simulation's parameters: as set, as a hook wants them, and as the model has them. Empty
    /// without a hook.
    pub parameters: [Vec<f64>; 3],
}

/// Shows the parameters to a hook and writes its changes into the model; see
/// [`asid_core::Capabilities::LIVE_PARAMETERS`].
///
/// Returns whether the model changed, or `None` if a number is bad.
fn call_hook(
    job: &mut Job<'_>,
    sim: &mut Sim<'_>,
    frames: &Frames<'_>,
    (hook, step): (&dyn StepHook, usize),
    command: &[f64],
) -> Option<bool> {
    let [set, wanted, written] = &mut job.parameters;
    wanted.copy_from_slice(set);
    let time = sim.time();
    let (qpos, qvel, ctrl, force) = sim.hook_view();
    ctrl.copy_from_slice(command);
    force.fill(0.0);
    let mut view = StepView {
        time,
        qpos,
        qvel,
        ctrl,
        force,
        parameters: wanted,
    };
    hook.before_step(job.row, step, &mut view);
    let good = |x: &[f64]| !x.iter().any(|&x| is_bad(x));
    if !(good(view.ctrl) && good(view.force) && good(view.parameters)) {
        return None;
    }
    if wanted == written {
        return Some(false);
    }
    write_live(sim, frames.columns, wanted, written);
    Some(true)
}

/// Writes the live columns that differ from `written`.
fn write_live(sim: &mut Sim<'_>, columns: &[Column], wanted: &[f64], written: &mut [f64]) {
    for (column, (&value, before)) in columns.iter().zip(wanted.iter().zip(&mut *written)) {
        if value != *before {
            for &(field, entry, factor) in &column.entries {
                sim.write_live(field, entry, factor * value);
            }
            *before = value;
        }
    }
}

/// Runs the frames of one simulation.
///
/// It allocates nothing and owns nothing that needs dropping, as [`crate::ffi::Batch::apply`]
/// requires.
pub fn run(job: &mut Job<'_>, sim: &mut Sim<'_>, frames: &Frames<'_>) {
    let Frames {
        rollout, nu, stage, ..
    } = *frames;
    let width = rollout.record.width();
    // Whether the first half of the next step is done.
    let mut half_done = false;
    for frame in frames.range.clone() {
        let command = match rollout.control {
            Control::Shared(all) => &all[frame * nu..(frame + 1) * nu],
            Control::PerSimulation(all) => {
                let at = (job.row * rollout.frames + frame) * nu;
                &all[at..at + nu]
            }
        };
        sim.ctrl().copy_from_slice(command);
        for force in rollout.forces {
            let at = 6 * (job.row * rollout.frames + frame);
            let wrench = &mut sim.wrenches()[6 * force.body..6 * force.body + 6];
            wrench.copy_from_slice(&force.wrench[at..at + 6]);
        }
        for substep in 0..rollout.substeps {
            if let Some(hook) = rollout.hook {
                let step = frame * rollout.substeps + substep;
                match call_hook(job, sim, frames, (hook, step), command) {
                    // The first half of a step used the previous parameters.
                    Some(changed) => half_done &= !changed,
                    None => {
                        job.stopped = Some((sim.time(), BadNumber::Command));
                        return;
                    }
                }
            }
            if std::mem::take(&mut job.begun) {
                frames.memory.hold(sim);
            }
            if std::mem::take(&mut half_done) {
                sim.step2();
            } else {
                sim.step();
            }
            job.steps += 1;
            if let Some(bad) = sim.bad_number() {
                job.stopped = Some((sim.time(), bad));
                return;
            }
        }
        prepare(sim, stage);
        half_done = frames.halves && stage != Stage::State;
        read(
            sim,
            rollout.record,
            frames.sensors,
            &mut job.out[frame * width..(frame + 1) * width],
        );
        job.frames = frame + 1;
    }
    // Forces belong to the rollout, not to the state that it leaves.
    sim.wrenches().fill(0.0);
    sim.hook_view().3.fill(0.0);
    let [set, _, written] = &mut job.parameters;
    write_live(sim, frames.columns, set, written);
}

/// Computes what a row requires in the current state.
pub fn prepare(sim: &mut Sim<'_>, stage: Stage) {
    match stage {
        Stage::State => {}
        Stage::Velocity => sim.step1(),
        Stage::Acceleration => sim.forward(),
    }
}

/// Writes one row, once it is [`prepare`]d.
pub fn read(sim: &Sim<'_>, record: &Recording, sensors: &[(usize, usize)], row: &mut [f64]) {
    for (i, channel) in record.channels().iter().enumerate() {
        let out = &mut row[record.range(i)];
        match *channel {
            Channel::Position { start, len } => {
                out.copy_from_slice(&sim.qpos()[start..start + len]);
            }
            Channel::Velocity { start, len } => {
                out.copy_from_slice(&sim.qvel()[start..start + len]);
            }
            Channel::Sensor { index } => {
                let (at, len) = sensors[index];
                out.copy_from_slice(&sim.sensordata()[at..at + len]);
            }
            Channel::ContactForce { bodies } => out[0] = sim.contact_force(bodies),
        }
    }
}
