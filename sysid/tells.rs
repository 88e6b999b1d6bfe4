//! What readings tell about the unknowns: Fisher information, in units of the prior.
//!
//! For Gaussian noise of covariance `S` the information of an episode is `I = Σ J^T S^-1 J` over
//! its readings. `J` is their derivative in the unknowns along the whole trajectory: the perturbed
//! machine is simulated from the beginning under the same commands. Here `J` is whitened by the
//! noise and scaled to prior standard deviations of the unknowns, so that the prior's own
//! information is the identity. Nuisance entries follow the unknowns. They are estimated jointly,
//! and projected out by taking the unknowns' block of the inverse.

use asid_algorithms::fisher::{Objective, inverse_above_prior};
use asid_core::episode::InitialState;
use asid_core::error::Result;
use asid_core::posterior::Direction;
use asid_core::{Model, Parameter};
use nalgebra::DMatrix;

use crate::dataset::{Dataset, Replayer};
use crate::marginal::marginal;
use crate::play::{Played, Player};

/// Half step of the differences, in prior standard deviations.
///
/// Smooth machines are linear over it, and it is far above rounding.
const STEP: f64 = 0.02;

/// Half step of the differences that rank motions in a search, in prior standard deviations.
///
/// Some changes of a reading are about equally large for any step: those of a contact that comes a
/// time step earlier or later, or of a machine that amplifies small differences. Divided by a short
/// step they look like information that no identification finds. This step is a seventh of the way
/// to the end of a uniform range. Over it they count a twelfth as much as over [`STEP`], and smooth
/// machines are nearly as linear.
const SEARCH_STEP: f64 = 0.25;

/// Information along a direction below which it counts as unseen by the readings.
///
/// It is less than a uniform prior's own, whose variance is a twelfth of its range squared.
const UNSEEN: f64 = 1.0 / 12.0;

/// Weight that an unknown needs in a direction to be named in it.
const NAMED: f64 = 0.2;

/// Information about unknowns and nuisance entries, without the prior.
#[derive(Clone, Debug)]
pub struct Told {
    /// `n x n`, the unknowns first.
    pub matrix: DMatrix<f64>,
    /// Number of unknowns that are sought.
    pub sought: usize,
}

