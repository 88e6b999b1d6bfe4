//! One way to take a candidate, and its parameters as unknowns of a fit.

use asid_effects::Start;

use crate::candidate::Candidate;
use crate::latent_force::fitted_value::Unknown;

/// One way to take a candidate: start values, and the columns that represent it.
#[derive(Clone, Debug)]
pub struct Form {
    /// The candidate.
    pub candidate: usize,
    /// Start values of its parameters.
    pub begin: Vec<f64>,
    /// For each column: the parameter of the derivative, with its prior's standard deviation;
    /// `None` for a secant.
    pub slopes: Vec<Option<(usize, f64)>>,
    /// Index of the first of its columns.
    pub first: usize,
}

impl Form {
    /// Returns the indices of its columns.
    #[must_use]
    pub fn columns(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.slopes.len()
    }

    /// Returns the values of the candidate's parameters at given coefficients of the columns.
    #[must_use]
    pub fn values(&self, candidate: &Candidate, coefficients: &[f64]) -> Vec<f64> {
        let mut values = self.begin.clone();
        for (slope, c) in self.slopes.iter().zip(coefficients) {
            match slope {
                Some((i, deviation)) => values[*i] += c * deviation,
                None => {
                    for (v, p) in values.iter_mut().zip(candidate.parameters()) {
                        let stays =
                            matches!(p.start, Start::Choice(_) | Start::Given | Start::Set(..));
                        if !stays && !p.is_limit() {
                            *v = p.null + c * (*v - p.null);
                        }
                    }
                }
            }
        }
        for (i, v) in values.iter_mut().enumerate() {
            let [low, high] = candidate.limits(i);
            *v = v.clamp(low, high);
        }
        values
    }

    /// Returns its parameters as unknowns of a fit.
    #[must_use]
    pub fn unknowns(&self, candidate: &Candidate) -> Vec<Unknown> {
        candidate
            .unknowns()
            .into_iter()
            .enumerate()
            .map(|(i, (parameter, free))| {
                let p = &candidate.parameters()[i];
                let slope = self.slopes.iter().flatten().find(|(k, _)| *k == i);
                let [low, high] = candidate.ranges[i];
                let width = |[low, high]: [f64; 2]| (high - low) / 12.0_f64.sqrt();
                let bounds = candidate.limits(i);
                let size = if p.is_limit() {
                    self.begin[i].abs()
                } else {
                    (self.begin[i] - p.null).abs()
                };
                // A parameter without a derivative is as uncertain as it is large.
                let other = if size > 0.0 {
                    size.min(width(bounds))
                } else {
                    width([low, high])
                };
                Unknown {
                    parameter,
                    center: if slope.is_some() || size > 0.0 && p.null == low {
                        p.null
                    } else {
                        self.begin[i]
                    },
                    deviation: slope.map_or(other, |(_, d)| *d),
                    bounds,
                    free,
                    is_tolerance: candidate.is_tolerance,
                }
            })
            .collect()
    }
}
