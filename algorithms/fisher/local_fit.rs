//! A local linear fit to a rough simulator.
//!
//! Where contact makes trajectories rough, a central difference over one small step is mostly
//! random scatter. So several sets of antithetic pairs of points are simulated, each set along
//! randomly rotated axes:
//!
//! - The difference between the two points of a pair is regressed on the step between them. This
//!   gives the slopes.
//! - The difference between their mean and the middle is regressed on quadratic terms. This gives
//!   the curvature, which is removed, and the value of the middle without its own scatter.
//!
//! The residuals of both regressions are the *roughness* of single simulations, reading by reading,
//! with its correlation along the episode.
//!
//! The information about the point follows from the sandwich formula (White 1982). The weights `P`
//! of the readings come from their noise and roughness. They give the curvature `H = J^T P J` and
//! the information `H M^-1 H`, where `M = J^T P (1 + R) P J` and `R` is the whole covariance of the
//! roughness.
//!
//! The scatter in `J` itself adds `2 tr(P R) (U^T U)^-1` to `H`, for steps `U`. This is subtracted
//! from `H`; in `M` it stays, since an estimate by these slopes is subject to it
//! ([`LocalFit::told`]). Identification by emulation omits this correction: it takes the fitted
//! slopes at face value and widens every direction by its inflation ([`informed`]). The
//! information that an episode is expected to give it is computed the same way
//! ([`LocalFit::emulated`]), so that both agree.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};

use crate::fisher::precision::{Precision, implied, informed};
use crate::fisher::roughness::Roughness;
use crate::fisher::symmetric_eigen;
use asid_core::rng::Rng;

/// Minimum degrees of freedom of the roughness.
const FREEDOM: usize = 8;

/// Minimum number of pairs: their slopes then scatter as those of a regression on 64 draws, an
/// identifier's default.
const PAIRS: usize = 32;

/// Number of sets of pairs for `n` entries: enough for the quadratic terms and `FREEDOM` more.
#[must_use]
pub fn sets(n: usize) -> usize {
    let features = 1 + n * (n + 1) / 2;
    (features + FREEDOM).max(PAIRS).div_ceil(n.max(1))
}

/// Points in antithetic pairs around `middle`, `up` then `down` of each pair.
///
/// There are `sets` times `n` pairs along the columns of `factor` (lower triangular, `n x n`).
/// Every set but the first is randomly rotated, and all points are kept inside the box. Lengths
/// vary from set to set with a mean square of one, so that curvature shows.
#[must_use]
pub fn design(
    middle: &[f64],
    factor: &DMatrix<f64>,
    (low, high): (&[f64], &[f64]),
    sets: usize,
    rng: &mut Rng,
) -> Vec<Vec<f64>> {
    let n = middle.len();
    let mut points = Vec::with_capacity(2 * n * sets);
    for set in 0..sets {
        let axes = if set == 0 {
            DMatrix::identity(n, n)
        } else {
            DMatrix::from_fn(n, n, |_, _| StandardNormal.sample(rng))
                .qr()
                .q()
        };
        let length = (2.0 * (set as f64 + 0.5) / sets as f64).sqrt();
        let steps = factor * axes * length;
        for j in 0..n {
            for sign in [1.0, -1.0] {
                let point = (0..n).map(|i| {
                    let x = middle[i] + sign * steps[(i, j)];
                    x.clamp(low[i], high[i])
                });
                points.push(point.collect());
            }
        }
    }
    points
}

/// Slopes and roughness of residuals around a point, with the curvature removed.
#[derive(Clone, Debug)]
pub struct LocalFit {
    factor: DMatrix<f64>,
    /// Slopes along the columns of the factor, entries x readings.
    slopes: DMatrix<f64>,
    /// `(U^T U)^-1`.
    scatter: DMatrix<f64>,
    /// Roughness of single simulations.
    roughness: Roughness,
    /// Residuals in the middle; corrected for the middle's own roughness where there are enough
    /// pairs.
    middle: DVector<f64>,
    /// Covariance of these residuals by chance, as a share of that of the roughness.
    middle_scatter: f64,
}

/// The information of readings about the entries of a point.
pub struct Told {
    /// Information without any prior, entries x entries.
    pub information: DMatrix<f64>,
    /// Curvature `H` of half the weighted sum of squares.
    pub curvature: DMatrix<f64>,
    /// Weights of the readings.
    pub precision: Precision,
}

