//! How much more an episode speaks for one model than for another, in nats.
//!
//! At its best point, model `i` predicts the readings up to the residual `e_i`. If it is right, `e_i`
//! is a draw of the sensors' noise (whitened: 1) and of the roughness of simulations, of covariance
//! `S = 1 + R`. Under weights `W` that all models share, the losses of two models differ by
//!
//! `D = e_0^T W e_0 / 2 - e_1^T W e_1 / 2 = delta^T W (e_0 + e_1) / 2`, `delta = e_0 - e_1`
//!
//! If model 1 is right, `D` is normal with mean `h / 2` and variance `m`; if model 0 is right, with
//! mean `-h / 2` and the same variance:
//!
//! `h = delta^T W delta`, `m = delta^T W S W delta`
//!
//! The logarithm of the ratio of these two densities is `D h / m`. With `W = S^-1` it is `D`, the
//! ratio of the likelihoods. With the variances of the readings alone, readings that shift together
//! count as often as there are readings, and `D` overstates what it shows by `m / h`: the ratio of
//! the sandwich to the naive variance along `delta`. To divide a difference of losses by it is the
//! adjustment of composite likelihoods (Chandler and Bate 2007; Ribatet, Cooley and Davison 2012).
//! Unknowns that were fitted change nothing: what they moved is no part of `delta`.
//!
//! Each prediction is an average over simulations and has a scatter of covariance `lambda_i R`. It
//! adds `(lambda_0 + lambda_1) tr(W R)` to `h`, even between equal models. This is subtracted. In `m`
//! it stays, since it moves `D`.
//!
//! All is divided by the misfit of the best model where that exceeds 1: what no model explains
//! supports none.

use nalgebra::DMatrix;

use crate::fisher::roughness::Roughness;

/// What a model leaves of the readings at its best point.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Whitened residual, zero where a reading is missing. It is that of a fit over many
    /// simulations: the best single one is partly luck.
    pub residual: Vec<f64>,
    /// Number of readings that are present.
    pub present: usize,
    /// Roughness of single simulations about the best point.
    pub roughness: Roughness,
    /// Covariance of the residual by the scatter of the simulations behind it, as a share of that
    /// of the roughness: 1 for a single simulation.
    pub scatter: f64,
    /// Sum of the logarithms of posterior over prior standard deviations: the penalty for unknowns
    /// that had to be found.
    pub narrowing: f64,
}

impl Evidence {
    /// That of a single simulation with this residual, as rough as those of `like`.
    #[must_use]
    pub fn of_single(residual: Vec<f64>, like: &Self) -> Self {
        Self {
            residual,
            scatter: 1.0,
            narrowing: 0.0,
            ..like.clone()
        }
    }

    fn row(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(1, self.residual.len(), &self.residual)
    }
}

/// Nats by which the fit of each model is behind that of the best; see the module documentation.
///
/// All models have residuals for the same readings. `correlated` says whether the weights use the
/// whole covariance of the roughness or its variances.
#[must_use]
pub fn behind(models: &[&Evidence], correlated: bool) -> Vec<f64> {
    let roughness = Roughness::pooled(models.iter().map(|model| &model.roughness));
    let precision = roughness.precision(correlated);
    let loss = |model: &&Evidence| {
        let row = model.row();
        0.5 * precision.weigh(&row).component_mul(&row).sum()
    };
    let losses: Vec<f64> = models.iter().map(loss).collect();
    let Some(best) = (0..models.len()).min_by(|&i, &j| losses[i].total_cmp(&losses[j])) else {
        return Vec::new();
    };
    let misfit = (2.0 * losses[best] / models[best].present.max(1) as f64).max(1.0);
    let pairs = roughness.crossed(correlated);
    let one = |i: usize| {
        let apart = models[i].row() - models[best].row();
        let scatter = models[i].scatter + models[best].scatter;
        let (mut h, mut m) = (0.0, 0.0);
        for (by, asked) in &pairs {
            let weighed = by.weigh(&apart);
            h += weighed.dot(&apart) - scatter * asked.weighed_by(by);
            m += weighed.norm_squared() + asked.covariance_of(&weighed)[(0, 0)];
        }
        // No ratio above 1: no difference counts for more than the weights say.
        let share = if h > 0.0 { (h / m).min(1.0) } else { 0.0 };
        share * (losses[i] - losses[best]) / misfit
    };
    (0..models.len()).map(one).collect()
}

#[cfg(test)]
mod tests;