impl Told {
    /// No information about `sought` unknowns of `n` entries.
    #[must_use]
    pub fn nothing(sought: usize, n: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(n, n),
            sought,
        }
    }

    /// Information of whitened derivatives about `sought` unknowns of `n` entries.
    ///
    /// There is one column for each entry, and no information without columns.
    #[must_use]
    pub(crate) fn of(columns: Option<&[Vec<f64>]>, (sought, n): (usize, usize)) -> Self {
        let mut told = Self::nothing(sought, n);
        if let Some(columns) = columns {
            told.add(columns);
        }
        told
    }

    /// Adds whitened derivatives, one column for each entry. Missing readings add nothing.
    pub fn add(&mut self, columns: &[Vec<f64>]) {
        let n = columns.len();
        let rows = columns.first().map_or(0, Vec::len);
        for k in 0..rows {
            if columns.iter().any(|c| !c[k].is_finite()) {
                continue;
            }
            for i in 0..n {
                for j in 0..n {
                    self.matrix[(i, j)] += columns[i][k] * columns[j][k];
                }
            }
        }
    }

    /// This information, reduced where the `other` tells less of an entry.
    ///
    /// A derivative that is left out of one entry alone may also part it from those that it was
    /// confounded with.
    #[must_use]
    pub(crate) fn no_more_than(&self, other: &Self) -> Self {
        let pairs = self
            .all_deviations()
            .into_iter()
            .zip(other.all_deviations());
        let factors: Vec<f64> = pairs
            .map(|(own, other)| if other > own { own / other } else { 1.0 })
            .collect();
        let n = factors.len();
        Self {
            matrix: DMatrix::from_fn(n, n, |i, j| factors[i] * self.matrix[(i, j)] * factors[j]),
            sought: self.sought,
        }
    }

    /// `times` times this information, plus another one.
    #[must_use]
    pub fn and(&self, times: f64, other: &Self) -> Self {
        Self {
            matrix: &self.matrix * times + &other.matrix,
            sought: self.sought,
        }
    }

    /// Posterior covariance of the sought unknowns, in prior standard deviations.
    #[must_use]
    pub fn covariance(&self) -> DMatrix<f64> {
        let all = self.whole_covariance();
        all.view((0, 0), (self.sought, self.sought)).into_owned()
    }

    /// Posterior covariance of the unknowns and the nuisance entries.
    fn whole_covariance(&self) -> DMatrix<f64> {
        let n = self.matrix.nrows();
        inverse_above_prior(&(&self.matrix + DMatrix::identity(n, n)))
    }

    /// Expected standard deviation of each unknown and nuisance entry, in prior standard
    /// deviations.
    pub(crate) fn all_deviations(&self) -> Vec<f64> {
        let diagonal = self.whole_covariance().diagonal();
        diagonal.iter().map(|v| v.max(0.0).sqrt()).collect()
    }

    /// Expected standard deviation of each unknown, in prior standard deviations.
    #[must_use]
    pub fn deviations(&self) -> Vec<f64> {
        let covariance = self.covariance();
        (0..self.sought)
            .map(|i| covariance[(i, i)].max(0.0).sqrt())
            .collect()
    }

    /// The cost that a search minimises.
    ///
    /// It is the trace of the covariance, the log of its determinant, or the negative trace of the
    /// information.
    #[must_use]
    pub fn cost(&self, objective: Objective) -> f64 {
        match objective {
            Objective::AOptimal => self.covariance().trace(),
            Objective::DOptimal => {
                let eigen = self.covariance().symmetric_eigen();
                eigen
                    .eigenvalues
                    .iter()
                    .map(|v| v.max(f64::MIN_POSITIVE).ln())
                    .sum()
            }
            Objective::Trace => -(0..self.sought).map(|i| self.matrix[(i, i)]).sum::<f64>(),
        }
    }

    /// Combinations of unknowns that the readings do not see, by name.
    #[must_use]
    pub fn unseen(&self, names: &[String]) -> Vec<Direction> {
        let covariance = self.covariance();
        let eigen = covariance.symmetric_eigen();
        let mut found = Vec::new();
        for (k, variance) in eigen.eigenvalues.iter().enumerate() {
            // Subtract the prior's own information, which is one.
            if 1.0 / variance.max(f64::MIN_POSITIVE) - 1.0 >= UNSEEN {
                continue;
            }
            let column = eigen.eigenvectors.column(k);
            let sign = column[column.iamax()].signum();
            let weights = names
                .iter()
                .zip(column.iter())
                .filter(|(_, w)| w.abs() >= NAMED);
            found.push(Direction {
                weights: weights.map(|(n, w)| (n.clone(), sign * w)).collect(),
            });
        }
        found
    }
}

/// The points of central differences about `values`, and the widths of the differences.
///
/// The points are the middle, then up and down in each entry. The widths are the distances between
/// up and down, in prior standard deviations.
#[must_use]
pub fn differences(parameters: &[Parameter], values: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    differences_over(parameters, values, &vec![STEP; parameters.len()])
}

/// As [`differences`], over the wider step of a search.
#[must_use]
pub fn search_differences(parameters: &[Parameter], values: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    differences_over(parameters, values, &vec![SEARCH_STEP; parameters.len()])
}

/// Points and widths for given half steps of each entry, in prior standard deviations.
pub(crate) fn differences_over(
    parameters: &[Parameter],
    values: &[f64],
    steps: &[f64],
) -> (Vec<Vec<f64>>, Vec<f64>) {
    let bound = Parameter::scaled_bound();
    let mut points = vec![values.to_vec()];
    let mut widths = Vec::with_capacity(parameters.len());
    for (i, (parameter, step)) in parameters.iter().zip(steps).enumerate() {
        let z = parameter.to_scaled(values[i]);
        let ends = [(z + step).min(bound), (z - step).max(-bound)];
        widths.push(ends[0] - ends[1]);
        for end in ends {
            let mut point = values.to_vec();
            point[i] = parameter.from_scaled(end);
            points.push(point);
        }
    }
    (points, widths)
}

