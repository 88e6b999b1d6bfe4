//! Invalid calls: each must be an error, change nothing and not end the process.
//!
//! Every figure is a number of broken promises.

use asid_core::simulator::{ExternalForce, ParameterChange};
use asid_core::{Backend, Capabilities, Control, Error, Result, Rollout, Scene};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::rig::{Rig, broken, differing_bits, saves};
use crate::subject::{batch, stirred, subject};

/// No capability: every engine must pass the check.
pub const ANY: Capabilities = Capabilities::empty();

/// A check that counts broken promises.
pub const fn check(
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
        measure: Figure(measure),
    }
}

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "faults/values-that-are-not-finite",
        ANY,
        "an error each: accepted of six",
        not_finite,
    ),
    check(
        "faults/wrong-lengths",
        ANY,
        "an error each: accepted of nine",
        wrong_lengths,
    ),
    check(
        "faults/wrong-indices",
        ANY,
        "an error each: accepted of ten, of one without snapshots",
        wrong_indices,
    ),
    check(
        "faults/simulations-out-of-order",
        ANY,
        "unsorted, repeated or beyond the batch is an error in every call that takes simulations: accepted of 18, of 12 without snapshots",
        out_of_order,
    ),
    check(
        "faults/forces-out-of-place",
        Capabilities::EXTERNAL_FORCES,
        "an error each: accepted of four",
        wrong_forces,
    ),
    check(
        "faults/changes-out-of-place",
        Capabilities::PARAMETER_CHANGES,
        "an error each: accepted of four",
        wrong_changes,
    ),
    check(
        "faults/a-bad-call-changes-nothing",
        ANY,
        "to the bit: readings that differ after calls that failed",
        bad_call_changes_nothing,
    ),
    check(
        "faults/nothing-to-do",
        ANY,
        "no simulations, no frames and no channels are no errors and change nothing; no substeps or an empty batch may be, but no more than that: broken of ten",
        nothing_to_do,
    ),
    check(
        "faults/scenes-that-make-no-sense",
        ANY,
        "an error each: accepted of five",
        bad_scenes,
    ),
];

fn not_finite(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 1, 1)?;
    let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
    let (qpos, qvel) = (vec![0.1; nq], vec![0.0; nv]);
    let spoilt = |values: &[f64], with: f64| {
        let mut values = values.to_vec();
        values.iter_mut().take(1).for_each(|value| *value = with);
        values
    };
    // If nothing moves, there is no state to corrupt.
    let still = nq == 0;
    let mut commanded = |value: f64| {
        let ctrl = rig.command(value);
        ctrl.is_empty() || rig.run(3, &ctrl).is_err()
    };
    Ok(broken([
        commanded(f64::NAN),
        commanded(f64::INFINITY),
        still || rig.place(&spoilt(&qpos, f64::NAN), &qvel).is_err(),
        still || rig.place(&qpos, &spoilt(&qvel, f64::INFINITY)).is_err(),
        rig.set(&[f64::NAN, 0.0]).is_err(),
        rig.set(&[-9.81, f64::NEG_INFINITY]).is_err(),
    ]))
}

fn wrong_lengths(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 3, 2)?;
    let layout = rig.simulator.layout();
    let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
    let width = rig.record.width();
    let mut out = vec![0.0; width * 6];
    let simulator = &mut rig.simulator;
    let mut roll = |control: Control<'_>, out: &mut [f64]| {
        let rollout = Rollout::new(&[0, 1, 2], 2, 1, control, &rig.record);
        simulator.rollout(&rollout, out).is_err()
    };
    let control = vec![0.0; 6 * nu + 1];
    let rollouts = [
        roll(Control::Shared(&control[..2 * nu + 1]), &mut out),
        roll(Control::PerSimulation(&control), &mut out),
        width == 0 || roll(Control::Shared(&control[..2 * nu]), &mut out[..width]),
    ];
    Ok(broken([
        rollouts[0],
        rollouts[1],
        rollouts[2],
        width == 0 || simulator.read(&[0], &rig.record, &mut out).is_err(),
        (simulator.set_state(&[0], &vec![0.0; nq + 1], &vec![0.0; nv])).is_err(),
        (simulator.set_state(&[0], &vec![0.0; nq], &vec![0.0; nv + 1])).is_err(),
        simulator.set_parameters(&[0, 1], &[-9.81, 0.0]).is_err(),
        simulator.set_parameters(&[0], &[-9.81]).is_err(),
        simulator.set_parameters(&[0], &[-9.81, 0.0, 0.0]).is_err(),
    ]))
}

fn wrong_indices(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 3, 2)?;
    let simulator = &mut rig.simulator;
    let reset = simulator.reset(&[3]).is_err();
    if !saves(backend) {
        return Ok(broken([reset]));
    }
    let snapshot = simulator.save(&[0, 1])?;
    Ok(broken([
        reset,
        simulator.save(&[usize::MAX]).is_err(),
        simulator.load(&snapshot, &[2], &[0]).is_err(),
        simulator.load(&snapshot, &[usize::MAX], &[0]).is_err(),
        simulator.load(&snapshot, &[0, 1], &[0]).is_err(),
        simulator.load(&snapshot, &[0], &[0, 1]).is_err(),
        simulator.copy_state(&[3], &[0]).is_err(),
        simulator.copy_state(&[0], &[0]).is_err(),
        simulator.copy_state(&[0, 1], &[1, 2]).is_err(),
        simulator.copy_state(&[0, 0], &[1]).is_err(),
    ]))
}

