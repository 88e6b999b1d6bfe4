//! States: saving, restoring, copying and setting them; and what results may depend on.
//!
//! Nearly every figure here is a number of readings that differ in any bit.

use std::sync::Mutex;

use asid_core::simulator::StepView;
use asid_core::{Backend, Capabilities, Error, Result, Snapshot};

use crate::check::Measure::{Figure, Taken};
use crate::check::{Check, Tolerance};
use crate::effects::By;
use crate::rig::{Rig, Rows, broken, differing_bits, largest};
use crate::subject::{batch, command, elsewhere, falling, roll, stir, stirred};

/// No capability: every engine must pass the check.
const ANY: Capabilities = Capabilities::empty();
const EXACT: Capabilities = Capabilities::EXACT_SNAPSHOT;
const NONE: Tolerance = Tolerance::same(0.0);
const TO_THE_BIT: &str = "to the bit: number of readings that differ";

const fn check(
    name: &'static str,
    needs: Capabilities,
    measure: fn(&dyn Backend) -> Result<f64>,
) -> Check {
    Check {
        name,
        needs,
        unit: "",
        tolerance: NONE,
        reason: TO_THE_BIT,
        measure: Figure(measure),
    }
}

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check("state/restored-continues", EXACT, restored),
    check("state/restored-in-another-batch", EXACT, restored_elsewhere),
    check("state/rows-of-a-snapshot", EXACT, snapshot_rows),
    check("state/copied-continues", EXACT, copied),
    check("state/set-forgets-history", ANY, set_state),
    check("state/reset-forgets-history", ANY, reset),
    Check {
        name: "state/reset-is-at-time-zero",
        needs: ANY,
        unit: "s",
        tolerance: NONE,
        reason: "an episode begins at time zero, whatever time the first <key> states: by a <clock> and by a hook, where they are taken",
        measure: Taken(time_zero),
    },
    check("state/threads-change-nothing", ANY, threads),
    check("state/batch-equals-single", ANY, batch_equals_single),
    check("state/subset-leaves-others", ANY, subset),
    check("state/fresh-batches-agree", ANY, fresh),
    check("state/parallel-batches-agree", ANY, parallel),
    check("state/reading-disturbs-nothing", ANY, reading),
    check("state/rollouts-join", ANY, joined),
    check("state/frames-are-substeps", ANY, frames),
    Check {
        name: "state/steps-are-counted",
        needs: ANY,
        unit: "",
        tolerance: NONE,
        reason: "simulations times frames times substeps: wrong of two",
        measure: Figure(counted),
    },
];

/// A batch of three in the middle of its motion.
fn midway(backend: &dyn Backend) -> Result<Rig> {
    let mut rig = stirred(backend, 3, 1)?;
    roll(&mut rig, &[0, 1, 2], 60, 2)?;
    Ok(rig)
}

/// A batch of three in the middle of its motion, and a snapshot of that moment.
fn saved(backend: &dyn Backend) -> Result<(Rig, Snapshot)> {
    let mut rig = midway(backend)?;
    let snapshot = rig.simulator.save(&[0, 1, 2])?;
    Ok((rig, snapshot))
}

fn restored(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, snapshot) = saved(backend)?;
    let first = roll(&mut rig, &[0, 1, 2], 60, 2)?;
    roll(&mut rig, &[0, 2], 10, 1)?;
    rig.simulator.load(&snapshot, &[0, 1, 2], &[0, 1, 2])?;
    let second = roll(&mut rig, &[0, 1, 2], 60, 2)?;
    Ok(differing_bits(&first, &second))
}

fn restored_elsewhere(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, snapshot) = saved(backend)?;
    let first = roll(&mut rig, &[0, 1, 2], 60, 2)?;
    let mut other = rig.another(3, 2)?;
    roll(&mut other, &[1], 25, 1)?;
    other.simulator.load(&snapshot, &[0, 1, 2], &[0, 1, 2])?;
    let second = roll(&mut other, &[0, 1, 2], 60, 2)?;
    Ok(differing_bits(&first, &second))
}

fn snapshot_rows(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, snapshot) = saved(backend)?;
    let before = rig.read()?;
    roll(&mut rig, &[0, 1, 2], 10, 1)?;
    rig.simulator.load(&snapshot, &[2, 0], &[0, 1])?;
    let after = rig.read()?;
    let expected = [before[2].clone(), before[0].clone()];
    Ok(differing_bits(&after[..2], &expected))
}

fn copied(backend: &dyn Backend) -> Result<f64> {
    let mut rig = midway(backend)?;
    rig.simulator.copy_state(&[1, 1], &[0, 2])?;
    let rows = rig.run(60, &rig.command(0.9))?;
    Ok(differing_bits(&rows[..60], &rows[60..120]) + differing_bits(&rows[..60], &rows[120..]))
}

fn set_state(backend: &dyn Backend) -> Result<f64> {
    let mut rig = midway(backend)?;
    let mut fresh = batch(backend, 1, 1)?;
    let (qpos, qvel) = elsewhere(rig.simulator.layout());
    rig.place(&qpos, &qvel)?;
    fresh.place(&qpos, &qvel)?;
    let ctrl = rig.command(0.9);
    let (used, new) = (rig.run(60, &ctrl)?, fresh.run(60, &ctrl)?);
    Ok((0..3)
        .map(|sim| differing_bits(&used[60 * sim..60 * (sim + 1)], &new))
        .sum())
}

fn reset(backend: &dyn Backend) -> Result<f64> {
    let mut rig = midway(backend)?;
    rig.simulator.reset(&[0, 1, 2])?;
    let used = roll(&mut rig, &[0, 1, 2], 80, 2)?;
    let new = roll(&mut batch(backend, 3, 1)?, &[0, 1, 2], 80, 2)?;
    Ok(differing_bits(&used, &new))
}

