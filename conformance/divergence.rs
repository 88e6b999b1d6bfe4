//! Simulations that leave the plausible range: reported, alone, and able to recover.
//!
//! Every figure is a number of broken promises.

use asid_core::simulator::ExternalForce;
use asid_core::{Backend, Capabilities, Result, Status};

use crate::check::Check;
use crate::faults::{CHANNELS, MOVING, check, pile};
use crate::rig::{Rig, Rows, broken, differing_bits};
use crate::state::PILE;

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "divergence/diverged-is-reported",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "status, rows of NaN from then on, readings of NaN, the others running: broken of four",
        diverged_is_reported,
    ),
    check(
        "divergence/diverged-leaves-others",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "to the bit: readings of the others that differ",
        diverged_leaves_others,
    ),
    check(
        "divergence/diverged-recovers",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "reset, load and copy give it a good state again: readings that differ",
        diverged_recovers,
    ),
    check(
        "divergence/huge-forces",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "a force that no body withstands ends its simulation, however large it is: goes on with of four",
        huge_forces,
    ),
    check(
        "divergence/huge-commands",
        MOVING,
        "finite readings, or NaN with a status that says so: broken of four",
        huge_commands,
    ),
    check(
        "divergence/huge-states",
        MOVING,
        "an error, finite readings, or NaN with a status that says so: broken of four",
        huge_states,
    ),
];

/// A force beyond reason, N: it gives a ball of 0.3 kg a speed of 7e9 m/s in a step.
const HUGE: f64 = 1e12;

/// Rolls three piles, with a force beyond reason on the ball of the second.
fn blown(rig: &mut Rig, force: f64) -> Result<Rows> {
    let frames = 40;
    let mut wrench = vec![0.0; 3 * frames * 6];
    wrench[(frames + 10) * 6] = force;
    let body = rig.simulator.layout().bodies.len() - 1;
    rig.run_with(frames, 2, &[0.5], |extras| {
        extras.forces.push(ExternalForce {
            body,
            wrench: &wrench,
        });
    })
}

fn diverged_is_reported(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let rows = blown(&mut rig, HUGE)?;
    let status = rig.simulator.status();
    let said = matches!(&status[1], Status::Diverged { message, .. } if !message.is_empty());
    let others = status[0].is_running() && status[2].is_running();
    let good = |rows: &[Vec<f64>]| rows.iter().flatten().all(|x| x.is_finite());
    let nan = |rows: &[Vec<f64>]| rows.iter().flatten().all(|x| x.is_nan());
    let read = rig.read()?;
    let second = &rows[40..80];
    Ok(broken([
        said,
        others && good(&rows[..40]) && good(&rows[80..]),
        good(&second[..10]) && nan(&second[12..]),
        nan(&read[1..2]) && good(&read[..1]),
    ]))
}

fn diverged_leaves_others(backend: &dyn Backend) -> Result<f64> {
    let with = blown(&mut pile(backend)?, HUGE)?;
    let without = blown(&mut pile(backend)?, 0.0)?;
    Ok(differing_bits(&with[..40], &without[..40]) + differing_bits(&with[80..], &without[80..]))
}

fn diverged_recovers(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let start = rig.simulator.save(&[1])?;
    let expected = rig.run(20, &[0.5])?;
    let mut different = 0.0;
    for way in 0..3 {
        rig.simulator.reset(&[0, 1, 2])?;
        blown(&mut rig, HUGE)?;
        rig.simulator.reset(&[0, 2])?;
        match way {
            0 => rig.simulator.reset(&[1])?,
            1 => rig.simulator.load(&start, &[0], &[1])?,
            _ => rig.simulator.copy_state(&[0], &[1])?,
        }
        different += differing_bits(&rig.run(20, &[0.5])?, &expected);
        different += f64::from(u8::from(!rig.simulator.status()[1].is_running()));
    }
    Ok(different)
}

fn huge_forces(backend: &dyn Backend) -> Result<f64> {
    let mut ended = [false; 4];
    for (ended, force) in ended.iter_mut().zip([1e12, -1e20, 1e30, 1e300]) {
        let mut rig = pile(backend)?;
        blown(&mut rig, force)?;
        let status = rig.simulator.status();
        *ended = !status[1].is_running() && status[0].is_running();
    }
    Ok(broken(ended))
}

/// True where rows are finite until a simulation diverges, and say so then.
fn honest(rows: &[Vec<f64>], status: &Status) -> bool {
    let first = rows
        .iter()
        .position(|row| row.iter().any(|x| !x.is_finite()))
        .unwrap_or(rows.len());
    let rest = &rows[first..];
    rest.iter().flatten().all(|x| x.is_nan()) && (rest.is_empty() || !status.is_running())
}

fn huge_commands(backend: &dyn Backend) -> Result<f64> {
    let mut kept = [false; 4];
    for (kept, command) in kept.iter_mut().zip([1e10, -1e20, 1e39, 1e300]) {
        let inside = PILE.replace(r#" ctrlrange="-2 2""#, "");
        let mut rig = Rig::new(backend, &inside, &CHANNELS)?;
        let rows = rig.run(50, &[command])?;
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
        let mut rig = Rig::new(backend, PILE, &CHANNELS)?;
        let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
        let placed = rig.place(&vec![position; nq], &vec![speed; nv]).is_ok();
        *kept = !placed || honest(&rig.run(50, &[0.0])?, &rig.simulator.status()[0]);
    }
    Ok(broken(kept))
}
