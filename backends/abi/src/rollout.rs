//! A rollout across the ABI.

use asid_core::{Control, Result, Rollout};

use crate::batch::BatchHandle;
use crate::hook::{self, HostHook};
use crate::{readings, slices, table};

/// Runs a checked rollout in a scene with `nq` positions, `nv` velocities and `nu` commands.
///
/// # Errors
/// The engine's own.
///
/// # Panics
/// When the hook panicked: its panic continues here, past the engine.
pub fn run(
    batch: &mut BatchHandle,
    rollout: &Rollout<'_>,
    lengths: [usize; 3],
    out: &mut [f64],
) -> Result<()> {
    let forces: Vec<table::Force> = rollout
        .forces
        .iter()
        .map(|f| table::Force {
            body: f.body as u64,
            wrench: f.wrench.as_ptr(),
        })
        .collect();
    let changes: Vec<table::Change> = rollout
        .changes
        .iter()
        .map(|c| table::Change {
            frame: c.frame as u64,
            column: c.column as u64,
            values: c.values.as_ptr(),
        })
        .collect();
    let channels = readings::channels(rollout.record);
    let host = rollout.hook.map(|h| HostHook::new(h, lengths));
    let (control, shared) = match rollout.control {
        Control::Shared(c) => (c, 1),
        Control::PerSimulation(c) => (c, 0),
    };
    let theirs = table::Rollout {
        size: size_of::<table::Rollout>() as u64,
        count: rollout.sims.len() as u64,
        sims: slices::sims(rollout.sims),
        frames: rollout.frames as u64,
        substeps: rollout.substeps as u64,
        control: control.as_ptr(),
        shared_control: shared,
        padding: 0,
        force_count: forces.len() as u64,
        forces: forces.as_ptr(),
        change_count: changes.len() as u64,
        changes: changes.as_ptr(),
        hook: host.as_ref().map(|_| hook::call as table::StepHook),
        hook_context: host
            .as_ref()
            .map_or(std::ptr::null_mut(), HostHook::context),
        channel_count: channels.len() as u64,
        channels: channels.as_ptr(),
        width: rollout.record.width() as u64,
    };
    let run = batch.engine().table.rollout;
    let done = batch.call("rollout", run, |f, batch, error| {
        // SAFETY: lengths are checked; everything lives until the call returns.
        unsafe { f(batch, &theirs, out.as_mut_ptr(), error) }
    });
    if let Some(host) = host {
        host.finish();
    }
    done
}
