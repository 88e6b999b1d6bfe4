//! Batches, snapshots and models: lifetimes, sizes, and equivalent forms of one request.
//!
//! Every figure is a number of readings that differ in any bit, or of broken promises.

use std::sync::Arc;

use asid_core::{Backend, Capabilities, Control, Error, Result, Rollout};

use crate::check::Check;
use crate::faults::{ANY, check};
use crate::rig::{ONE, Rig, Rows, broken, differing_bits, state_channels};
use crate::subject::{batch, command, roll, stir, stirred, subject};

const EXACT: Capabilities = Capabilities::EXACT_SNAPSHOT;

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "state/snapshot-outlives-its-batch",
        EXACT,
        "to the bit: readings that differ in a batch of the same model, once that of the snapshot is gone",
        outlives_batch,
    ),
    check(
        "state/batch-outlives-its-model",
        ANY,
        "to the bit: readings that differ once nobody else holds the model",
        outlives_model,
    ),
    check(
        "state/dropped-in-any-order",
        EXACT,
        "to the bit: readings of what is left that differ, whichever of batch, batch, snapshot and model goes first",
        any_order,
    ),
    check(
        "state/snapshot-of-another-scene",
        EXACT,
        "an error each, for another document, the same with other masses, and data of another engine: accepted of three",
        foreign,
    ),
    check(
        "state/snapshot-keeps-no-parameters",
        EXACT,
        "to the bit: readings that differ where a state comes from a simulation with other parameters",
        without_parameters,
    ),
    check(
        "state/snapshots-of-snapshots",
        EXACT,
        "to the bit: readings that differ after a state went through three batches",
        handed_on,
    ),
    check(
        "state/large-batch",
        ANY,
        "to the bit: readings of the last of 1500 simulations that differ from those of one alone",
        large,
    ),
    check(
        "state/more-threads-than-simulations",
        ANY,
        "to the bit: readings that differ",
        many_threads,
    ),
    check(
        "state/shared-commands-are-commands",
        ANY,
        "to the bit: readings that differ between one trajectory for all and the same for each",
        shared_commands,
    ),
    check(
        "state/channels-change-nothing-else",
        ANY,
        "to the bit: readings that differ where channels are recorded in another order, twice, or alone",
        channels,
    ),
];

fn outlives_batch(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 2, 1)?;
    roll(&mut rig, &[0, 1], 30, 2)?;
    let snapshot = rig.simulator.save(&[0, 1])?;
    let expected = roll(&mut rig, &[0, 1], 30, 2)?;
    let mut other = rig.another(2, 1)?;
    drop(rig);
    other.simulator.load(&snapshot, &[0, 1], &[0, 1])?;
    Ok(differing_bits(
        &expected,
        &roll(&mut other, &[0, 1], 30, 2)?,
    ))
}

fn outlives_model(backend: &dyn Backend) -> Result<f64> {
    let expected = roll(&mut stirred(backend, 2, 1)?, &[0, 1], 40, 2)?;
    let rig = stirred(backend, 2, 1)?;
    let (control, record) = (rig.command(0.0), rig.record.clone());
    let Rig {
        model,
        mut simulator,
        ..
    } = rig;
    drop(model);
    let control: Vec<f64> = (0..2)
        .flat_map(|sim| vec![command(sim); 40 * control.len()])
        .collect();
    let mut out = vec![0.0; 80 * record.width()];
    let control = Control::PerSimulation(&control);
    simulator.rollout(&Rollout::new(&[0, 1], 40, 2, control, &record), &mut out)?;
    let rows: Rows = out.chunks(record.width()).map(<[f64]>::to_vec).collect();
    Ok(differing_bits(&expected, &rows))
}

fn any_order(backend: &dyn Backend) -> Result<f64> {
    let mut different = 0.0;
    for first in 0..4 {
        let mut one = stirred(backend, 1, 1)?;
        roll(&mut one, &[0], 20, 1)?;
        let mut two = one.another(1, 1)?;
        let mut snapshot = Some(one.simulator.save(&[0])?);
        if let Some(snapshot) = &snapshot {
            two.simulator.load(snapshot, &[0], &[0])?;
        }
        let expected = roll(&mut stirred(backend, 1, 1)?, &[0], 40, 1)?.split_off(20);
        let (mut one, mut two) = (Some(one), Some(two));
        match first {
            0 => one = None,
            1 => two = None,
            2 => snapshot = None,
            _ => {}
        }
        for rig in [&mut one, &mut two].into_iter().flatten() {
            different += differing_bits(&roll(rig, &[0], 20, 1)?, &expected);
        }
        // The snapshot is dropped last, when nothing else of the scene is left.
        drop((two, one));
        different += f64::from(u8::from(snapshot.is_some_and(|s| s.rows() != 1)));
    }
    Ok(different)
}

