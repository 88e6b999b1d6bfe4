//! Draws from an unnormalised density inside a region, by an ensemble of walkers.
//!
//! Each walker in turn moves along the line through another one (the stretch move of Goodman and
//! Weare 2010). The steps so have the width and the direction of the density, whatever its scales,
//! and in a curved valley those of the part where the walkers are. Steps of one fixed shape would
//! cross only part of such a valley.

use asid_core::rng::Rng;
use nalgebra::{DMatrix, DVector};
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

/// Moves of each walker before the first draw is kept, for each entry of a point. The correlation
/// of a walker's states lasts for a number of moves in proportion to the entries; after this many it
/// has forgotten where it began.
const WARM_UP: usize = 12;
/// Steps of the ensemble between two kept draws, since neighbouring states of a walker are
/// correlated: `2 n + 1` for `n` entries, and at least this many. Both are odd and have no divisor
/// in common with the number of walkers, so that all walkers come up.
const THIN: usize = 11;
/// Fewest walkers. With twice as many as entries they span all directions; more mix better.
const WALKERS: usize = 32;
/// Largest factor by which a step changes the distance to the other walker; its inverse is the
/// smallest (Goodman and Weare's `a`).
const STRETCH: f64 = 2.0;
/// Halvings of the distance at which a walker begins, until it is inside of the region.
const HALVINGS: usize = 30;
/// Directions that are tried at a best point. In a corner of `k` sides one in `2^k` leads inside;
/// after these the walker begins between the best point and the origin.
const DIRECTIONS: usize = 8;

/// An ensemble of walkers.
pub struct Walk<'w> {
    /// Lower triangular factor of the covariance with which the walkers begin.
    pub shape: DMatrix<f64>,
    /// Whether a point is inside the region, which is convex and has the origin in its interior.
    pub inside: &'w dyn Fn(&[f64]) -> bool,
    /// Negative log density.
    pub loss: &'w dyn Fn(&[f64]) -> f64,
}

impl Walk<'_> {
    /// Returns `count` equally weighted draws; the walkers begin about a point inside the region.
    pub fn draws(&self, from: &[f64], count: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let n = from.len();
        let walkers = WALKERS.max(2 * (n + 1));
        let mut at: Vec<Vec<f64>> = (0..walkers).map(|_| self.about(from, rng)).collect();
        let mut loss: Vec<f64> = at.iter().map(|u| (self.loss)(u)).collect();
        let mut out = Vec::with_capacity(count);
        let mut next = vec![0.0; n];
        let (warm_up, thin) = (WARM_UP * n * walkers, THIN.max(2 * n + 1));
        for i in 0..warm_up + count * thin {
            let k = i % walkers;
            let other = (k + rng.random_range(1..walkers)) % walkers;
            // The density of the factor z is 1 / sqrt(z) between the limits.
            let root = STRETCH.sqrt();
            let z = (1.0 / root + (root - 1.0 / root) * rng.random::<f64>()).powi(2);
            let chance: f64 = rng.random();
            for (x, (here, there)) in next.iter_mut().zip(at[k].iter().zip(&at[other])) {
                *x = there + z * (here - there);
            }
            if (self.inside)(&next) {
                let ahead = (self.loss)(&next);
                if chance.ln() < (n as f64 - 1.0) * z.ln() + loss[k] - ahead {
                    at[k].copy_from_slice(&next);
                    loss[k] = ahead;
                }
            }
            if i >= warm_up && (i - warm_up).is_multiple_of(thin) {
                out.push(at[k].clone());
            }
        }
        out
    }

    /// Draws a point inside the region about a point inside.
    fn about(&self, from: &[f64], rng: &mut Rng) -> Vec<f64> {
        for _ in 0..DIRECTIONS {
            if let Some(point) = self.beside(from, rng) {
                return point;
            }
        }
        let share: f64 = rng.random();
        let between: Vec<f64> = from.iter().map(|x| share * x).collect();
        self.beside(&between, rng).unwrap_or(between)
    }

    /// Draws a point inside the region in one direction from a point; `None` if it leads outside.
    fn beside(&self, from: &[f64], rng: &mut Rng) -> Option<Vec<f64>> {
        let z = DVector::from_fn(from.len(), |_, _| StandardNormal.sample(rng));
        let mut step = &self.shape * z;
        for _ in 0..HALVINGS {
            let point: Vec<f64> = from.iter().zip(&step).map(|(x, s)| x + s).collect();
            if (self.inside)(&point) {
                return Some(point);
            }
            step *= 0.5;
        }
        None
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

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;

    /// Draws from a density whose walkers begin with unit covariance about the origin.
    fn drawn(n: usize, seed: u64, loss: &dyn Fn(&[f64]) -> f64) -> Vec<Vec<f64>> {
        let walk = Walk {
            shape: DMatrix::identity(n, n),
            inside: &|u: &[f64]| u.iter().all(|x| x.abs() <= 3.0),
            loss,
        };
        walk.draws(&vec![0.0; n], 1000, &mut Streams::new(seed).stream("walk"))
    }

    /// Mean over several walks of the standard deviation of the first entry.
    fn width(n: usize, loss: &dyn Fn(&[f64]) -> f64) -> f64 {
        let each = (0..8).map(|seed| deviation(&drawn(n, seed, loss), 0));
        each.sum::<f64>() / 8.0
    }

    #[test]
    fn draws_have_the_width_of_the_density_whatever_its_scales() {
        // Two normal entries of which the second is 200 times as narrow, and four as wide as the
        // first.
        let normal = |u: &[f64]| {
            let width = |i: usize| if i == 1 { 0.001 } else { 0.2 };
            let each = u.iter().enumerate().map(|(i, x)| (x / width(i)).powi(2));
            0.5 * each.sum::<f64>()
        };
        assert!((width(6, &normal) / 0.2 - 1.0).abs() < 0.1);
        // Nothing is known: uniform in the box.
        let flat = width(2, &|_| 0.0);
        assert!((flat / 3.0_f64.sqrt() - 1.0).abs() < 0.05, "{flat}");
    }

    /// Symptom: 1000 equal draws, with a standard deviation of zero. Cause: in a corner of the region
    /// nearly every direction leads outside, so that all walkers began at the corner itself, and
    /// moves between equal points lead nowhere.
    #[test]
    fn walkers_leave_a_corner() {
        let walk = Walk {
            shape: DMatrix::identity(6, 6) * 0.2,
            inside: &|u: &[f64]| u.iter().all(|x| (-3.0..=0.5).contains(x)),
            // Exponential densities of width 0.2, which end at the corner.
            loss: &|u: &[f64]| u.iter().map(|x| (0.5 - x) / 0.2).sum(),
        };
        for seed in 0..4 {
            let drawn = walk.draws(&[0.5; 6], 1000, &mut Streams::new(seed).stream("walk"));
            for entry in 0..6 {
                let width = deviation(&drawn, entry);
                assert!((width / 0.2 - 1.0).abs() < 0.25, "{seed} {entry}: {width}");
            }
        }
    }

    /// Only the product of two entries is known, to a tenth of the width of the valley.
    ///
    /// The standard deviation of the first entry is 1.18, by quadrature on a grid of 1200 x 1200.
    #[test]
    fn a_curved_valley_is_crossed_from_end_to_end() {
        let product = |u: &[f64]| 0.5 * (((2.0 + u[0]) * (2.0 + u[1]) - 4.0) / 0.2).powi(2);
        let found = width(2, &product);
        assert!((found / 1.18 - 1.0).abs() < 0.1, "{found}");
    }
}
