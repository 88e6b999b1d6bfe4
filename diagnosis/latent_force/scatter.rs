//! How far replays of a segment scatter although nothing is missing.
//!
//! A replay is known only as well as its initial state and its integrator. A puck that is pushed at
//! an edge turns left or right within what the readings leave open of its initial state. Its
//! replays are then far apart, and derivatives do not describe them. Initial states are therefore
//! drawn from the posterior. What their replays do *beyond* the derivatives is the error of the
//! linearisation. Its covariance is added to that of the readings, as in posterior linearisation
//! (García-Fernández, Svensson, Morelande and Särkkä 2015). The covariance is of low rank. Each
//! draw is a direction with a coefficient of its own, `N(0, 1)`, that is projected out together
//! with the initial state. The change at half the time step is one more direction.

use asid_core::Result;
use asid_core::rng::Streams;
use nalgebra::DVector;
use rand::Rng as _;
use rand_distr::StandardNormal;

use crate::machine::Machine;

use super::context::Context;
use super::estimate::Estimate;
use super::fit::{Hypothesis, Slopes};
use super::step_map::{Anew, Derivatives, LinearEpisode, StepMap};
use super::tangent::retract;
use super::walk::Walk;

/// Initial states that are drawn: the fewest that give the standard deviation of a reading to a
/// quarter.
const DRAWS: usize = 8;
/// Share of the change at half the time step that each segment may have of its own.
///
/// Another integrator errs in another way, and not in the same proportion everywhere.
const OWN_INTEGRATOR: f64 = 0.3;

/// Directions in which the replays of each walk scatter.
///
/// `rows x readings x directions`, in the sensors' units.
#[derive(Clone, Debug, Default)]
pub struct Scatter {
    /// Directions of each walk; empty for one that is no segment.
    pub directions: Vec<Vec<f64>>,
    /// Share of the rows in segments whose readings scatter by more than their noise, among those
    /// with a reading that counts.
    pub lost: f64,
    /// Linearisation about the trajectory, beyond which the directions are; without derivatives
    /// with respect to the state along walks that are no segments.
    pub linear: Vec<LinearEpisode>,
}

impl Scatter {
    /// Scatter of the segments about a model at some values and its estimate.
    ///
    /// Coordinates to which segments are blind, as `seen` records, have no derivatives. `finer` is
    /// the machine at half its time step, if the engine takes it.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        context: &Context<'_>,
        (hypothesis, theta): (&Hypothesis, &[f64]),
        (estimate, seen): (&Estimate, &Slopes),
        finer: Option<&Machine>,
    ) -> Result<Self> {
        let parameters = hypothesis.parameters();
        let specs = &hypothesis.specs;
        let nx = 2 * context.plant().layout.nv;
        let mut map = context.map(specs, &parameters, nx + 1)?;
        let slopes = Derivatives {
            state: true,
            ..Derivatives::default()
        };
        let segments: Vec<bool> = context.walks.iter().map(|w| w.segment.is_some()).collect();
        let anew = Anew {
            state: &segments,
            blind: seen.blind(),
            ..Anew::default()
        };
        let (states, steps) = (&estimate.trajectory, context.start_steps());
        let here = map.linearise_anew(theta, states, (slopes, anew), &steps, &[])?;
        let mut all = drawn(context, (&mut map, theta), estimate, &here)?;
        if let Some(finer) = finer {
            let walks: Vec<Walk> = context.walks.iter().map(Walk::halved).collect();
            let rows = (context.logs, &walks[..]);
            let mut map = StepMap::new(finer, specs, &parameters, rows, 1)?;
            let there = map.linearise(theta, states, Derivatives::default(), &[], &[])?;
            let still = vec![DVector::zeros(nx); here.len()];
            all.push(scaled(OWN_INTEGRATOR, beyond_slopes(&here, &there, &still)));
        }
        let directions = context.walks.iter().enumerate().map(|(w, walk)| {
            if walk.segment.is_none() {
                return Vec::new();
            }
            // The directions are the columns of one array.
            let readings = 0..here[w].residual.len();
            let row = |at: usize| all.iter().map(move |d| d[w][at]);
            readings.flat_map(row).collect()
        });
        let directions: Vec<Vec<f64>> = directions.collect();
        Ok(Self {
            lost: lost((&directions, all.len()), &here, &estimate.noise.r),
            directions,
            linear: here,
        })
    }
}

/// Part of the readings of each walk that derivatives do not predict, along one direction.
type Beyond = Vec<Vec<f64>>;

