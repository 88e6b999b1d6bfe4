//! The engine's own error over a row, as a column of every model.
//!
//! An engine that takes finite steps errs in the same way in each row: a semi-implicit step damps or drives a joint a little, and logs
//! show that as friction, a lag or a softer drive that the machine has not got. How the error acts is known: it is what half the
//! time step changes, and twice that for a method of first order (Richardson 1911). How large it is is known less well, for methods have
//! other orders. So it is a column with a coefficient of its own in the regression of every model, with effects or without: what the step
//! does earns no name any evidence. Segments have it as [directions](super::scatter).

use crate::checks::RICHARDSON;

use super::step_map::LinearEpisode;

/// Mean of the coefficient, in errors of a method of first order: between that and a method of high order, of which half the step tells
/// half as much. A log that another simulation made has 0.5 at half the step, 0.75 at a quarter.
const MEAN: f64 = 0.75;
/// Its deviation: both ends are one away.
pub const DEVIATION: f64 = 0.25;

/// The error of each walk, for a coefficient of one deviation, `(rows - 1) x nx` in tangent coordinates of the next state; nothing of segments.
#[derive(Clone, Debug, Default)]
pub struct StepError {
    walks: Vec<Vec<f64>>,
}

impl StepError {
    /// Of the rows of walks that were linearised about one trajectory at a time step and at half of it; of `segments` (one flag a walk)
    /// there is none.
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

    /// That of some of the walks.
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

    /// How many columns it is: one, or none where it is not known.
    #[must_use]
    pub fn columns(&self) -> usize {
        usize::from(!self.walks.is_empty())
    }

    /// Where the prior's center lies from an engine without error, in deviations; one a column.
    #[must_use]
    pub fn center(&self) -> &'static [f64] {
        &[MEAN / DEVIATION][..self.columns()]
    }

    /// Puts its column beside the `m` that a linearisation has.
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

/// Two row-major matrices of `n` and `m` columns side by side.
pub(super) fn beside(a: &[f64], n: usize, b: &[f64], m: usize) -> Vec<f64> {
    let rows = a.len().checked_div(n).unwrap_or(b.len() / m.max(1));
    let mut out = Vec::with_capacity(rows * (n + m));
    for k in 0..rows {
        out.extend_from_slice(&a[k * n..(k + 1) * n]);
        out.extend_from_slice(&b[k * m..(k + 1) * m]);
    }
    out
}
