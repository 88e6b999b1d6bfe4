//! A search among the valleys of a rough loss.
//!
//! Where bodies make and break contact, a step of a hundredth of a prior deviation changes which contact comes first, and the loss of
//! open-loop replays jumps. A straight line over a region of such a loss promises a place that its own replay does not
//! confirm, and damped steps end in the first of many valleys. So the place that a fit arrives at is replayed. Where that is worse
//! than the best replay so far by more than chance explains, draws about the best one are ranked by their own
//! replays, by covariance matrix adaptation (N. Hansen, arXiv:1604.00772), whose mean is blind to single jumps. What is known of
//! the values stays what the fit over the whole region says, roughness included.

use asid_algorithms::fisher::inverse_above_prior;
use asid_algorithms::optimise::cma_es::{CmaEs, CmaEsSettings};
use asid_algorithms::optimise::gauss_newton::{
    Fit, GaussNewtonSettings, Residuals, Space, minimise,
};
use asid_core::Progress;
use asid_core::error::Result;
use asid_core::rng::Rng;
use nalgebra::DMatrix;

/// Half squares by which the replay of a fitted place may be worse than the best that was seen: from there on a place lies outside
/// of the 95 % interval of one unknown, whose chi-squared is 3.84.
const UNCONFIRMED: f64 = 1.92;

/// First deviation of the draws at most, in prior deviations: a sixth of a uniform range. With 0.1 the search of a quadruped's knee
/// stayed 0.4 from its value.
const SPREAD: f64 = 0.3;

/// The same beside what the fit knows: far enough to leave a wrong valley, near enough that an unknown that is known to a
/// thousandth does not take the first half of the search.
const WIDEN: f64 = 10.0;

/// Draws of a generation: six times what smooth losses of five unknowns take, since many valleys are looked at. With 24 a quadruped's
/// search stayed in the first one for some draws of chance.
const DRAWS: usize = 48;

/// Generations at most: the quadruped's had arrived after 20 to 30.
const GENERATIONS: usize = 30;

/// A generation whose half squares differ by less than this has arrived: a tenth of [`UNCONFIRMED`].
const ALIKE: f64 = 0.2;

/// First half step of the fit over the region about the best place, in prior deviations: what is known of an unknown after a good motion.
const REGION: f64 = 0.02;

/// Residuals at points, and the best point so far.
pub(crate) struct Watched<'r, 'f> {
    of: &'r mut Residuals<'f>,
    /// The point with the smallest half sum of squares so far, and this.
    lowest: Option<(Vec<f64>, f64)>,
}

impl<'r, 'f> Watched<'r, 'f> {
    pub(crate) fn new(of: &'r mut Residuals<'f>) -> Self {
        Self { of, lowest: None }
    }

    /// Residuals; `None` where a replay diverged.
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

    /// Half sums of squares; infinite where a replay diverged.
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

/// The fit where its place is confirmed by a replay; else one about the best place among draws.
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
    // A model that lacks something has a larger loss everywhere, and larger differences.
    let scale = (2.0 * least / space.readings.max(1) as f64).max(1.0);
    // What single replays differ by beside the straight line. Where that is little the line is bent and not the loss rough, and its own
    // place is as good as the line.
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

/// First deviations of the draws: wide beside what the fit knows.
fn widths(information: &DMatrix<f64>) -> Vec<f64> {
    let n = information.nrows();
    let covariance = inverse_above_prior(&(information + DMatrix::identity(n, n)));
    let known = (0..n).map(|i| covariance[(i, i)].max(0.0).sqrt());
    known.map(|known| (WIDEN * known).min(SPREAD)).collect()
}

/// The best place so far, moved within its valley by a straight line over a small region about it. What is known of the values stays
/// what the first fit says, whose region has the valleys in it.
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
    // No descent: a start at the middle, and the fits over its region.
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
    Ok(Fit {
        free: point.clone(),
        point,
        residual: (2.0 * least / space.readings.max(1) as f64).sqrt(),
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

    /// Residuals of a model that is straight in two unknowns, with jumps of its later readings, the larger the later, at each twentieth of an
    /// unknown. They vanish at `truth` alone.
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
    }
}