/// Directions from replays of initial states that are drawn from the posterior.
fn drawn(
    context: &Context<'_>,
    (map, theta): (&mut StepMap<'_>, &[f64]),
    estimate: &Estimate,
    here: &[LinearEpisode],
) -> Result<Vec<Beyond>> {
    let layout = &context.plant().layout;
    let roots = estimate.start_roots(context, here);
    let mut random = Streams::new(estimate.rolls).stream("scatter of segments");
    let share = (DRAWS as f64).sqrt().recip();
    let mut all = Vec::with_capacity(DRAWS);
    for _ in 0..DRAWS {
        let mut states = estimate.trajectory.clone();
        let mut changes = Vec::with_capacity(here.len());
        for (states, root) in states.iter_mut().zip(&roots) {
            let mut normal = || random.sample::<f64, _>(StandardNormal);
            let change = if root.ncols() == 0 {
                DVector::zeros(2 * layout.nv)
            } else {
                root * DVector::from_fn(root.ncols(), |_, _| normal())
            };
            retract(
                layout,
                &mut states[..layout.nq + layout.nv],
                change.as_slice(),
            );
            changes.push(change);
        }
        let there = map.linearise(theta, &states, Derivatives::default(), &[], &[])?;
        all.push(scaled(share, beyond_slopes(here, &there, &changes)));
    }
    Ok(all)
}

/// Readings of replays from changed initial states, beyond what derivatives predict; zero if
/// missing.
fn beyond_slopes(
    here: &[LinearEpisode],
    there: &[LinearEpisode],
    changes: &[DVector<f64>],
) -> Beyond {
    let of_walk = |((here, there), change): ((&LinearEpisode, &LinearEpisode), &DVector<f64>)| {
        let nx = change.len();
        let each = here.residual.iter().zip(&there.residual).enumerate();
        each.map(|(at, (a, b))| {
            let slopes = &here.h[at * nx..(at + 1) * nx];
            let linear: f64 = slopes.iter().zip(change.iter()).map(|(h, c)| h * c).sum();
            let beyond = a - b - linear;
            if beyond.is_finite() { beyond } else { 0.0 }
        })
        .collect()
    };
    here.iter().zip(there).zip(changes).map(of_walk).collect()
}

fn scaled(by: f64, mut beyond: Beyond) -> Beyond {
    beyond.iter_mut().flatten().for_each(|x| *x *= by);
    beyond
}

/// Share of the rows of all segments whose readings, of variances `r`, scatter by more than their
/// noise, along `n` directions.
///
/// Readings that are missing or belong to a lead, and rows without any other, count neither way.
fn lost((directions, n): (&[Vec<f64>], usize), here: &[LinearEpisode], r: &[f64]) -> f64 {
    let (mut lost, mut rows) = (0_u32, 0_u32);
    for (own, here) in directions.iter().zip(here) {
        let residuals = here.residual.chunks_exact(r.len());
        for (row, residuals) in own.chunks_exact(n * r.len()).zip(residuals) {
            let each = row.chunks_exact(n).zip(r).zip(residuals);
            let (mut power, mut present) = (0.0, 0_u32);
            for ((x, r), _) in each.filter(|(_, residual)| residual.is_finite()) {
                power += x.iter().map(|x| x * x).sum::<f64>() / r;
                present += 1;
            }
            lost += u32::from(power > f64::from(present));
            rows += u32::from(present > 0);
        }
    }
    f64::from(lost) / f64::from(rows.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a segment, and their directions: one, of three deviations of either reading.
    const ROWS: usize = 10;
    const ALONG: [f64; 2] = [3e-3, 0.3];
    /// Variances of the readings.
    const R: [f64; 2] = [1e-6, 1e-2];

    /// Share of the rows that are lost if some readings are missing.
    fn lost_without(is_missing: impl Fn(usize, usize) -> bool) -> f64 {
        let or = |at: usize, missing: f64, read: f64| {
            let is_missing = is_missing(at / 2, at % 2);
            if is_missing { missing } else { read }
        };
        let here = LinearEpisode {
            rows: ROWS,
            residual: (0..2 * ROWS).map(|at| or(at, f64::NAN, 0.1)).collect(),
            ..LinearEpisode::default()
        };
        // The directions of missing readings are zero.
        let along = |at: usize| or(at, 0.0, ALONG[at % 2]);
        let segment: Vec<f64> = (0..2 * ROWS).map(along).collect();
        // The second walk is no segment.
        lost((&[segment, Vec::new()], 1), &[here.clone(), here], &R)
    }

    /// Symptom: replays of a puck that scattered in every row in which a camera saw the puck
    /// counted as repeatable. Cause: rows without a reading counted as rows that repeat.
    #[test]
    fn the_share_of_lost_rows_is_that_of_the_rows_with_a_reading() {
        assert_eq!(lost_without(|_, _| false), 1.0);
        assert_eq!(lost_without(|k, s| k % 3 != 0 && s == 1), 1.0);
        // A lead of four rows, and rows without any reading.
        assert_eq!(lost_without(|k, _| k < 4), 1.0);
        assert_eq!(lost_without(|k, _| k % 3 != 0), 1.0);
        assert_eq!(lost_without(|_, _| true), 0.0);
    }
}