fn out_of_order(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 3, 2)?;
    let layout = rig.simulator.layout();
    let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
    let simulator = &mut rig.simulator;
    let snapshot = saves(backend)
        .then(|| simulator.save(&[0, 1]))
        .transpose()?;
    let mut out = vec![0.0; rig.record.width() * 2];
    let mut accepted = 0.0;
    for sims in [[1, 0], [1, 1], [1, 3]] {
        let control = vec![0.0; nu];
        let rollout = Rollout::new(&sims, 1, 1, Control::Shared(&control), &rig.record);
        accepted += broken([
            simulator.rollout(&rollout, &mut out).is_err(),
            simulator.reset(&sims).is_err(),
            (simulator.set_state(&sims, &vec![0.5; 2 * nq], &vec![0.0; 2 * nv])).is_err(),
            (simulator.set_parameters(&sims, &[-9.81, 0.0, -9.81, 0.0])).is_err(),
        ]);
        if let Some(snapshot) = &snapshot {
            accepted += broken([
                simulator.save(&sims).is_err(),
                simulator.load(snapshot, &[0, 1], &sims).is_err(),
            ]);
        }
    }
    Ok(accepted)
}

fn wrong_forces(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 3, 2)?;
    let ctrl = rig.command(0.0);
    let mut push = |body: usize, wrench: &[f64]| {
        rig.run_with(1, 1, &ctrl, |extras| {
            extras.forces.push(ExternalForce { body, wrench });
        })
        .is_err()
    };
    let mut spoilt = [0.0; 18];
    spoilt[7] = f64::NAN;
    Ok(broken([
        push(0, &[0.0; 18]),
        push(99, &[0.0; 18]),
        push(1, &[0.0; 6]),
        push(1, &spoilt),
    ]))
}

fn wrong_changes(backend: &dyn Backend) -> Result<f64> {
    let mut rig = batch(backend, 3, 2)?;
    let ctrl = rig.command(0.0);
    let mut change = |frame: usize, column: usize, values: &[f64]| {
        rig.run_with(2, 1, &ctrl.repeat(1), |extras| {
            extras.changes.push(ParameterChange {
                frame,
                column,
                values,
            });
        })
        .is_err()
    };
    Ok(broken([
        change(2, 0, &[-9.0; 3]),
        change(0, 2, &[-9.0; 3]),
        change(0, 0, &[-9.0; 2]),
        change(0, 0, &[-9.0, f64::NAN, -9.0]),
    ]))
}

fn bad_call_changes_nothing(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 2)?;
    let (ctrl, half) = (rig.command(f64::NAN), rig.command(0.5));
    rig.run(20, &half)?;
    let before = rig.read()?;
    let (nq, nv) = (rig.simulator.layout().nq, rig.simulator.layout().nv);
    let mut qvel = vec![0.0; 3 * nv];
    qvel.iter_mut()
        .rev()
        .take(1)
        .for_each(|rate| *rate = f64::NAN);
    let mut refused = (ctrl.is_empty() || rig.run(5, &ctrl).is_err())
        && rig.set(&[-5.0, 0.1, -5.0, 0.1, -5.0, f64::NAN]).is_err()
        && rig.simulator.reset(&[0, 7]).is_err()
        && (nv == 0
            || rig
                .simulator
                .set_state(&[0, 1, 2], &vec![0.5; 3 * nq], &qvel)
                .is_err());
    if (backend.capabilities()).contains(Capabilities::PARAMETER_CHANGES) {
        refused &= rig
            .run_with(3, 1, &half, |extras| {
                extras.changes.push(ParameterChange {
                    frame: 0,
                    column: 0,
                    values: &[-1.0, f64::NAN, -1.0],
                });
            })
            .is_err();
    }
    if !refused {
        return Err(Error::Failed("a bad call was accepted".into()));
    }
    let unmoved = differing_bits(&before, &rig.read()?);
    // States and parameters are unchanged: it continues like a simulation that never had the calls.
    let mut other = stirred(backend, 3, 2)?;
    other.run(20, &half)?;
    Ok(unmoved + differing_bits(&rig.run(20, &half)?, &other.run(20, &half)?))
}

fn nothing_to_do(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 2)?;
    let ctrl = rig.command(0.0);
    let before = rig.read()?;
    let no_sims = rig.run_with(2, 1, &ctrl, |extras| extras.sims.clear());
    let no_frames = rig.run(0, &ctrl);
    let record = std::mem::take(&mut rig.record);
    let no_channels = rig.run(0, &ctrl).is_ok() && rig.read().is_ok();
    rig.record = record;
    let simulator = &mut rig.simulator;
    let unsaved = !saves(backend);
    let snapshots = unsaved
        || (simulator.save(&[]))
            .is_ok_and(|s| s.rows() == 0 && simulator.load(&s, &[], &[]).is_ok());
    let calls = [
        no_sims.is_ok(),
        no_frames.is_ok(),
        no_channels,
        simulator.reset(&[]).is_ok(),
        simulator.set_state(&[], &[], &[]).is_ok(),
        simulator.set_parameters(&[], &[]).is_ok(),
        unsaved || simulator.copy_state(&[], &[]).is_ok(),
        snapshots,
        simulator.read(&[], &rig.record, &mut []).is_ok(),
        differing_bits(&before, &rig.read()?) == 0.0,
    ];
    // An engine may choose whether these two are errors.
    let _ = rig.run_with(2, 0, &ctrl, |_| {});
    let _ = batch(backend, 0, 2).and_then(|mut rig| rig.run(2, &ctrl));
    Ok(broken(calls))
}

fn bad_scenes(backend: &dyn Backend) -> Result<f64> {
    // The valid parts of these documents are known to load.
    Rig::new(backend, &subject(backend).inside, &[])?;
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
