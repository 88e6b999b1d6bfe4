//! A search among the local minima (valleys) of a rough loss.
//!
//! Where bodies make and break contact, the loss of open-loop replays jumps: a step of a hundredth
//! of a prior standard deviation changes which contact comes first. A linear fit over a region of
//! such a loss predicts a minimum that its own replay does not confirm. Damped steps end in the
//! first of many valleys.
//!
//! The point that a fit arrives at is therefore replayed. If its loss exceeds the best replay's by
//! more than chance explains, the search continues by covariance matrix adaptation (N. Hansen,
//! arXiv:1604.00772). Draws about the best point are ranked by their own replays, and the mean of
//! the draws averages over single jumps. The uncertainty of the values remains that of the fit over
//! the whole region, roughness included.

use asid_algorithms::fisher::inverse_above_prior;
use asid_algorithms::optimise::cma_es::{CmaEs, CmaEsSettings};
use asid_algorithms::optimise::gauss_newton::{
    Fit, GaussNewtonSettings, Residuals, Space, minimise,
};
use asid_core::Progress;
use asid_core::error::Result;
use asid_core::rng::Rng;
use nalgebra::DMatrix;

/// Excess of the half sum of squares at a fitted point over the best seen that is still accepted.
///
/// Beyond it a point lies outside the 95 % interval of one unknown, whose chi-squared is 3.84.
const UNCONFIRMED: f64 = 1.92;

/// Largest initial standard deviation of the draws, in prior standard deviations.
///
/// It is a sixth of a uniform range. With 0.1 the search of a quadruped's knee stayed 0.4 from its
/// value.
const SPREAD: f64 = 0.3;

/// Initial standard deviation of the draws, in posterior standard deviations of the fit.
///
/// It is wide enough to leave a wrong valley. It is narrow enough that an unknown known to a
/// thousandth does not take the first half of the search.
const WIDEN: f64 = 10.0;

/// Draws of a generation: six times what smooth losses of five unknowns take.
///
/// There are many valleys to compare. With 24 a quadruped's search stayed in the first one for some
/// random draws.
const DRAWS: usize = 48;

/// Most generations: the quadruped's search had converged after 20 to 30.
const GENERATIONS: usize = 30;

/// A generation has converged where its half sums of squares differ by less than this.
///
/// It is a tenth of [`UNCONFIRMED`].
const ALIKE: f64 = 0.2;

/// First half step of the fit over the region about the best point, in prior standard deviations.
///
/// It is the posterior standard deviation of an unknown after a good motion.
const REGION: f64 = 0.02;

/// Evaluates residuals, and remembers the best point so far.
pub(crate) struct Watched<'r, 'f> {
    of: &'r mut Residuals<'f>,
    /// The point with the smallest half sum of squares so far, and that sum.
    lowest: Option<(Vec<f64>, f64)>,
}

impl<'r, 'f> Watched<'r, 'f> {
    pub(crate) fn new(of: &'r mut Residuals<'f>) -> Self {
        Self { of, lowest: None }
    }

    /// Residuals at points; `None` where a replay diverged.
    ///
    /// # Errors
    /// As the evaluation.
    pub(crate) fn residuals(&mut self, points: &[Vec<f64>]) -> Result<Vec<Option<Vec<f64>>>> {
        let rows = (self.of)(points)?;
        for (point, row) in points.iter().zip(&rows) {
            let loss = row.as_deref().map_or(f64::INFINITY, half_squares);
            if self.lowest.as_ref().is_none_or(|(_, least)| loss < *least) {
                self.lowest = Some((point.clone(), loss));
            }
        }
        Ok(rows)
    }

