//! States: saved, restored, copied and set; and what results may depend on.
//!
//! Every figure here is a number of readings that differ in any bit.

use asid_core::{Backend, Capabilities, Control, Result, Rollout, Snapshot};

use crate::check::{Check, Tolerance};
use crate::rig::{Rig, Rows, Size, broken, differing_bits};

const MOVING: Capabilities = Capabilities::CONTACT
    .union(Capabilities::ARTICULATION)
    .union(Capabilities::ACTUATORS);
const EXACT: Capabilities = MOVING.union(Capabilities::EXACT_SNAPSHOT);
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
        measure,
    }
}

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check("state/restored-continues", EXACT, restored),
    check("state/restored-in-another-batch", EXACT, restored_elsewhere),
    check("state/rows-of-a-snapshot", EXACT, snapshot_rows),
    check("state/copied-continues", EXACT, copied),
    check("state/set-forgets-history", MOVING, set_state),
    check("state/reset-forgets-history", MOVING, reset),
    check("state/threads-change-nothing", MOVING, threads),
    check("state/batch-equals-single", MOVING, batch_equals_single),
    check("state/subset-leaves-others", MOVING, subset),
    check("state/fresh-batches-agree", MOVING, fresh),
    check("state/parallel-batches-agree", MOVING, parallel),
    check("state/reading-disturbs-nothing", MOVING, reading),
    check("state/rollouts-join", MOVING, joined),
    check("state/frames-are-substeps", MOVING, frames),
    Check {
        name: "state/steps-are-counted",
        needs: MOVING,
        unit: "",
        tolerance: NONE,
        reason: "simulations times frames times substeps: wrong of two",
        measure: counted,
    },
];

/// Boxes that fall on each other, a ball that rolls, an arm that pushes them.
pub const PILE: &str = r#"
  <option cone="elliptic"/>
  <worldbody>
    <geom type="plane" size="5 5 .1" condim="6" friction="0.6 0.005 0.001"/>
    <body name="arm" pos="-0.3 0 0.06"><joint name="turn" axis="0 0 1" damping="0.05" frictionloss="0.02"/>
      <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.03" mass="0.6"/></body>
    <body pos="0 0 0.06"><freejoint name="a"/><geom type="box" size=".05 .05 .05" mass="0.4"/></body>
    <body pos="0.02 0.01 0.17"><freejoint name="b"/><geom type="box" size=".05 .04 .05" mass="0.3"/></body>
    <body pos="0.1 0.1 0.06"><freejoint name="c"/><geom type="sphere" size=".05" mass="0.3"/></body>
  </worldbody>
  <actuator><position name="servo" joint="turn" kp="20" kv="2" ctrlrange="-2 2"/></actuator>"#;

const CHANNELS: [&str; 8] = [
    "qpos.turn",
    "qvel.turn",
    "qpos.a",
    "qvel.a",
    "qpos.b",
    "qvel.b",
    "qpos.c",
    "qvel.c",
];

/// A batch of piles; the simulations differ from the first command on.
fn pile(backend: &dyn Backend, sims: usize, threads: usize) -> Result<Rig> {
    let size = Size {
        sims,
        threads,
        targets: &[],
    };
    Rig::with(backend, PILE, &CHANNELS, size)
}

/// Rolls some simulations, each under its own command, that of its number.
fn roll(rig: &mut Rig, sims: &[usize], frames: usize, substeps: usize) -> Result<Rows> {
    let control: Vec<f64> = sims
        .iter()
        .flat_map(|&sim| (0..frames).map(move |_| 0.4 + 0.3 * sim as f64))
        .collect();
    let width = rig.record.width();
    let mut out = vec![0.0; sims.len() * frames * width];
    let control = Control::PerSimulation(&control);
    let rollout = Rollout::new(sims, frames, substeps, control, &rig.record);
    rig.simulator.rollout(&rollout, &mut out)?;
    Ok(out.chunks(width).map(<[f64]>::to_vec).collect())
}

/// A batch of three in the middle of its motion, and a snapshot of then.
fn midway(backend: &dyn Backend) -> Result<(Rig, Snapshot)> {
    let mut rig = pile(backend, 3, 1)?;
    roll(&mut rig, &[0, 1, 2], 60, 2)?;
    let snapshot = rig.simulator.save(&[0, 1, 2])?;
    Ok((rig, snapshot))
}

fn restored(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, snapshot) = midway(backend)?;
    let first = roll(&mut rig, &[0, 1, 2], 60, 2)?;
    roll(&mut rig, &[0, 2], 10, 1)?;
    rig.simulator.load(&snapshot, &[0, 1, 2], &[0, 1, 2])?;
    let second = roll(&mut rig, &[0, 1, 2], 60, 2)?;
    Ok(differing_bits(&first, &second))
}

fn restored_elsewhere(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, snapshot) = midway(backend)?;
    let first = roll(&mut rig, &[0, 1, 2], 60, 2)?;
    let size = Size {
        sims: 3,
        threads: 2,
        targets: &[],
    };
    let mut other = Rig::of(std::sync::Arc::clone(&rig.model), &CHANNELS, size)?;
    roll(&mut other, &[1], 25, 1)?;
    other.simulator.load(&snapshot, &[0, 1, 2], &[0, 1, 2])?;
    let second = roll(&mut other, &[0, 1, 2], 60, 2)?;
    Ok(differing_bits(&first, &second))
}

