//! What a replay leaves of the logs held out beyond what their starts leave open.
//!
//! A start that was fitted on the first tenth of a log is known to some covariance, and a small error of it grows over the rest of the log.
//! What counts is therefore what no start makes up for: the squared residuals of the whole log, with its start fitted to the whole of it, less those of
//! its first tenth, with its start fitted to that. Where replays are linear in the start this is the squared Mahalanobis distance of the
//! rest from its prediction, `r' (I + J S J')^-1 r` in units of the noise, with `J` the derivatives of the rest in the start and `S` the
//! covariance of the start by the first tenth, and a step of Gauss and Newton or two from the start of the first tenth is all it takes. Replays that lie
//! far from a log are not linear in it, and a slope there makes up for too much: where they do not keep what the slopes promise, the start is
//! fitted to the log part by part.

mod linear;

use asid_core::progress::UntilLate;
use asid_core::{Error, Progress, Result};

use crate::fit::{Begin, Effort, Fit, cost, fit};
use crate::linearise::Unknown;
use crate::predict::{Point, State};

use linear::linear;

use super::{Bench, Explanation, Trial};

/// Physics steps of all logs held out times open coordinates of their starts, beyond which starts count as known, for each is a replay: ten
/// seconds of one core, in machines of many joints.
const AFFORDABLE: usize = 500_000;
/// The same beyond which they are not fitted part by part, which takes each replay some thirty times.
const PART_BY_PART: usize = 100_000;

/// Shares of the logs that starts are fitted to, one from where the one before has come to: a start that the first tenth leaves open by much may
/// lead so far off the rest that no slope leads back from there.
const SHARES: [f64; 4] = [0.2, 0.4, 0.7, 1.0];

/// An explanation, and its effects as trials.
pub type Explained<'a> = (&'a [Trial<'a>], &'a Explanation);

/// Squared distances of the readings held out from those that explanations predict, in units of the noise, that no start of their logs makes up
/// for; infinite where a replay diverges. Once it is late, slopes have to do.
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
        // What one was fitted with time and the other without is no comparison.
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

/// Squared residuals of the whole logs with their starts fitted part by part. A fit of starts may end in a valley of its own: each begins where the
/// others have ended too.
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

/// What a model with some effects has of unknowns, none of them free.
fn given(bench: &Bench, trials: &[Trial<'_>]) -> Vec<Unknown> {
    let mut unknowns = bench.unknowns(trials);
    unknowns.iter_mut().for_each(|u| u.free = false);
    unknowns
}

/// Fits the starts of the logs held out to some shares of them, one after the other.
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

/// Squared residuals of the first tenth, from the starts that were fitted to it.
fn head(bench: &Bench, (trials, of): &Explained<'_>) -> Result<f64> {
    let point = Point {
        theta: of.fit.point.theta.clone(),
        starts: of.held_starts.clone(),
    };
    let mut predictor = bench.predictor(trials, &bench.head)?;
    let residuals = predictor.residuals(std::slice::from_ref(&point))?.pop();
    Ok(cost(&residuals.unwrap_or_default()))
}
