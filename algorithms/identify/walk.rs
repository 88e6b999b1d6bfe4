//! Draws from an unnormalised density by a Metropolis walk inside a region.

use asid_core::rng::Rng;
use nalgebra::{DMatrix, DVector};
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

/// Steps before the first draw is kept: the walk has then forgotten where it began.
const WARM_UP: usize = 2000;
/// Steps between two kept draws, since neighbouring steps are correlated.
const THIN: usize = 10;

/// Length of a step, in standard deviations of the target divided by the square root of the number
/// of entries (Gelman, Roberts and Gilks 1996).
const STEP: f64 = 2.4;

/// A Metropolis walk.
pub struct Walk<'w> {
    /// Lower triangular factor; `shape shape^T` is roughly the target's covariance.
    pub shape: DMatrix<f64>,
    /// Whether a point is inside the region.
    pub inside: &'w dyn Fn(&[f64]) -> bool,
    /// Negative log density.
    pub loss: &'w dyn Fn(&[f64]) -> f64,
}

impl Walk<'_> {
    /// Returns `count` equally weighted draws; the walk starts at a point inside the region.
    pub fn draws(&self, from: &[f64], count: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let n = from.len();
        let shape = &self.shape * (STEP / (n as f64).sqrt());
        let mut at = from.to_vec();
        let mut loss = (self.loss)(&at);
        let mut out = Vec::with_capacity(count);
        for i in 0..WARM_UP + count * THIN {
            let z = DVector::from_fn(n, |_, _| StandardNormal.sample(rng));
            let step = &shape * z;
            let next: Vec<f64> = (0..n).map(|k| at[k] + step[k]).collect();
            let chance: f64 = rng.random();
            if (self.inside)(&next) {
                let next_loss = (self.loss)(&next);
                if chance.ln() < loss - next_loss {
                    (at, loss) = (next, next_loss);
                }
            }
            if i >= WARM_UP && (i - WARM_UP).is_multiple_of(THIN) {
                out.push(at.clone());
            }
        }
        out
    }
}

/// Standard deviation of one entry of equally weighted points.
#[must_use]
pub fn deviation(points: &[Vec<f64>], entry: usize) -> f64 {
    let n = points.len().max(1) as f64;
    let mean = points.iter().map(|p| p[entry]).sum::<f64>() / n;
    (points
        .iter()
        .map(|p| (p[entry] - mean).powi(2))
        .sum::<f64>()
        / n)
        .sqrt()
}
