//! Checks whether a parameter has any effect.
//!
//! A target may exist and still change nothing: a friction that another geom's priority overrides,
//! or the mass of a body that never moves. The check throws everything that can move, at both ends
//! of the parameter's range; the readings must differ.

use rand::Rng as _;

use asid_core::error::{Error, Result};
use asid_core::problem::{Problem, home};
use asid_core::rng::Rng;
use asid_core::simulator::{Control, Rollout};

/// Throws per round that are compared.
const THROWS: usize = 4;
/// Frames of a throw: in the first round, and in later rounds for parameters that showed no effect
/// yet, since some objects are far away.
const FRAMES: [usize; 2] = [30, 120];
/// Number of rounds; each gives random throws another chance to touch what earlier ones missed.
const ROUNDS: usize = 8;
/// Largest speed of a throw, m/s or rad/s.
const SPEED: f64 = 1.0;

/// Checks that every unknown of the problem changes at least one reading.
///
/// # Errors
/// [`Error::Parameter`] naming the first unknown that changes none.
pub fn check_parameters(problem: &Problem<'_>) -> Result<()> {
    let mut rng = problem.streams.stream("sensitivity");
    let mut silent: Vec<usize> = (0..problem.parameters.len()).collect();
    for round in 0..ROUNDS {
        let frames = FRAMES[round.min(1)];
        let acts = throw(problem, &silent, frames, &mut rng)?;
        let mut acts = acts.into_iter();
        silent.retain(|_| !acts.next().unwrap_or(false));
        if silent.is_empty() {
            return Ok(());
        }
    }
    let p = &problem.parameters[silent[0]];
    let targets: Vec<String> = p.targets.iter().map(ToString::to_string).collect();
    Err(Error::Parameter {
        parameter: p.name.clone(),
        message: format!(
            "changes nothing in this scene: no reading differs between {} and {} for target {}",
            p.from_unit(0.05),
            p.from_unit(0.95),
            targets.join(", ")
        ),
    })
}

/// Throws everything for some frames at both ends of each of `unknowns`; returns which of them have
/// an effect.
fn throw(
    problem: &Problem<'_>,
    unknowns: &[usize],
    frames: usize,
    rng: &mut Rng,
) -> Result<Vec<bool>> {
    let protocol = problem.task.exploration();
    let layout = problem.model.layout();
    let recording = layout.recording(&protocol.channels())?;
    let substeps = problem.substeps(protocol.frame_period)?;
    let center: Vec<f64> = problem.parameters.iter().map(|p| p.center()).collect();
    let n = 2 * unknowns.len() * THROWS;
    let mut batch = problem.batch(n)?;
    let sims: Vec<usize> = (0..n).collect();
    let mut theta = Vec::with_capacity(n * center.len());
    for &i in unknowns {
        for u in [0.05, 0.95] {
            for _ in 0..THROWS {
                let mut row = center.clone();
                row[i] = problem.parameters[i].from_unit(u);
                theta.extend(row);
            }
        }
    }
    let (qpos, qvel) = home(layout);
    let throws: Vec<f64> = (0..THROWS * qvel.len())
        .map(|_| rng.random_range(-SPEED..SPEED))
        .collect();
    batch.set_parameters(&sims, &theta)?;
    batch.simulator.reset(&sims)?;
    batch
        .simulator
        .set_state(&sims, &qpos.repeat(n), &throws.repeat(2 * unknowns.len()))?;
    let still = layout
        .keyframes
        .first()
        .map_or_else(|| vec![0.0; layout.nu()], |k| k.ctrl.clone());
    let control = still.repeat(frames);
    let row = frames * recording.width();
    let mut out = vec![0.0; n * row];
    let before = batch.simulator.steps_taken();
    let rollout = Rollout::new(
        &sims,
        frames,
        substeps,
        Control::Shared(&control),
        &recording,
    );
    batch.simulator.rollout(&rollout, &mut out)?;
    problem.count_physics(&batch, before);
    let acts = |both: &[f64]| {
        let (low, high) = both.split_at(THROWS * row);
        // A throw that diverged has no readings to compare.
        let apart = |(a, b): (&f64, &f64)| a.is_finite() && b.is_finite() && a != b;
        low.iter().zip(high).any(apart)
    };
    Ok(out.chunks_exact(2 * THROWS * row).map(acts).collect())
}
