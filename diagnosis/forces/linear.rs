//! Windows of the logs, linearised in a constant force at each joint and in the initial states.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use crate::bench::{Bench, Trial};
use crate::candidate::Candidate;
use crate::linearise::{Differences, linearise};
use crate::normal::inverse;
use crate::predict::Point;
use crate::record::Record;
use crate::windows::settle;

/// Name of the effect's parameter that is the force.
const FORCE: &str = "offset";

/// Windows linearised in the constant force of each joint and in their initial states.
pub(super) struct Linear {
    /// The parameters, with the initial states of the windows.
    pub(super) point: Point,
    /// For each joint, the range of its force in its unit.
    ranges: Vec<[f64; 2]>,
    /// Residuals at that point.
    residuals: Vec<f64>,
    /// Derivatives of the residuals: by each joint's force per share of its range, then by the open
    /// coordinates of the initial states.
    columns: Vec<Vec<f64>>,
    /// Which residuals have a reading.
    present: Vec<bool>,
}

impl Linear {
    /// Linearises a model with some effects at windows with fitted initial states; `forces` are the
    /// constant forces of the joints.
    pub(super) fn of(
        bench: &Bench,
        windows: &Record,
        (trials, theta): (&[Trial<'_>], &[f64]),
        forces: &[Candidate],
    ) -> Result<Self> {
        // If a joint has the effect already, its force is among the parameters.
        let mut all: Vec<Trial<'_>> = trials.to_vec();
        for force in forces {
            if !trials.iter().any(|(c, _)| c.label() == force.label()) {
                let nulls = force.parameters().iter().map(|p| p.null).collect();
                all.push((force, nulls));
            }
        }
        let mut point = Point {
            theta: theta.to_vec(),
            starts: settle(bench, windows, trials, theta)?,
        };
        all.iter().for_each(|(_, v)| point.theta.extend(v));
        let mut unknowns = bench.unknowns(&all);
        unknowns.iter_mut().for_each(|u| u.free = false);
        let place = |f: &Candidate| {
            let name = format!("{}.{FORCE}", f.label());
            unknowns.iter().position(|u| u.parameter.name == name)
        };
        let places: Vec<usize> = forces.iter().filter_map(place).collect();
        places.iter().for_each(|&i| unknowns[i].free = true);
        let mut differences = Differences::new(unknowns.len(), bench.open.len());
        let mut predictor = bench.predictor(&all, windows)?;
        let mut line = || {
            linearise(
                &mut predictor,
                bench.layout(),
                &unknowns,
                &point,
                &bench.open,
                &mut differences,
            )
        };
        // Two linearisations adapt the steps of the differences.
        line()?;
        line()?;
        let line = line()?;
        // Columns are in the order of the parameters, forces in that of the joints.
        let mut order = places.clone();
        order.sort_unstable();
        let column = |i: &usize| order.iter().position(|o| o == i).unwrap_or(0);
        let own = places.iter().map(|i| line.columns[column(i)].clone());
        // Rows after a replay has failed carry no information on forces.
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        let mut columns: Vec<Vec<f64>> = own.chain(line.start_columns).collect();
        columns.iter_mut().flatten().for_each(|x| *x = finite(*x));
        Ok(Self {
            columns,
            ranges: places
                .iter()
                .map(|&i| unknowns[i].parameter.range)
                .collect(),
            residuals: line.residuals,
            present: predictor.present().to_vec(),
            point,
        })
    }

    /// Returns the root mean square residual of some rows.
    pub(super) fn gap(&self, rows: std::ops::Range<usize>) -> f64 {
        let readings = rows.filter(|&k| self.present[k]);
        let squares: Vec<f64> = readings.map(|k| self.residuals[k].powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Returns the force at each joint that explains most of the rows of a window, with its
    /// variance, in the joint's unit and its square.
    pub(super) fn forces(&self, rows: std::ops::Range<usize>) -> Vec<(f64, f64)> {
        let n = self.columns.len();
        let part = |i: usize| &self.columns[i][rows.clone()];
        let normal = DMatrix::from_fn(n, n, |i, j| dot(part(i), part(j)));
        let covariance = inverse(&normal, 1e-12);
        let finite = |x: &f64| if x.is_finite() { *x } else { 0.0 };
        let residuals: Vec<f64> = self.residuals[rows.clone()].iter().map(finite).collect();
        let along = DVector::from_fn(n, |i, _| dot(part(i), &residuals));
        let found = &covariance * along;
        let of = |(k, [low, high]): (usize, &[f64; 2])| {
            let unit = high - low;
            (-found[k] * unit, covariance[(k, k)] * unit.powi(2))
        };
        self.ranges.iter().enumerate().map(of).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
