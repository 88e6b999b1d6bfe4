//! Simulations that diverge: they are reported, do not affect others, and can recover.
//!
//! A state counts as diverged at the latest when a position, a velocity or an acceleration is not
//! finite or beyond 1e10. An engine may be stricter. Every figure is a number of broken promises.

use asid_core::simulator::ExternalForce;
use asid_core::{Backend, Capabilities, Result, Status};

use crate::check::Check;
use crate::faults::{ANY, check};
use crate::rig::{Rig, Rows, broken, differing_bits, saves};
use crate::subject::{NOMINAL, batch, elsewhere, stirred, subject};

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "divergence/diverged-is-reported",
        ANY,
        "status with a reason and the time, rows of NaN from then on, readings of NaN, the others running: broken of five",
        diverged_is_reported,
    ),
    check(
        "divergence/diverged-leaves-others",
        ANY,
        "to the bit: readings of the others that differ",
        diverged_leaves_others,
    ),
    check(
        "divergence/diverged-stays-until-restored",
        ANY,
        "to the bit: no step, parameter, state that is set or neighbour brings it back; broken of four",
        diverged_stays,
    ),
    check(
        "divergence/diverged-recovers",
        ANY,
        "reset, load and copy give it a good state again: readings that differ",
        diverged_recovers,
    ),
    check(
        "divergence/huge-forces",
        Capabilities::EXTERNAL_FORCES,
        "a force that no body withstands ends its simulation, however large it is: goes on with of four",
        huge_forces,
    ),
    check(
        "divergence/huge-commands",
        Capabilities::ARTICULATION.union(Capabilities::ACTUATORS),
        "finite readings, or NaN with a status that says so: broken of four",
        huge_commands,
    ),
    check(
        "divergence/huge-states",
        ANY,
        "an error, finite readings, or NaN with a status that says so: broken of four",
        huge_states,
    ),
    check(
        "divergence/huge-parameters",
        ANY,
        "an error, finite readings, or NaN with a status that says so: broken of four",
        huge_parameters,
    ),
];

/// Excessive gravity, m/s²: a body that falls for one step has a speed of 2e13 m/s.
const HUGE: f64 = -1e16;

/// Frames before the one in which the second of three simulations diverges.
const GOOD: usize = 10;
/// Frames from that one onwards.
const REST: usize = 30;

/// Rolls out three simulations; the second gets `gravity` after a while.
fn blown(rig: &mut Rig, gravity: f64) -> Result<[Rows; 2]> {
    let ctrl = rig.command(0.5);
    let good = rig.run_with(GOOD, 2, &ctrl, |_| {})?;
    rig.simulator.set_parameters(&[1], &[gravity, NOMINAL[1]])?;
    let rest = rig.run_with(REST, 2, &ctrl, |_| {})?;
    rig.simulator.set_parameters(&[1], &NOMINAL)?;
    Ok([good, rest])
}

fn good(rows: &[Vec<f64>]) -> bool {
    rows.iter().flatten().all(|x| x.is_finite())
}

fn nan(rows: &[Vec<f64>]) -> bool {
    rows.iter().flatten().all(|x| x.is_nan())
}

fn diverged_is_reported(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 2)?;
    let [before, rest] = blown(&mut rig, HUGE)?;
    let step = rig.simulator.layout().timestep;
    let (from, to) = (2 * GOOD, 2 * (GOOD + 2));
    let status = rig.simulator.status();
    let (said, when) = match &status[1] {
        Status::Diverged { time, message } => (
            !message.is_empty(),
            (from as f64 - 0.5) * step < *time && *time < (to as f64 + 0.5) * step,
        ),
        Status::Running => (false, false),
    };
    let others = status[0].is_running() && status[2].is_running();
    let read = rig.read()?;
    Ok(broken([
        said,
        when,
        others && good(&before) && good(&rest[..REST]) && good(&rest[2 * REST..]),
        nan(&rest[REST + 2..2 * REST]),
        nan(&read[1..2]) && good(&read[..1]),
    ]))
}

fn diverged_leaves_others(backend: &dyn Backend) -> Result<f64> {
    let [_, with] = blown(&mut stirred(backend, 3, 2)?, HUGE)?;
    let [_, without] = blown(&mut stirred(backend, 3, 2)?, NOMINAL[0])?;
    let last = 2 * REST..;
    Ok(differing_bits(&with[..REST], &without[..REST])
        + differing_bits(&with[last.clone()], &without[last]))
}

