//! What the study's parameters and the starts of the episodes can make up for.
//!
//! An effect explains only what these cannot: its response is projected off their
//! directions, start by start within its own episode first, then the parameters.

use asid_core::Layout;

use crate::linearise::Open;
use crate::normal::inverse;
use crate::predict::State;

/// Directions in which the residual may move without the candidate: an orthonormal basis.
pub struct Nuisance {
    /// Per episode: place in the vector, and basis of its start's directions.
    starts: Vec<(std::ops::Range<usize>, Vec<Vec<f64>>)>,
    /// Basis of the parameters' directions, off the starts'.
    basis: Vec<Vec<f64>>,
    /// For each basis vector its coordinates in the parameters.
    combination: Vec<Vec<f64>>,
    /// Number of parameters.
    parameters: usize,
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Takes `along` out of `v`, and returns how much there was.
fn take_out(v: &mut [f64], along: &[f64]) -> f64 {
    let amount = dot(v, along);
    for (x, a) in v.iter_mut().zip(along) {
        *x -= amount * a;
    }
    amount
}

impl Nuisance {
    /// From columns of the parameters (whole vectors) and of the starts (all episodes at once).
    #[must_use]
    pub fn new(
        columns: &[Vec<f64>],
        start_columns: &[Vec<f64>],
        episodes: &[std::ops::Range<usize>],
    ) -> Self {
        let mut starts = Vec::new();
        for range in episodes {
            let mut basis: Vec<Vec<f64>> = Vec::new();
            for column in start_columns {
                let mut v = column[range.clone()].to_vec();
                let size = dot(&v, &v).sqrt();
                basis.iter().for_each(|b| {
                    take_out(&mut v, b);
                });
                let left = dot(&v, &v).sqrt();
                if left > 1e-6 * size && left > 0.0 {
                    v.iter_mut().for_each(|x| *x /= left);
                    basis.push(v);
                }
            }
            starts.push((range.clone(), basis));
        }
        let mut nuisance = Self {
            starts,
            basis: Vec::new(),
            combination: Vec::new(),
            parameters: columns.len(),
        };
        for (i, column) in columns.iter().enumerate() {
            let mut v = column.clone();
            let size = dot(&v, &v).sqrt();
            nuisance.project_starts(&mut v);
            let mut combination = vec![0.0; columns.len()];
            combination[i] = 1.0;
            for (b, c) in nuisance.basis.iter().zip(&nuisance.combination) {
                let amount = take_out(&mut v, b);
                for (x, y) in combination.iter_mut().zip(c) {
                    *x -= amount * y;
                }
            }
            let left = dot(&v, &v).sqrt();
            if left > 1e-6 * size && left > 0.0 {
                v.iter_mut().for_each(|x| *x /= left);
                combination.iter_mut().for_each(|x| *x /= left);
                nuisance.basis.push(v);
                nuisance.combination.push(combination);
            }
        }
        nuisance
    }

    fn project_starts(&self, v: &mut [f64]) {
        for (range, basis) in &self.starts {
            let part = &mut v[range.clone()];
            basis.iter().for_each(|b| {
                take_out(part, b);
            });
        }
    }

    /// Takes out what the nuisance parameters can do; returns how much each parameter does.
    pub fn project(&self, v: &mut [f64]) -> Vec<f64> {
        self.project_starts(v);
        let mut amounts = vec![0.0; self.parameters];
        for (b, c) in self.basis.iter().zip(&self.combination) {
            let amount = take_out(v, b);
            for (x, y) in amounts.iter_mut().zip(c) {
                *x += amount * y;
            }
        }
        amounts
    }
}

/// What open starts do, and how they follow a step of everything else.
pub struct Starts {
    open: Open,
    columns: Vec<Vec<f64>>,
    /// Per episode: place in the vector, and inverse of the starts' normal equations.
    episodes: Vec<(std::ops::Range<usize>, nalgebra::DMatrix<f64>)>,
}

impl Starts {
    /// From the columns of the open coordinates, of all episodes at once.
    #[must_use]
    pub fn new(open: &Open, columns: Vec<Vec<f64>>, episodes: Vec<std::ops::Range<usize>>) -> Self {
        let m = columns.len();
        let normal = |range: std::ops::Range<usize>| {
            let part = |i: usize| &columns[i][range.clone()];
            let gram = nalgebra::DMatrix::from_fn(m, m, |i, j| dot(part(i), part(j)));
            (range.clone(), inverse(&gram, 1e-12))
        };
        Self {
            open: open.clone(),
            episodes: episodes.into_iter().map(normal).collect(),
            columns,
        }
    }

    /// Moves starts to where they leave least of `residuals`, to first order.
    pub fn follow(&self, layout: &Layout, residuals: &[f64], starts: &mut [State]) {
        if self.open.is_empty() {
            return;
        }
        for ((range, inverse), start) in self.episodes.iter().zip(starts) {
            let along = self.columns.iter();
            let along = along.map(|c| dot(&c[range.clone()], &residuals[range.clone()]));
            let moves = inverse * nalgebra::DVector::from_iterator(self.columns.len(), along);
            for (&coordinate, by) in self.open.iter().zip(moves.iter()) {
                start.shift(layout, coordinate, *by);
            }
        }
    }
}