fn foreign(backend: &dyn Backend) -> Result<f64> {
    let subject = subject(backend);
    let mut rig = Rig::new(backend, &subject.inside, &[])?;
    let heavier = subject.inside.replace("mass=\"0.3\"", "mass=\"0.35\"");
    let mut heavier = Rig::new(backend, &heavier, &[])?;
    let other = crate::subject::falling(backend);
    let mut other = Rig::new(backend, other.inside, &[])?;
    let snapshots = [
        other.simulator.save(&[0])?,
        heavier.simulator.save(&[0])?,
        asid_core::Snapshot::new("of no engine", 1),
    ];
    Ok(broken(snapshots.map(|snapshot| {
        rig.simulator.load(&snapshot, &[0], &[0]).is_err()
    })))
}

fn without_parameters(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, mut other) = (stirred(backend, 2, 1)?, stirred(backend, 2, 1)?);
    rig.set(&[-3.0, 0.0, -9.81, 0.0])?;
    other.set(&[-9.81, 0.0, -9.81, 0.0])?;
    // The state of a simulation on which nothing has acted yet, under other parameters.
    let snapshot = rig.simulator.save(&[0])?;
    rig.simulator.load(&snapshot, &[0], &[1])?;
    let state = other.simulator.save(&[0])?;
    other.simulator.load(&state, &[0], &[1])?;
    let (found, expected) = (roll(&mut rig, &[1], 40, 2)?, roll(&mut other, &[1], 40, 2)?);
    Ok(differing_bits(&found, &expected))
}

fn handed_on(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 1, 1)?;
    roll(&mut rig, &[0], 30, 2)?;
    let mut snapshot = rig.simulator.save(&[0])?;
    let expected = roll(&mut rig, &[0], 30, 2)?;
    for _ in 0..3 {
        let mut next = rig.another(2, 1)?;
        next.simulator.load(&snapshot, &[0], &[1])?;
        snapshot = next.simulator.save(&[1])?;
    }
    rig.simulator.load(&snapshot, &[0], &[0])?;
    Ok(differing_bits(&expected, &roll(&mut rig, &[0], 30, 2)?))
}

fn large(backend: &dyn Backend) -> Result<f64> {
    let size = 1500;
    let mut rig = stirred(backend, size, 2)?;
    let all = rig.all();
    let rows = roll(&mut rig, &all, 2, 1)?;
    let mut single = batch(backend, 1, 1)?;
    stir(&mut single, &[size - 1])?;
    let alone = single.run_with(2, 1, &single.command(command(size - 1)), |_| {})?;
    Ok(differing_bits(&rows[2 * (size - 1)..], &alone))
}

fn many_threads(backend: &dyn Backend) -> Result<f64> {
    let few = roll(&mut stirred(backend, 2, 1)?, &[0, 1], 40, 2)?;
    let many = roll(&mut stirred(backend, 2, 16)?, &[0, 1], 40, 2)?;
    Ok(differing_bits(&few, &many))
}

fn shared_commands(backend: &dyn Backend) -> Result<f64> {
    let mut one = stirred(backend, 3, 1)?;
    let shared = one.run_with(40, 2, &one.command(0.7), |_| {})?;
    let mut two = stirred(backend, 3, 1)?;
    let control = two.command(0.7).repeat(3 * 40);
    let width = two.record.width();
    let mut out = vec![0.0; 120 * width];
    let all = [0, 1, 2];
    let control = Control::PerSimulation(&control);
    let rollout = Rollout::new(&all, 40, 2, control, &two.record);
    two.simulator.rollout(&rollout, &mut out)?;
    let each: Rows = out.chunks(width).map(<[f64]>::to_vec).collect();
    Ok(differing_bits(&shared, &each))
}

fn channels(backend: &dyn Backend) -> Result<f64> {
    let inside = subject(backend).inside;
    let model = backend.load(&crate::rig::scene(&inside)?)?;
    let names = state_channels(model.layout());
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let rows = |channels: &[&str]| -> Result<Rows> {
        let mut rig = Rig::of(Arc::clone(&model), channels, ONE)?;
        roll(&mut rig, &[0], 40, 2)
    };
    let all = rows(&names)?;
    let first = names
        .first()
        .copied()
        .ok_or_else(|| Error::Failed("the scene has no joint".into()))?;
    // The first name twice, then all others from the last.
    let mut order: Vec<&str> = names.iter().rev().copied().collect();
    order.insert(0, first);
    let (shuffled, alone) = (rows(&order)?, rows(&[first])?);
    let layout = model.layout();
    let record = layout.recording(&names)?;
    let expected: Rows = all
        .iter()
        .map(|row| {
            let mut expected = row[record.range(0)].to_vec();
            for i in (0..names.len()).rev() {
                expected.extend(&row[record.range(i)]);
            }
            expected
        })
        .collect();
    let only: Rows = all
        .iter()
        .map(|row| row[record.range(0)].to_vec())
        .collect();
    Ok(differing_bits(&shuffled, &expected) + differing_bits(&alone, &only))
}