fn snapshot_rows(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, snapshot) = midway(backend)?;
    let before = rig.read()?;
    roll(&mut rig, &[0, 1, 2], 10, 1)?;
    rig.simulator.load(&snapshot, &[2, 0], &[0, 1])?;
    let after = rig.read()?;
    let expected = [before[2].clone(), before[0].clone()];
    Ok(differing_bits(&after[..2], &expected))
}

fn copied(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, _) = midway(backend)?;
    rig.simulator.copy_state(&[1, 1], &[0, 2])?;
    let rows = rig.run(60, &[0.9])?;
    Ok(differing_bits(&rows[..60], &rows[60..120]) + differing_bits(&rows[..60], &rows[120..]))
}

fn set_state(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, _) = midway(backend)?;
    let (nq, nv) = {
        let layout = rig.simulator.layout();
        (layout.nq, layout.nv)
    };
    let mut fresh = pile(backend, 1, 1)?;
    let mut qpos = vec![0.0; nq];
    for (i, joint) in ["a", "b", "c"].iter().enumerate() {
        let at = rig.simulator.layout().joint(joint)?.qpos;
        let place = [
            0.1 * i as f64,
            0.02,
            0.05 + 0.08 * i as f64,
            1.0,
            0.0,
            0.1,
            0.0,
        ];
        qpos[at..at + 7].copy_from_slice(&place);
    }
    let qvel: Vec<f64> = (0..nv).map(|i| 0.1 * (i as f64).sin()).collect();
    rig.place(&qpos, &qvel)?;
    fresh.place(&qpos, &qvel)?;
    let used = rig.run(60, &[0.9])?;
    let new = fresh.run(60, &[0.9])?;
    Ok((0..3)
        .map(|sim| differing_bits(&used[60 * sim..60 * (sim + 1)], &new))
        .sum())
}

fn reset(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, _) = midway(backend)?;
    rig.simulator.reset(&[0, 1, 2])?;
    let used = roll(&mut rig, &[0, 1, 2], 80, 2)?;
    let new = roll(&mut pile(backend, 3, 1)?, &[0, 1, 2], 80, 2)?;
    Ok(differing_bits(&used, &new))
}

fn threads(backend: &dyn Backend) -> Result<f64> {
    let all: Vec<usize> = (0..5).collect();
    let one = roll(&mut pile(backend, 5, 1)?, &all, 100, 2)?;
    let two = roll(&mut pile(backend, 5, 2)?, &all, 100, 2)?;
    Ok(differing_bits(&one, &two))
}

fn batch_equals_single(backend: &dyn Backend) -> Result<f64> {
    let rows = roll(&mut pile(backend, 3, 2)?, &[0, 1, 2], 100, 2)?;
    let mut single = pile(backend, 1, 1)?;
    let alone = single.run_with(100, 2, &[0.4], |_| {})?;
    Ok(differing_bits(&rows[..100], &alone))
}

fn subset(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, _) = midway(backend)?;
    let (mut other, _) = midway(backend)?;
    let before = rig.read()?;
    roll(&mut rig, &[0, 2], 40, 2)?;
    let after = rig.read()?;
    let still = differing_bits(&before[1..2], &after[1..2]);
    let later = roll(&mut rig, &[1], 40, 2)?;
    let alone = roll(&mut other, &[1], 40, 2)?;
    Ok(still + differing_bits(&later, &alone))
}

fn fresh(backend: &dyn Backend) -> Result<f64> {
    let first = roll(&mut pile(backend, 2, 1)?, &[0, 1], 100, 2)?;
    let second = roll(&mut pile(backend, 2, 1)?, &[0, 1], 100, 2)?;
    Ok(differing_bits(&first, &second))
}

/// Two batches that run at the same time share nothing.
fn parallel(backend: &dyn Backend) -> Result<f64> {
    let (mut one, mut two) = (pile(backend, 2, 1)?, pile(backend, 2, 1)?);
    let alone = roll(&mut pile(backend, 2, 1)?, &[0, 1], 100, 2)?;
    let (first, second) = std::thread::scope(|scope| {
        let first = scope.spawn(|| roll(&mut one, &[0, 1], 100, 2));
        let second = roll(&mut two, &[0, 1], 100, 2);
        (first.join(), second)
    });
    let first = first.map_err(|_| asid_core::Error::Failed("a rollout panicked".into()))??;
    Ok(differing_bits(&first, &alone) + differing_bits(&second?, &alone))
}

fn reading(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, _) = midway(backend)?;
    let (mut other, _) = midway(backend)?;
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
    let whole = roll(&mut pile(backend, 1, 1)?, &[0], 80, 2)?;
    let mut rig = pile(backend, 1, 1)?;
    let mut parts = roll(&mut rig, &[0], 30, 2)?;
    parts.extend(roll(&mut rig, &[0], 50, 2)?);
    // The last row is also what a reading of the present gives.
    parts.extend(rig.read()?);
    let mut expected = whole;
    expected.extend(expected.last().cloned());
    Ok(differing_bits(&parts, &expected))
}

fn frames(backend: &dyn Backend) -> Result<f64> {
    let coarse = roll(&mut pile(backend, 1, 1)?, &[0], 20, 5)?;
    let fine = roll(&mut pile(backend, 1, 1)?, &[0], 100, 1)?;
    let every: Rows = fine.into_iter().skip(4).step_by(5).collect();
    Ok(differing_bits(&coarse, &every))
}

fn counted(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pile(backend, 3, 1)?;
    let none = rig.simulator.steps_taken();
    roll(&mut rig, &[0, 2], 7, 3)?;
    Ok(broken([none == 0, rig.simulator.steps_taken() == 42]))
}
