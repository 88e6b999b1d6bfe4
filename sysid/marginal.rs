//! Residuals of an episode about its best initial state, whitened for the coordinates left open.

use asid_core::Parameter;
use asid_core::episode::InitialState;
use asid_core::error::Result;
use nalgebra::{DMatrix, DVector};

use crate::dataset::{Dataset, Replayer, Trial};
use crate::gap::{fit_start, start_slopes};

/// Whitens residuals of an episode for the initial coordinates that its log leaves open.
pub(crate) struct Marginal {
    /// Initial state of the replay.
    pub(crate) start: InitialState,
    basis: DMatrix<f64>,
    shrink: Vec<f64>,
}

impl Marginal {
    pub(crate) fn apply(&self, residuals: &[f64]) -> Vec<f64> {
        let r = DVector::from_iterator(
            residuals.len(),
            residuals
                .iter()
                .map(|x| if x.is_finite() { *x } else { 0.0 }),
        );
        if self.shrink.is_empty() {
            return r.as_slice().to_vec();
        }
        let mut along = self.basis.transpose() * &r;
        along
            .iter_mut()
            .zip(&self.shrink)
            .for_each(|(a, s)| *a *= s);
        (r - &self.basis * along).as_slice().to_vec()
    }
}

/// Parameter values in their units, at a point in prior standard deviations.
pub(crate) fn values(parameters: &[Parameter], z: &[f64]) -> Vec<f64> {
    parameters
        .iter()
        .zip(z)
        .map(|(p, z)| p.from_scaled(*z))
        .collect()
}

/// Fits the initial state of an episode at parameter values, and whitens for its open coordinates.
///
/// # Errors
/// When the engine fails.
pub(crate) fn marginal(
    replayer: &mut Replayer,
    layout: &asid_core::Layout,
    data: &Dataset,
    trial: &Trial,
    theta: &[f64],
) -> Result<Marginal> {
    let rows = trial.episode.rows();
    let start = fit_start(replayer, layout, data, trial, theta, rows)?;
    let none = |start| Marginal {
        start,
        basis: DMatrix::zeros(0, 0),
        shrink: Vec::new(),
    };
    if trial.open.is_empty() {
        return Ok(none(start));
    }
    let slopes = start_slopes(replayer, layout, data, trial, theta, &start)?;
    let Some(basis) = slopes.map(|s| s.matrix.svd(true, false)) else {
        return Ok(none(start));
    };
    let shrink = basis
        .singular_values
        .iter()
        .map(|s| 1.0 - (1.0 + s * s).sqrt().recip());
    Ok(Marginal {
        start,
        shrink: shrink.collect(),
        basis: basis.u.unwrap_or_else(|| DMatrix::zeros(0, 0)),
    })
}
