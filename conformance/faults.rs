//! What must not happen: a bad call that is accepted, a bad simulation that
//! takes others with it, a value that ends the process.
//!
//! Every figure is a number of broken promises.

use asid_core::simulator::{ExternalForce, ParameterChange};
use asid_core::{Backend, Capabilities, Control, Error, Result, Rollout, Scene, Status};

use crate::check::{Check, Tolerance};
use crate::rig::{Rig, Rows, Size, broken, differing_bits};
use crate::state::PILE;

const MOVING: Capabilities = Capabilities::CONTACT
    .union(Capabilities::ARTICULATION)
    .union(Capabilities::ACTUATORS);

const fn check(
    name: &'static str,
    needs: Capabilities,
    reason: &'static str,
    measure: fn(&dyn Backend) -> Result<f64>,
) -> Check {
    Check {
        name,
        needs,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason,
        measure,
    }
}

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "faults/diverged-is-reported",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "status, rows of NaN from then on, readings of NaN, the others running: broken of four",
        diverged_is_reported,
    ),
    check(
        "faults/diverged-leaves-others",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "to the bit: readings of the others that differ",
        diverged_leaves_others,
    ),
    check(
        "faults/diverged-recovers",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "reset, load and copy give it a good state again: readings that differ",
        diverged_recovers,
    ),
    check(
        "faults/huge-forces",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "a force that no body withstands ends its simulation, however large it is: goes on with of four",
        huge_forces,
    ),
    check(
        "faults/huge-commands",
        MOVING,
        "finite readings, or NaN with a status that says so: broken of four",
        huge_commands,
    ),
    check(
        "faults/huge-states",
        MOVING,
        "an error, finite readings, or NaN with a status that says so: broken of four",
        huge_states,
    ),
    check(
        "faults/values-that-are-not-finite",
        MOVING,
        "an error each: accepted of six",
        not_finite,
    ),
    check(
        "faults/wrong-lengths",
        MOVING,
        "an error each: accepted of seven",
        wrong_lengths,
    ),
    check(
        "faults/wrong-indices",
        MOVING,
        "an error each: accepted of ten",
        wrong_indices,
    ),
    check(
        "faults/forces-out-of-place",
        MOVING.union(Capabilities::EXTERNAL_FORCES),
        "an error each: accepted of three",
        wrong_forces,
    ),
    check(
        "faults/foreign-snapshots",
        MOVING,
        "an error each: accepted of two",
        foreign_snapshots,
    ),
    check(
        "faults/a-bad-call-changes-nothing",
        MOVING,
        "to the bit: readings that differ after calls that failed",
        bad_call_changes_nothing,
    ),
    check(
        "faults/nothing-to-do",
        MOVING,
        "no simulations and no frames are no errors; no substeps or an empty batch may be, but no more than that: refused of two",
        nothing_to_do,
    ),
    check(
        "faults/scenes-that-make-no-sense",
        Capabilities::ARTICULATION,
        "an error each: accepted of five",
        bad_scenes,
    ),
];

const THREE: Size<'static> = Size {
    sims: 3,
    threads: 2,
    targets: &["joint/turn/damping", "option/gravity/2"],
};

const CHANNELS: [&str; 4] = ["qpos.turn", "qvel.turn", "qpos.a", "qpos.c"];

fn pile(backend: &dyn Backend) -> Result<Rig> {
    Rig::with(backend, PILE, &CHANNELS, THREE)
}

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
    for (kept, (position, speed)) in kept.iter_mut().zip([
        (0.0, 1e10),
        (1e8, 0.0),
        (1e39, 1e39),
        (1e300, -1e300),
    ]) {
        let mut rig = Rig::new(backend, PILE, &CHANNELS)?;
        let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
        let placed = rig.place(&vec![position; nq], &vec![speed; nv]).is_ok();
        *kept = !placed || honest(&rig.run(50, &[0.0])?, &rig.simulator.status()[0]);
    }
    Ok(broken(kept))
}

fn not_finite(backend: &dyn Backend) -> Result<f64> {
    let mut rig = Rig::with(backend, PILE, &CHANNELS, Size { sims: 1, ..THREE })?;
    let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
    let (qpos, qvel) = (vec![0.1; nq], vec![0.0; nv]);
    let spoilt = |values: &[f64], with: f64| {
        let mut values = values.to_vec();
        values[0] = with;
        values
    };
    Ok(broken([
        rig.run(3, &[f64::NAN]).is_err(),
        rig.run(3, &[f64::INFINITY]).is_err(),
        rig.place(&spoilt(&qpos, f64::NAN), &qvel).is_err(),
        rig.place(&qpos, &spoilt(&qvel, f64::INFINITY)).is_err(),
        rig.set(&[f64::NAN, -9.81]).is_err(),
        rig.set(&[0.1, f64::NEG_INFINITY]).is_err(),
    ]))
}