impl LocalFit {
    /// Fits the residuals of a [`design`] with this middle and factor; `middle_row` is the residual
    /// in the middle.
    ///
    /// Pairs with a diverged simulation (`None`) are left out. `None` where the remaining pairs do
    /// not span the space.
    #[must_use]
    pub fn new(
        middle: &[f64],
        middle_row: &[f64],
        factor: &DMatrix<f64>,
        points: &[Vec<f64>],
        rows: &[Option<Vec<f64>>],
    ) -> Option<Self> {
        let n = factor.nrows();
        let m = middle_row.len();
        let (mut steps, mut shifts) = (Vec::new(), Vec::new());
        let mut kept: Vec<(&[f64], &[f64])> = Vec::new();
        for (pair, row) in points.chunks_exact(2).zip(rows.chunks_exact(2)) {
            if let [Some(up), Some(down)] = row {
                let step = DVector::from_fn(n, |i, _| pair[0][i] - pair[1][i]);
                steps.push(factor.solve_lower_triangular(&step)?);
                // The box may shorten one of the two steps.
                let shift = DVector::from_fn(n, |i, _| 0.5 * (pair[0][i] + pair[1][i]) - middle[i]);
                shifts.push(factor.solve_lower_triangular(&shift)?);
                kept.push((up, down));
            }
        }
        let pairs = kept.len();
        if pairs < n || n == 0 {
            return None;
        }
        let u = DMatrix::from_fn(pairs, n, |j, i| steps[j][i]);
        let odd = DMatrix::from_fn(pairs, m, |j, k| kept[j].0[k] - kept[j].1[k]);
        let scatter = (u.transpose() * &u).cholesky()?.inverse();
        let slopes = &scatter * (u.transpose() * &odd);
        let shift = DMatrix::from_fn(pairs, n, |j, i| shifts[j][i]);
        let even = DMatrix::from_fn(pairs, m, |j, k| {
            0.5 * (kept[j].0[k] + kept[j].1[k]) - middle_row[k]
        }) - shift * &slopes;
        let features = 1 + n * (n + 1) / 2;
        let (mut luck, mut freedom) = ((&odd - &u * &slopes) * 0.5_f64.sqrt(), (pairs - n) as f64);
        let mut middle = DVector::from_column_slice(middle_row);
        let middle_scatter = if pairs > features {
            let (offset, left, share) = without_curvature(&(&u * 0.5), &even)?;
            middle += offset;
            luck = stacked(&luck, &(left * 2_f64.sqrt()));
            freedom += (pairs - features) as f64;
            // A pair's mean has half the covariance of one simulation.
            0.5 * share
        } else {
            // Second differences, whose scatter is that of one and a half simulations. They count
            // curvature as roughness.
            luck = stacked(&luck, &(even * 1.5_f64.sqrt().recip()));
            freedom += pairs as f64;
            1.0
        };
        Some(Self {
            factor: factor.clone(),
            slopes,
            scatter,
            roughness: Roughness::new(luck, freedom),
            middle,
            middle_scatter,
        })
    }

    /// The same fit for the first `readings` entries of the residuals.
    #[must_use]
    pub fn first(&self, readings: usize) -> Self {
        Self {
            slopes: self.slopes.columns(0, readings).into_owned(),
            roughness: self.roughness.first(readings),
            middle: self.middle.rows(0, readings).into_owned(),
            ..self.clone()
        }
    }

    /// Residuals in the middle.
    #[must_use]
    pub fn middle(&self) -> &DVector<f64> {
        &self.middle
    }

    /// Slopes of the residuals, entries x readings.
    #[must_use]
    pub fn slopes(&self) -> DMatrix<f64> {
        // slopes = factor^T d/dx.
        let lower = self.factor.transpose();
        lower
            .solve_upper_triangular(&self.slopes)
            .unwrap_or_else(|| self.slopes.clone())
    }

    /// The roughness of single simulations.
    #[must_use]
    pub fn roughness(&self) -> &Roughness {
        &self.roughness
    }

    /// Covariance by chance of the residuals that the fit predicts a step away from the middle, as
    /// a share of that of the roughness. The slopes are those of differences of two simulations.
    #[must_use]
    pub fn scatter(&self, step: &DVector<f64>) -> f64 {
        let along = self.factor.solve_lower_triangular(step);
        let along = along.unwrap_or_else(|| step.clone());
        self.middle_scatter + 2.0 * along.dot(&(&self.scatter * &along))
    }

