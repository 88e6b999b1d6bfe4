//! Calls that make no sense: each is an error, and none changes anything or
//! ends the process.
//!
//! Every figure is a number of broken promises.

use asid_core::simulator::{ExternalForce, ParameterChange};
use asid_core::{Backend, Capabilities, Control, Error, Result, Rollout, Scene};

use crate::check::{Check, Tolerance};
use crate::rig::{Rig, Size, broken, differing_bits};
use crate::state::PILE;

/// Contacts, joints and drives.
pub const MOVING: Capabilities = Capabilities::CONTACT
    .union(Capabilities::ARTICULATION)
    .union(Capabilities::ACTUATORS);

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
        measure,
    }
}

/// The checks of this family.
pub const CHECKS: &[Check] = &[
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

/// What is recorded of a pile.
pub const CHANNELS: [&str; 4] = ["qpos.turn", "qvel.turn", "qpos.a", "qpos.c"];

/// Three piles on two threads.
pub fn pile(backend: &dyn Backend) -> Result<Rig> {
    Rig::with(backend, PILE, &CHANNELS, THREE)
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
        rig.simulator
            .set_state(&[0], &vec![0.0; nq - 1], &vec![0.0; nv])
            .is_err(),
        rig.simulator
            .set_state(&[0], &vec![0.0; nq], &vec![0.0; nv + 1])
            .is_err(),
        rig.simulator
            .set_parameters(&[0, 1], &[0.1, -9.81])
            .is_err(),
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
    let other =
        r#"<worldbody><body><joint name="j"/><geom type="sphere" size=".1"/></body></worldbody>"#;
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
