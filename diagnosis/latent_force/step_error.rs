//! The engine's own error over a row, as a column of every model.
//!
//! An engine with finite steps makes the same error in each row. A semi-implicit step slightly
//! damps or drives a joint, and logs show that as friction, a lag or a softer drive that the
//! machine does not have. The form of the error is known: it is the change at half the time step,
//! times two for a method of first order (Richardson 1911). Its size is less certain, since methods
//! have other orders. So every model, with effects or without, has this column with a coefficient
//! of its own: the step's error earns no name any evidence. Segments have it as
//! [directions](super::scatter). The column is that of the model without effects; rivals are
//! compared at the end with [that of each](super::fit::OwnSteps).

use crate::checks::RICHARDSON;

use super::step_map::LinearEpisode;

/// Prior mean of the coefficient, in errors of a method of first order.
///
/// It lies between 1, a method of first order, and 0.5, a method of high order, for which half the
/// step shows the whole error. Logs simulated at half the step have 0.5, at a quarter 0.75.
const MEAN: f64 = 0.75;
/// Prior standard deviation of the coefficient: both ends are one away.
pub const DEVIATION: f64 = 0.25;

/// The error of each walk for a coefficient of one standard deviation.
///
/// `(rows - 1) x nx` in tangent coordinates of the next state; empty for segments.
#[derive(Clone, Debug, Default)]
pub struct StepError {
    walks: Vec<Vec<f64>>,
}

impl StepError {
    /// Computes the error of walks that were linearised about one trajectory at a time step and at
    /// half of it.
    ///
    /// `segments` has one flag a walk; a segment has no error.
    #[must_use]
    pub fn between(here: &[LinearEpisode], finer: &[LinearEpisode], segments: &[bool]) -> Self {
        let of_walk = |((here, finer), segment): ((&LinearEpisode, &LinearEpisode), &bool)| {
            if *segment {
                return Vec::new();
            }
            let each = here.defect.iter().zip(&finer.defect);
            each.map(|(a, b)| {
                let error = DEVIATION * RICHARDSON * (b - a);
                if error.is_finite() { error } else { 0.0 }
            })
            .collect()
        };
        let each = here.iter().zip(finer).zip(segments);
        Self {
            walks: each.map(of_walk).collect(),
        }
    }

    /// Returns the error of some of the walks.
    #[must_use]
    pub fn of_walks(&self, which: &[usize]) -> Self {
        Self {
            walks: which
                .iter()
                .filter_map(|&w| self.walks.get(w))
                .cloned()
                .collect(),
        }
    }

    /// Number of its columns: one, or none if the error is unknown.
    #[must_use]
    pub fn columns(&self) -> usize {
        usize::from(!self.walks.is_empty())
    }

    /// Center of the prior relative to an engine without error, in standard deviations; one a
    /// column.
    #[must_use]
    pub fn center(&self) -> &'static [f64] {
        &[MEAN / DEVIATION][..self.columns()]
    }

    /// Returns this error with what changes from one error to another.
    #[must_use]
    pub fn with_change(&self, from: &Self, to: &Self) -> Self {
        let of_walk = |((own, from), to): ((&Vec<f64>, &Vec<f64>), &Vec<f64>)| {
            let each = own.iter().zip(from).zip(to);
            each.map(|((own, from), to)| own + to - from).collect()
        };
        let walks = self.walks.iter().zip(&from.walks).zip(&to.walks);
        Self {
            walks: walks.map(of_walk).collect(),
        }
    }

    /// Appends its column to the `m` columns of a linearisation.
    pub fn join(&self, linear: &mut [LinearEpisode], m: usize) {
        for (linear, error) in linear.iter_mut().zip(&self.walks) {
            if !error.is_empty() {
                linear.state_columns = beside(&linear.state_columns, m, error, 1);
            }
            let none = vec![0.0; linear.residual.len()];
            linear.reading_columns = beside(&linear.reading_columns, m, &none, 1);
        }
    }
}

/// Concatenates two row-major matrices of `n` and `m` columns side by side.
pub(super) fn beside(a: &[f64], n: usize, b: &[f64], m: usize) -> Vec<f64> {
    let rows = a.len().checked_div(n).unwrap_or(b.len() / m.max(1));
    let mut out = Vec::with_capacity(rows * (n + m));
    for k in 0..rows {
        out.extend_from_slice(&a[k * n..(k + 1) * n]);
        out.extend_from_slice(&b[k * m..(k + 1) * m]);
    }
    out
}