fn diverged_stays(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 2)?;
    blown(&mut rig, HUGE)?;
    let ctrl = rig.command(0.0);
    let rows = rig.run(5, &ctrl)?;
    let stepped = nan(&rows[5..10]) && !rig.simulator.status()[1].is_running();
    rig.simulator.reset(&[0, 2])?;
    let alone = !rig.simulator.status()[1].is_running();
    if saves(backend) {
        let snapshot = rig.simulator.save(&[0])?;
        rig.simulator.load(&snapshot, &[0], &[2])?;
    }
    let neighbour = nan(&rig.read()?[1..2]);
    let (qpos, qvel) = elsewhere(rig.simulator.layout());
    rig.simulator.set_state(&[1], &qpos, &qvel)?;
    let rows = rig.run(2, &ctrl)?;
    let placed = nan(&rows[2..4]) && !rig.simulator.status()[1].is_running();
    Ok(broken([stepped, alone, neighbour, placed]))
}

fn diverged_recovers(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 3, 2)?;
    let ctrl = rig.command(0.5);
    let start = saves(backend)
        .then(|| rig.simulator.save(&[1]))
        .transpose()?;
    let expected = rig.run(20, &ctrl)?;
    let mut different = 0.0;
    let ways = if start.is_some() { 3 } else { 1 };
    for way in 0..ways {
        rig.simulator.reset(&[0, 1, 2])?;
        blown(&mut rig, HUGE)?;
        rig.simulator.reset(&[0, 2])?;
        match (way, &start) {
            (1, Some(start)) => rig.simulator.load(start, &[0], &[1])?,
            (2, _) => rig.simulator.copy_state(&[0], &[1])?,
            _ => rig.simulator.reset(&[1])?,
        }
        different += differing_bits(&rig.run(20, &ctrl)?, &expected);
        different += f64::from(u8::from(!rig.simulator.status()[1].is_running()));
    }
    Ok(different)
}

fn huge_forces(backend: &dyn Backend) -> Result<f64> {
    let mut ended = [false; 4];
    for (ended, force) in ended.iter_mut().zip([1e14, -1e20, 1e30, 1e300]) {
        let mut rig = stirred(backend, 3, 2)?;
        let frames = 4;
        let mut wrench = vec![0.0; 3 * frames * 6];
        wrench[(frames + 1) * 6] = force;
        let body = rig.simulator.layout().bodies.len() - 1;
        let ctrl = rig.command(0.5);
        rig.run_with(frames, 2, &ctrl, |extras| {
            extras.forces.push(ExternalForce {
                body,
                wrench: &wrench,
            });
        })?;
        let status = rig.simulator.status();
        *ended = !status[1].is_running() && status[0].is_running();
    }
    Ok(broken(ended))
}

/// Whether rows are finite until a simulation diverges, and the status reports the divergence.
fn honest(rows: &[Vec<f64>], status: &Status) -> bool {
    let first = rows
        .iter()
        .position(|row| row.iter().any(|x| !x.is_finite()))
        .unwrap_or(rows.len());
    let rest = &rows[first..];
    rest.iter().flatten().all(|x| x.is_nan()) && (rest.is_empty() || !status.is_running())
}

fn huge_commands(backend: &dyn Backend) -> Result<f64> {
    let subject = subject(backend);
    let inside = subject.inside.replace(r#" ctrlrange="-2 2""#, "");
    let mut kept = [false; 4];
    for (kept, command) in kept.iter_mut().zip([1e10, -1e20, 1e39, 1e300]) {
        let mut rig = Rig::new(backend, &inside, &subject.channels)?;
        let rows = rig.run(50, &rig.command(command))?;
        *kept = honest(&rows, &rig.simulator.status()[0]);
    }
    Ok(broken(kept))
}

fn huge_states(backend: &dyn Backend) -> Result<f64> {
    let mut kept = [false; 4];
    for (kept, (position, speed)) in
        kept.iter_mut()
            .zip([(0.0, 1e10), (1e8, 0.0), (1e39, 1e39), (1e300, -1e300)])
    {
        let mut rig = batch(backend, 1, 1)?;
        let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
        let placed = rig.place(&vec![position; nq], &vec![speed; nv]).is_ok();
        let rows = rig.run(50, &rig.command(0.0))?;
        *kept = !placed || honest(&rows, &rig.simulator.status()[0]);
    }
    Ok(broken(kept))
}

fn huge_parameters(backend: &dyn Backend) -> Result<f64> {
    let mut kept = [false; 4];
    for (kept, gravity) in kept.iter_mut().zip([1e10, -1e20, 1e39, -1e300]) {
        let mut rig = batch(backend, 1, 1)?;
        let set = rig.set(&[gravity, 1.0]).is_ok();
        let rows = rig.run(50, &rig.command(0.0))?;
        *kept = !set || honest(&rows, &rig.simulator.status()[0]);
    }
    Ok(broken(kept))
}