    /// Half sums of squares at points; infinite where a replay diverged.
    ///
    /// # Errors
    /// As the evaluation.
    pub(crate) fn losses(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>> {
        let rows = self.residuals(points)?.into_iter();
        let losses = rows.map(|r| r.map_or(f64::INFINITY, |r| half_squares(&r)));
        Ok(losses.collect())
    }
}

fn half_squares(row: &[f64]) -> f64 {
    0.5 * row.iter().map(|x| x * x).sum::<f64>()
}

/// The fit if a replay confirms its point; else a fit about the best point of a search by draws.
///
/// # Errors
/// As the evaluation.
pub(crate) fn confirmed(
    watched: &mut Watched<'_, '_>,
    found: Fit,
    settings: &GaussNewtonSettings,
    space: Space<'_>,
    (rng, progress): (&mut Rng, &dyn Progress),
) -> Result<Fit> {
    let here = watched.losses(std::slice::from_ref(&found.point))?[0];
    let Some((best, least)) = watched.lowest.clone() else {
        return Ok(found);
    };
    // A model that lacks an effect has a larger loss everywhere, and larger differences of it.
    let scale = (2.0 * least / space.readings.max(1) as f64).max(1.0);
    // The scatter of single replays about the linear fit. Where it is small the loss is curved, not
    // rough, and the fit's own point is as good as the linear model.
    let luck = 0.5 * found.roughness.powi(2) * space.readings as f64;
    if (here - least).min(luck) <= UNCONFIRMED * scale {
        return Ok(found);
    }
    progress.note("identify, replays jump");
    let (rule, spread) = (CmaEsSettings::default(), widths(&found.information));
    let mut search = CmaEs::new(rule, &best, &spread, space.low, space.high);
    for _ in 0..GENERATIONS {
        let draws = search.ask(DRAWS, rng);
        let losses = watched.losses(&draws)?;
        search.tell(&draws, &losses);
        let highest = losses.iter().fold(0.0, |a: f64, b| a.max(*b));
        let lowest = losses.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        if highest - lowest < ALIKE * scale {
            break;
        }
    }
    about(watched, found, settings, space, rng)
}

/// Initial standard deviations of the draws: wide compared with the posterior of the fit.
fn widths(information: &DMatrix<f64>) -> Vec<f64> {
    let n = information.nrows();
    let covariance = inverse_above_prior(&(information + DMatrix::identity(n, n)));
    let known = (0..n).map(|i| covariance[(i, i)].max(0.0).sqrt());
    known.map(|known| (WIDEN * known).min(SPREAD)).collect()
}

/// The best point so far, moved within its valley by a linear fit over a small region about it.
///
/// The uncertainty remains that of the first fit, whose region contains the valleys.
fn about(
    watched: &mut Watched<'_, '_>,
    found: Fit,
    settings: &GaussNewtonSettings,
    space: Space<'_>,
    rng: &mut Rng,
) -> Result<Fit> {
    let Some((middle, _)) = watched.lowest.clone() else {
        return Ok(found);
    };
    let from_middle = |ends: &[f64]| -> Vec<f64> {
        let pairs = ends.iter().zip(&middle);
        pairs.map(|(end, x)| end - x).collect()
    };
    let (low, high) = (from_middle(space.low), from_middle(space.high));
    // No descent: one start at the middle, and the fits over its region.
    let settings = GaussNewtonSettings {
        screened: 1,
        starts: 1,
        iterations: 0,
        step: REGION,
        ..settings.clone()
    };
    let near = Space {
        low: &low,
        high: &high,
        ..space
    };
    let moved = |points: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let back = |p: &Vec<f64>| p.iter().zip(&middle).map(|(a, b)| a + b).collect();
        points.iter().map(back).collect()
    };
    let mut residuals = |points: &[Vec<f64>]| watched.residuals(&moved(points));
    let Some(told) = minimise(&settings, &mut residuals, near, rng, || {})? else {
        return Ok(found);
    };
    watched.losses(&moved(std::slice::from_ref(&told.point)))?;
    let (point, least) = watched.lowest.clone().unwrap_or((middle, f64::INFINITY));
    let residual = (2.0 * least / space.readings.max(1) as f64).sqrt();
    Ok(Fit {
        free: point.clone(),
        point,
        residual,
        // A replay that noise alone explains is explained, whatever the roughness about it.
        misfit: told.misfit.min(residual),
        ..found
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use asid_core::progress::Silent;

    /// Readings of one log.
    const ROWS: usize = 400;

    /// Residuals of a model that is linear in two unknowns, with jumps.
    ///
    /// The readings jump at each twentieth of an unknown, later readings by more. The residuals
    /// vanish at `truth` alone.
    fn jumping(z: &[f64], truth: [f64; 2]) -> Vec<f64> {
        let row = |k: usize| {
            let late = k as f64 / ROWS as f64;
            let off = [z[0] - truth[0], z[1] - truth[1]];
            let cell = |x: f64| (20.0 * x).round().rem_euclid(3.0);
            let jump: f64 = off.iter().map(|x| cell(*x)).sum();
            10.0 * (off[0] + off[1] * (0.1 * k as f64).sin()) + 3.0 * late * late * jump
        };
        (0..ROWS).map(row).collect()
    }

    #[test]
    fn a_fit_that_its_replay_does_not_confirm_goes_on_among_valleys() {
        let truth = [0.413, -0.267];
        let settings = crate::fit::smooth();
        let (low, high) = ([-1.7; 2], [1.7; 2]);
        let space = Space {
            low: &low,
            high: &high,
            sought: 2,
            readings: ROWS,
        };
        let mut rng = Streams::new(1).stream("t");
        let mut of = |points: &[Vec<f64>]| -> Result<Vec<Option<Vec<f64>>>> {
            Ok(points.iter().map(|z| Some(jumping(z, truth))).collect())
        };
        let mut watched = Watched::new(&mut of);
        let mut residuals = |points: &[Vec<f64>]| watched.residuals(points);
        let first = minimise(&settings, &mut residuals, space, &mut rng, || {});
        let first = first.expect("evaluated").expect("a fit");
        let far = |point: &[f64]| (point[0] - truth[0]).hypot(point[1] - truth[1]);
        let before = far(&first.point);
        let with = (&mut rng, &Silent as &dyn Progress);
        let found = confirmed(&mut watched, first, &settings, space, with).expect("evaluated");
        assert!(
            before > 0.03,
            "the test needs a loss that misleads: {before}"
        );
        assert!(far(&found.point) < 0.005, "{:?}", found.point);
        // The residuals vanish nearby, and a search that got there has explained the readings.
        assert!(found.misfit <= found.residual && found.residual < 0.5);
    }
}