/// Information of a motion, from its plays at the points of [`differences`].
#[must_use]
pub fn of_plays(player: &Player<'_>, plays: &[Played], widths: &[f64], sought: usize) -> Told {
    let columns = derivatives(player, plays, widths);
    Told::of(columns.as_deref(), (sought, widths.len()))
}

/// Whitened derivatives from plays at the points of [`differences`], one column for each entry.
///
/// `None` where a play diverged.
pub(crate) fn derivatives(
    player: &Player<'_>,
    plays: &[Played],
    widths: &[f64],
) -> Option<Vec<Vec<f64>>> {
    if plays.iter().any(|p| p.readings.is_empty()) {
        return None;
    }
    let (width, entries) = (player.width(), player.differences.whitened_len());
    let column = |(i, h): (usize, &f64)| {
        let (up, down) = (&plays[1 + 2 * i].readings, &plays[2 + 2 * i].readings);
        let mut out = vec![0.0; up.len() / width.max(1) * entries];
        let rows = up.chunks_exact(width).zip(down.chunks_exact(width));
        for ((up, down), row) in rows.zip(out.chunks_exact_mut(entries)) {
            player.differences.difference(up, down, row);
            row.iter_mut().for_each(|x| *x /= h);
        }
        out
    };
    Some(widths.iter().enumerate().map(column).collect())
}

/// Information of logs, with the initial states that they leave open marginalised.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn of_logs(
    model: &dyn Model,
    parameters: &[Parameter],
    (values, sought): (&[f64], usize),
    data: &Dataset,
    threads: usize,
) -> Result<Told> {
    let layout = model.layout();
    let open = data.trials.iter().map(|t| t.open.len()).max().unwrap_or(0);
    let (points, widths) = differences(parameters, values);
    let mut replayer = Replayer::new(model, parameters, points.len().max(1 + 2 * open), threads)?;
    let mut told = Told::nothing(sought, parameters.len());
    for trial in &data.trials {
        let marginal = marginal(&mut replayer, layout, data, trial, values)?;
        let jobs: Vec<(&[f64], &InitialState)> =
            points.iter().map(|p| (&p[..], &marginal.start)).collect();
        let found = replayer.residuals(data, trial, &jobs)?;
        let rows: Option<Vec<Vec<f64>>> = found
            .into_iter()
            .map(|r| r.map(|r| marginal.apply(&r)))
            .collect();
        let Some(rows) = rows else { continue };
        let columns: Vec<Vec<f64>> = widths
            .iter()
            .enumerate()
            .map(|(i, h)| {
                let pairs = rows[1 + 2 * i].iter().zip(&rows[2 + 2 * i]);
                pairs.map(|(up, down)| (down - up) / h).collect()
            })
            .collect();
        told.add(&columns);
    }
    Ok(told)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(sought: usize, matrix: &[f64]) -> Told {
        let n = (matrix.len() as f64).sqrt() as usize;
        Told {
            matrix: DMatrix::from_row_slice(n, n, matrix),
            sought,
        }
    }

    #[test]
    fn nuisance_is_projected_out() {
        // The unknown looks like the nuisance entry: Schur's complement leaves only their
        // difference.
        let found = told(1, &[100.0, 100.0, 100.0, 100.0]);
        let expected = 1.0 / (101.0 - 100.0 * 100.0 / 101.0);
        assert!((found.covariance()[(0, 0)] - expected).abs() < 1e-9);
        assert!((told(1, &[100.0]).deviations()[0] - (1.0_f64 / 101.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_sum_that_is_seen_leaves_the_difference_unseen() {
        let names = ["a", "b"].map(String::from);
        let unseen = told(2, &[50.0, 50.0, 50.0, 50.0]).unseen(&names);
        assert_eq!(unseen.len(), 1);
        let weights: Vec<f64> = unseen[0].weights.iter().map(|w| w.1).collect();
        assert!((weights[0] + weights[1]).abs() < 1e-9);
        assert!(told(2, &[50.0, 0.0, 0.0, 50.0]).unseen(&names).is_empty());
    }

    #[test]
    fn repeats_add_information() {
        let once = told(1, &[3.0]);
        let nothing = Told::nothing(1, 1);
        assert!((once.and(5.0, &nothing).deviations()[0] - 0.25).abs() < 1e-12);
    }
}