    /// The information of the readings.
    ///
    /// Readings are weighted by the variance of their roughness alone, or by its whole covariance
    /// along the episode (`correlated`).
    #[must_use]
    pub fn told(&self, correlated: bool) -> Option<Told> {
        let precision = self.roughness.precision(correlated);
        let curvature = self.curvature(&precision, &self.roughness)?;
        let pairs = self.roughness.crossed(correlated);
        let n = curvature.nrows();
        let mut information = DMatrix::zeros(n, n);
        for (by, asked) in &pairs {
            let h = self.curvature(by, asked)?;
            information += self.sandwich(by, &h, asked)? / pairs.len() as f64;
        }
        Some(Told {
            information: self.outside(&information)?,
            curvature: self.outside(&curvature)?,
            precision,
        })
    }

    /// Information as identification by emulation computes it, entries x entries.
    #[must_use]
    pub fn emulated(&self, correlated: bool) -> Option<DMatrix<f64>> {
        let columns = self.slopes.transpose();
        let precision = self.roughness.precision(correlated);
        let lower = implied(&precision, &columns)?;
        let inflated = self.roughness.inflation(&columns, correlated)?;
        let curvature = precision.weigh(&self.slopes) * columns;
        self.outside(&informed(&curvature, &lower, &inflated)?)
    }

    /// Transforms a quadratic form along the columns of the factor to the entries' own coordinates.
    fn outside(&self, form: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let lower = self.factor.transpose();
        let half = lower.solve_upper_triangular(form)?;
        let whole = lower.solve_upper_triangular(&half.transpose())?;
        Some((&whole + whole.transpose()) * 0.5)
    }

    /// `J^T P J` along the columns of the factor, less what the scatter of the slopes adds to it;
    /// no eigenvalue is below zero.
    fn curvature(&self, by: &Precision, luck: &Roughness) -> Option<DMatrix<f64>> {
        let of_luck = luck.weighed_by(by);
        let raw =
            by.weigh(&self.slopes) * self.slopes.transpose() - &self.scatter * (2.0 * of_luck);
        let mut eigen = symmetric_eigen((&raw + raw.transpose()) * 0.5)?;
        eigen.eigenvalues.apply(|v| *v = v.max(0.0));
        Some(eigen.recompose())
    }

    /// `H M^-1 H`, with the covariance of this roughness.
    fn sandwich(&self, by: &Precision, h: &DMatrix<f64>, luck: &Roughness) -> Option<DMatrix<f64>> {
        let n = h.nrows();
        let weighed = by.weigh(&self.slopes);
        let middle = &weighed * weighed.transpose() + luck.covariance_of(&weighed);
        let ridge = DMatrix::identity(n, n) * (1e-12 * middle.trace() + f64::MIN_POSITIVE);
        Some(h * (middle + ridge).cholesky()?.solve(h))
    }
}

/// Regresses `even` (pairs x readings) on a constant and the quadratic terms of the half steps `u`;
/// returns the constant, the regression residuals, and the variance of the constant as a share of
/// that of a pair's mean.
fn without_curvature(
    u: &DMatrix<f64>,
    even: &DMatrix<f64>,
) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
    let (pairs, n) = u.shape();
    let mut terms: Vec<DVector<f64>> = vec![DVector::repeat(pairs, 1.0)];
    for i in 0..n {
        for j in i..n {
            terms.push(u.column(i).component_mul(&u.column(j)));
        }
    }
    let phi = DMatrix::from_columns(&terms);
    let f = phi.ncols();
    // Clipped points may leave a term undetermined: the ridge keeps it small.
    let ridge = DMatrix::identity(f, f) * (1e-9 * phi.norm_squared() / f as f64);
    let factor = (phi.transpose() * &phi + ridge).cholesky()?;
    let fitted = factor.solve(&(phi.transpose() * even));
    let share = factor.inverse()[(0, 0)];
    Some((fitted.row(0).transpose(), even - phi * fitted, share))
}

fn stacked(above: &DMatrix<f64>, below: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(above.nrows() + below.nrows(), above.ncols());
    out.rows_mut(0, above.nrows()).copy_from(above);
    out.rows_mut(above.nrows(), below.nrows()).copy_from(below);
    out
}

#[cfg(test)]
mod tests;