/// Times at which episodes begin, of a new batch and after a reset; `None` if nothing shows them.
fn time_zero(backend: &dyn Backend) -> Result<Option<f64>> {
    let body = falling(backend);
    let key = r#"<keyframe><key time="5"/></keyframe>"#;
    let mut times = Vec::new();
    let inside = format!(
        r#"{}<sensor><clock name="now"/></sensor>{key}"#,
        body.inside
    );
    if let Ok(mut rig) = Rig::new(backend, &inside, &["now"])
        && let Ok(begun) = rig.read()
    {
        rig.run(3, &[])?;
        rig.simulator.reset(&[0])?;
        times.extend([begun[0][0], rig.read()?[0][0]]);
    }
    if (backend.capabilities()).contains(Capabilities::STEP_HOOKS) {
        let mut rig = Rig::new(backend, &format!("{}{key}", body.inside), body.velocity)?;
        let seen = Mutex::new(Vec::new());
        let hook = By(|step: usize, view: &mut StepView<'_>| {
            if let (0, Ok(mut seen)) = (step, seen.lock()) {
                seen.push(view.time);
            }
        });
        for _ in 0..2 {
            rig.run_with(3, 1, &[], |extras| extras.hook = Some(&hook))?;
            rig.simulator.reset(&[0])?;
        }
        let seen = seen.into_inner();
        times.extend(seen.map_err(|_| Error::Failed("a hook panicked".into()))?);
    }
    Ok((!times.is_empty()).then(|| largest(times)))
}

fn threads(backend: &dyn Backend) -> Result<f64> {
    let all: Vec<usize> = (0..5).collect();
    let one = roll(&mut stirred(backend, 5, 1)?, &all, 100, 2)?;
    let two = roll(&mut stirred(backend, 5, 2)?, &all, 100, 2)?;
    Ok(differing_bits(&one, &two))
}

fn batch_equals_single(backend: &dyn Backend) -> Result<f64> {
    let rows = roll(&mut stirred(backend, 3, 2)?, &[0, 1, 2], 100, 2)?;
    let mut single = batch(backend, 1, 1)?;
    stir(&mut single, &[2])?;
    let alone = single.run_with(100, 2, &single.command(command(2)), |_| {})?;
    Ok(differing_bits(&rows[200..], &alone))
}

fn subset(backend: &dyn Backend) -> Result<f64> {
    let mut rig = midway(backend)?;
    let mut other = midway(backend)?;
    let before = rig.read()?;
    roll(&mut rig, &[0, 2], 40, 2)?;
    let after = rig.read()?;
    let still = differing_bits(&before[1..2], &after[1..2]);
    let later = roll(&mut rig, &[1], 40, 2)?;
    let alone = roll(&mut other, &[1], 40, 2)?;
    Ok(still + differing_bits(&later, &alone))
}

fn fresh(backend: &dyn Backend) -> Result<f64> {
    let first = roll(&mut stirred(backend, 2, 1)?, &[0, 1], 100, 2)?;
    let second = roll(&mut stirred(backend, 2, 1)?, &[0, 1], 100, 2)?;
    Ok(differing_bits(&first, &second))
}

/// Two batches that run at the same time must not share anything.
fn parallel(backend: &dyn Backend) -> Result<f64> {
    let (mut one, mut two) = (stirred(backend, 2, 1)?, stirred(backend, 2, 1)?);
    let alone = roll(&mut stirred(backend, 2, 1)?, &[0, 1], 100, 2)?;
    let (first, second) = std::thread::scope(|scope| {
        let first = scope.spawn(|| roll(&mut one, &[0, 1], 100, 2));
        let second = roll(&mut two, &[0, 1], 100, 2);
        (first.join(), second)
    });
    let first = first.map_err(|_| asid_core::Error::Failed("a rollout panicked".into()))??;
    Ok(differing_bits(&first, &alone) + differing_bits(&second?, &alone))
}

fn reading(backend: &dyn Backend) -> Result<f64> {
    let mut rig = midway(backend)?;
    let mut other = midway(backend)?;
    let mut looked = Vec::new();
    for _ in 0..10 {
        let read = rig.read()?;
        let again = rig.read()?;
        looked.push(differing_bits(&read, &again));
        roll(&mut rig, &[0, 1, 2], 3, 2)?;
    }
    for _ in 0..10 {
        roll(&mut other, &[0, 1, 2], 3, 2)?;
    }
    Ok(looked.iter().sum::<f64>() + differing_bits(&rig.read()?, &other.read()?))
}

fn joined(backend: &dyn Backend) -> Result<f64> {
    let whole = roll(&mut stirred(backend, 1, 1)?, &[0], 80, 2)?;
    let mut rig = stirred(backend, 1, 1)?;
    let mut parts = roll(&mut rig, &[0], 30, 2)?;
    parts.extend(roll(&mut rig, &[0], 50, 2)?);
    // A reading of the present state must equal the last row.
    parts.extend(rig.read()?);
    let mut expected = whole;
    expected.extend(expected.last().cloned());
    Ok(differing_bits(&parts, &expected))
}

fn frames(backend: &dyn Backend) -> Result<f64> {
    let coarse = roll(&mut stirred(backend, 1, 1)?, &[0], 20, 5)?;
    let fine = roll(&mut stirred(backend, 1, 1)?, &[0], 100, 1)?;
    let every: Rows = fine.into_iter().skip(4).step_by(5).collect();
    Ok(differing_bits(&coarse, &every))
}

fn counted(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 1)?;
    let none = rig.simulator.steps_taken();
    roll(&mut rig, &[0, 2], 7, 3)?;
    Ok(broken([none == 0, rig.simulator.steps_taken() == 42]))
}