fn wrong_lengths(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
    let width = rig.record.width();
    let mut out = vec![0.0; width * 6];
    let simulator = &mut rig.simulator;
    let mut roll = |control: Control<'_>, out: &mut [f64]| {
        let rollout = Rollout::new(&[0, 1, 2], 2, 1, control, &rig.record);
        simulator.rollout(&rollout, out).is_err()
    };
    let control = [0.0; 2];
    let rollouts = [
        roll(Control::Shared(&[0.0]), &mut out),
        roll(Control::PerSimulation(&control), &mut out),
        roll(Control::Shared(&control), &mut out[..width]),
    ];
    Ok(broken([
        rollouts[0],
        rollouts[1],
        rollouts[2],
        rig.simulator.read(&[0], &rig.record, &mut out).is_err(),
        rig.simulator.set_state(&[0], &vec![0.0; nq - 1], &vec![0.0; nv]).is_err(),
        rig.simulator.set_state(&[0], &vec![0.0; nq], &vec![0.0; nv + 1]).is_err(),
        rig.simulator.set_parameters(&[0, 1], &[0.1, -9.81]).is_err(),
    ]))
}

fn wrong_indices(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let snapshot = rig.simulator.save(&[0, 1])?;
    let simulator = &mut rig.simulator;
    let mut out = vec![0.0; rig.record.width() * 2];
    let mut kept = [false; 3];
    for (kept, sims) in kept.iter_mut().zip([[1, 0], [1, 1], [1, 3]]) {
        let control = Control::Shared(&[0.0]);
        let rollout = Rollout::new(&sims, 1, 1, control, &rig.record);
        *kept = simulator.rollout(&rollout, &mut out).is_err();
    }
    Ok(broken([
        kept[0],
        kept[1],
        kept[2],
        simulator.reset(&[3]).is_err(),
        simulator.reset(&[2, 1]).is_err(),
        simulator.save(&[usize::MAX]).is_err(),
        simulator.load(&snapshot, &[2], &[0]).is_err(),
        simulator.load(&snapshot, &[0, 1], &[0]).is_err(),
        simulator.copy_state(&[3], &[0]).is_err(),
        simulator.copy_state(&[0], &[0]).is_err(),
    ]))
}

fn wrong_forces(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let mut push = |body: usize, wrench: &[f64]| {
        rig.run_with(1, 1, &[0.0], |extras| {
            extras.forces.push(ExternalForce { body, wrench });
        })
        .is_err()
    };
    Ok(broken([
        push(0, &[0.0; 18]),
        push(99, &[0.0; 18]),
        push(1, &[0.0; 6]),
    ]))
}

fn foreign_snapshots(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let other = r#"<worldbody><body><joint name="j"/><geom type="sphere" size=".1"/></body></worldbody>"#;
    let mut other = Rig::new(backend, other, &[])?;
    let foreign = other.simulator.save(&[0])?;
    let alien = asid_core::Snapshot::new("of no engine", 1);
    Ok(broken([
        rig.simulator.load(&foreign, &[0], &[0]).is_err(),
        rig.simulator.load(&alien, &[0], &[0]).is_err(),
    ]))
}

fn bad_call_changes_nothing(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    rig.run(20, &[0.5])?;
    let before = rig.read()?;
    let refused = rig.run(5, &[f64::NAN]).is_err()
        && rig.set(&[0.1, -5.0, 0.1, f64::NAN, 0.1, -5.0]).is_err()
        && rig.simulator.reset(&[0, 7]).is_err()
        && rig
            .run_with(3, 1, &[0.0], |extras| {
                extras.changes.push(ParameterChange {
                    frame: 0,
                    column: 1,
                    values: &[-1.0, f64::NAN, -1.0],
                });
            })
            .is_err();
    if !refused {
        return Err(Error::Failed("a bad call was accepted".into()));
    }
    let unmoved = differing_bits(&before, &rig.read()?);
    // Neither states nor parameters: it goes on like one that never heard of them.
    let mut other = pile(backend)?;
    other.run(20, &[0.5])?;
    Ok(unmoved + differing_bits(&rig.run(20, &[0.5])?, &other.run(20, &[0.5])?))
}

fn nothing_to_do(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend)?;
    let no_sims = rig.run_with(2, 1, &[0.0], |extras| extras.sims.clear());
    let no_frames = rig.run(0, &[0.0]);
    // Whether these two are errors is the engine's choice.
    let _ = rig.run_with(2, 0, &[0.0], |_| {});
    let _ = Rig::with(backend, PILE, &CHANNELS, Size { sims: 0, ..THREE })
        .and_then(|mut rig| rig.run(2, &[0.0]));
    Ok(broken([no_sims.is_ok(), no_frames.is_ok()]))
}

fn bad_scenes(backend: &dyn Backend) -> Result<f64> {
    let refused = |inside: &str| {
        Scene::from_xml("bad", &format!("<mujoco>{inside}</mujoco>"), &[])
            .and_then(|scene| backend.load(&scene))
            .is_err()
    };
    Ok(broken([
        refused(r#"<worldbody><body><geom type="spherical" size="1"/></body></worldbody>"#),
        refused(r#"<worldbody><body><geom type="mesh" mesh="missing"/></body></worldbody>"#),
        refused(r#"<worldbody><body><freejoint/><geom size="nan"/></body></worldbody>"#),
        refused(
            r#"<worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
            <actuator><motor joint="missing"/></actuator>"#,
        ),
        refused(
            r#"<worldbody><body name="b"><joint/><geom size=".1"/></body>
            <body name="b"><joint/><geom size=".1"/></body></worldbody>"#,
        ),
    ]))
}
