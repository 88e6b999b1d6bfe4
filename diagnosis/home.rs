//! Home of a machine: coordinates of an initial state that no sensor reads are taken from it.
//!
//! It is the first keyframe of the model, or where its document places its bodies. A vehicle whose
//! wheels just touch the ground falls by a millimetre from there, and its accelerometer reads free
//! fall. The machine has stood still before its log. So it begins where the model comes to rest
//! under the first command, if replays of the logs' first rows from there leave less.

use asid_core::layout::{Keyframe, Layout};
use asid_core::{BatchConfig, Control, Model, Recording, Result, Rollout, Simulator};

/// Time in which a machine comes to rest, s: some periods of a body on its contacts.
const SETTLES: f64 = 2.0;
/// Speed below which a coordinate is at rest, m/s or rad/s: over a log of some seconds it moves by
/// less than a sensor resolves.
const REST: f64 = 1e-3;

/// Makes a simulation of a model, and a recording of its state.
fn simulation(model: &dyn Model) -> Result<(Box<dyn Simulator>, Recording)> {
    let layout = model.layout();
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: Vec::new(),
    };
    let recording = layout.recording(&layout.state_channels())?;
    Ok((model.simulator(&config)?, recording))
}

/// Makes a keyframe of a state.
fn keyframe(layout: &Layout, state: &[f64], ctrl: &[f64]) -> Keyframe {
    let (qpos, qvel) = state.split_at(layout.nq);
    Keyframe {
        name: "home".into(),
        qpos: qpos.to_vec(),
        qvel: qvel.to_vec(),
        ctrl: ctrl.to_vec(),
    }
}

/// Returns the state to which a model without a keyframe is reset, without commands.
///
/// # Errors
/// When the engine fails.
pub(crate) fn default_state(model: &dyn Model) -> Result<Keyframe> {
    let (mut simulator, recording) = simulation(model)?;
    simulator.reset(&[0])?;
    let mut state = vec![0.0; recording.width()];
    simulator.read(&[0], &recording, &mut state)?;
    let layout = model.layout();
    Ok(keyframe(layout, &state, &vec![0.0; layout.nu()]))
}

/// Returns where a model comes to rest from a state under a command; `None` if it does not.
///
/// # Errors
/// When the engine fails.
pub(crate) fn at_rest(
    model: &dyn Model,
    from: &Keyframe,
    command: &[f64],
) -> Result<Option<Keyframe>> {
    let (mut simulator, recording) = simulation(model)?;
    let layout = model.layout();
    simulator.reset(&[0])?;
    simulator.set_state(&[0], &from.qpos, &from.qvel)?;
    let steps = (SETTLES / layout.timestep).ceil() as usize;
    let mut state = vec![0.0; recording.width()];
    let rollout = Rollout::new(&[0], 1, steps, Control::Shared(command), &recording);
    simulator.rollout(&rollout, &mut state)?;
    let rests = state[layout.nq..].iter().all(|v| v.abs() < REST);
    let found = keyframe(layout, &state, command);
    Ok((rests && found.qpos.iter().all(|x| x.is_finite())).then_some(found))
}
