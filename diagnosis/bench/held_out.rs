//! The misfit of replays to the held-out logs that no choice of initial states can remove.
//!
//! An initial state that was fitted on the first tenth of a log has some covariance. A small error
//! of it grows over the rest of the log. The misfit is therefore what no initial state makes up
//! for. It is the squared residuals of the whole log less those of the first tenth, each with the
//! initial state fitted to that part.
//!
//! Where replays are linear in the initial state, the misfit is `r' (I + J S J')^-1 r` in units of
//! the noise: the squared Mahalanobis distance of the rest from its prediction. `J` are the
//! derivatives of the rest with respect to the initial state, `S` is the initial state's covariance
//! from the first tenth. One or two Gauss-Newton steps from the initial state of the first tenth
//! are then enough.
//!
//! Replays that lie far from a log are not linear in the initial state, and derivatives there
//! promise too much. Where replays do not achieve what the derivatives predict, the initial state
//! is fitted to the log part by part.

mod linear;

use asid_core::progress::UntilLate;
use asid_core::{Error, Progress, Result};

use crate::fit::{Begin, Effort, Fit, cost, fit};
use crate::linearise::Unknown;
use crate::predict::{Point, State};

use linear::linear;

use super::{Bench, Explanation, Trial};

/// Physics steps of all held-out logs times unknown coordinates, beyond which initial states count
/// as known.
///
/// Each coordinate is a replay: ten seconds of one core, in machines of many joints.
const AFFORDABLE: usize = 500_000;
/// The same product, beyond which initial states are not fitted part by part, which takes some
/// thirty times as many replays.
const PART_BY_PART: usize = 100_000;

/// Shares of the logs to which initial states are fitted, each from the result of the one before.
///
/// If the first tenth leaves an initial state very uncertain, the replay may end far from the rest
/// of the log. No derivative leads back from there.
const SHARES: [f64; 4] = [0.2, 0.4, 0.7, 1.0];

/// An explanation, with its effects as trials.
pub type Explained<'a> = (&'a [Trial<'a>], &'a Explanation);

/// Returns for each explanation the squared distance of the held-out readings from their prediction
/// that no initial state makes up for.
///
/// It is in units of the noise, and infinite where a replay diverges. Once `progress` is late, only
/// derivatives are used.
///
/// # Errors
/// When a rollout fails.
pub fn misfits(
    bench: &Bench,
    explained: &[Explained<'_>],
    progress: &dyn Progress,
) -> Result<Vec<f64>> {
    let steps = bench.test.logs.episodes.iter();
    let steps: usize = steps.map(|e| e.plan.physics_steps()).sum();
    let size = steps * bench.open.len();
    if bench.open.is_empty() || size > AFFORDABLE {
        return Ok(explained.iter().map(|(_, of)| of.held_out).collect());
    }
    let by_slopes = explained.iter().map(|of| linear(bench, of));
    let by_slopes: Vec<_> = by_slopes.collect::<Result<_>>()?;
    let mut left: Vec<f64> = by_slopes.iter().map(|l| l.cost).collect();
    if size <= PART_BY_PART && by_slopes.iter().any(|l| !l.is_kept) && !progress.is_late() {
        let fitted = part_by_part(bench, explained, progress)?;
        // A fit that had enough time cannot be compared with one that had not.
        let fitted = fitted.into_iter().filter(|_| !progress.is_late());
        left.iter_mut().zip(fitted).for_each(|(l, f)| *l = l.min(f));
    }
    let misfit = |(left, of): (f64, &Explained<'_>)| -> Result<f64> {
        let left = left - head(bench, of)?;
        Ok(if left.is_finite() {
            left.max(0.0)
        } else {
            f64::INFINITY
        })
    };
    left.into_iter().zip(explained).map(misfit).collect()
}

/// Returns the squared residuals of the whole logs with their initial states fitted part by part.
///
/// A fit may end in a local minimum. Each is therefore repeated from where the others have ended.
fn part_by_part(
    bench: &Bench,
    explained: &[Explained<'_>],
    progress: &dyn Progress,
) -> Result<Vec<f64>> {
    let fitted = |of: &Explained<'_>, starts: Vec<State>, shares: &[f64]| {
        fitted(bench, of, (starts, shares), progress)
    };
    let fits: Vec<Fit> = (explained.iter())
        .map(|of| fitted(of, of.1.held_starts.clone(), &SHARES[..]))
        .collect::<Result<_>>()?;
    let least = |(i, of): (usize, &Explained<'_>)| -> Result<f64> {
        let mut left = fits[i].cost;
        for (_, other) in fits.iter().enumerate().filter(|(j, _)| *j != i) {
            let from = other.point.starts.clone();
            left = left.min(fitted(of, from, &[1.0])?.cost);
        }
        Ok(left)
    };
    explained.iter().enumerate().map(least).collect()
}

/// Returns the unknowns of a model with some effects, all held.
fn given(bench: &Bench, trials: &[Trial<'_>]) -> Vec<Unknown> {
    let mut unknowns = bench.unknowns(trials);
    unknowns.iter_mut().for_each(|u| u.free = false);
    unknowns
}

/// Fits the initial states of the held-out logs to increasing shares of the logs.
fn fitted(
    bench: &Bench,
    (trials, of): &Explained<'_>,
    (starts, shares): (Vec<State>, &[f64]),
    progress: &dyn Progress,
) -> Result<Fit> {
    let unknowns = given(bench, trials);
    let mut found: Option<Fit> = None;
    for &share in shares {
        let begin = Point {
            theta: of.fit.point.theta.clone(),
            starts: (found.as_ref()).map_or_else(|| starts.clone(), |f| f.point.starts.clone()),
        };
        let part = bench.test.cut(bench.layout(), share);
        let before = found.map(|fit| fit.starts);
        let begin = Begin {
            like: before.as_deref(),
            ..Begin::at(begin, (&bench.open, &bench.reach))
        };
        found = Some(fit(
            &mut bench.predictor(trials, &part)?,
            (bench.layout(), &unknowns),
            begin,
            (Effort::BRIEF, &UntilLate(progress)),
        )?);
    }
    found.ok_or_else(|| Error::Failed("there is no share of the logs to fit starts to".into()))
}

/// Returns the squared residuals of the first tenth, from the initial states that were fitted to
/// it.
fn head(bench: &Bench, (trials, of): &Explained<'_>) -> Result<f64> {
    let point = Point {
        theta: of.fit.point.theta.clone(),
        starts: of.held_starts.clone(),
    };
    let mut predictor = bench.predictor(trials, &bench.head)?;
    let residuals = predictor.residuals(std::slice::from_ref(&point))?.pop();
    Ok(cost(&residuals.unwrap_or_default()))
}
