//! Readings across the ABI: the requested channels, and the check that the returned values are
//! numbers.

use asid_core::layout::{Channel, Layout, Recording};
use asid_core::{Capabilities, Result, Status};

use crate::batch::BatchHandle;
use crate::failure::broken;
use crate::table::{self, channel_kind};

/// Channels in the header's form.
#[must_use]
pub fn channels(record: &Recording) -> Vec<table::Channel> {
    let channel = |kind, a: usize, b: usize| table::Channel {
        kind,
        padding: 0,
        a: a as u64,
        b: b as u64,
    };
    record
        .channels()
        .iter()
        .map(|c| match *c {
            Channel::Sensor { index } => channel(channel_kind::SENSOR, index, 0),
            Channel::Position { start, len } => channel(channel_kind::QPOS, start, len),
            Channel::Velocity { start, len } => channel(channel_kind::QVEL, start, len),
            Channel::ContactForce { bodies: [a, b] } => channel(channel_kind::CONTACT, a, b),
        })
        .collect()
}

/// Name of a channel for messages.
fn describe(channel: Channel, layout: &Layout) -> String {
    match channel {
        Channel::Sensor { index } => format!("sensor `{}`", layout.sensors[index].name),
        Channel::Position { start, .. } => format!("position {start}"),
        Channel::Velocity { start, .. } => format!("velocity {start}"),
        Channel::ContactForce { bodies: [a, b] } => {
            format!("contact.{}/{}", layout.bodies[a], layout.bodies[b])
        }
    }
}

/// Checks that readings of running simulations are numbers.
///
/// # Errors
/// A defect of the engine, naming channel, simulation and frame.
pub fn check(
    batch: &BatchHandle,
    status: &[Status],
    call: &str,
    sims: &[usize],
    record: &Recording,
    out: &[f64],
) -> Result<()> {
    let width = record.width();
    if width == 0 || sims.is_empty() {
        return Ok(());
    }
    let length = out.len() / sims.len();
    for (&sim, rows) in sims.iter().zip(out.chunks_exact(length.max(1))) {
        if !status[sim].is_running() {
            continue;
        }
        if let Some(at) = rows.iter().position(|x| !x.is_finite()) {
            let entry = at % width;
            let names = batch.model.layout();
            let channel = (0..record.channels().len())
                .find(|&i| record.range(i).contains(&entry))
                .map(|i| describe(record.channels()[i], names))
                .unwrap_or_default();
            return Err(broken(
                &batch.engine().path,
                call,
                &format!(
                    "reads {} for {channel} of simulation {sim} in frame {}, which it says is running",
                    rows[at],
                    at / width
                ),
            ));
        }
    }
    Ok(())
}

/// Checks that contact forces are requested only from an engine that has them.
///
/// # Errors
/// As [`BatchHandle::require`].
pub fn require(batch: &BatchHandle, record: &Recording) -> Result<()> {
    let is_contact = |c: &Channel| matches!(c, Channel::ContactForce { .. });
    match record.channels().iter().any(is_contact) {
        true => batch.require(Capabilities::CONTACT_FORCES, "record contact forces"),
        false => Ok(()),
    }
}
