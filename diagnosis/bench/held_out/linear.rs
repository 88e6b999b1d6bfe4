//! Initial states of the held-out logs from the derivatives of one linearisation.

use asid_core::Result;
use asid_core::progress::Silent;
use nalgebra::DVector;

use crate::bench::Bench;
use crate::fit::{Begin, Effort, bounds, cost, fit};
use crate::linearise::Linearisation;
use crate::normal::Normal;
use crate::predict::Point;

use super::{Explained, given};

/// Relative excess of a replay's cost over the predicted one up to which replays count as linear in
/// the initial state.
///
/// Two percent of the cost are one percent of the gap, which is reported to no more.
const LINEAR: f64 = 0.02;
/// Maximum number of steps: the second corrects for the curvature of the first, the third shows
/// that nothing is left to correct.
const STEPS: usize = 3;
/// Parts of a Gauss-Newton step that are tried side by side.
const PARTS: [f64; 3] = [1.0, 0.3, 0.1];

/// Result of the steps.
pub(super) struct Left {
    /// Squared residuals of the whole logs, in units of the noise.
    pub(super) cost: f64,
    /// Whether that achieves the minimum which the derivatives predict.
    pub(super) is_kept: bool,
}

/// Takes Gauss-Newton steps of the initial states with the derivatives of one linearisation (a
/// chord method), and returns the remaining cost.
pub(super) fn linear(bench: &Bench, (trials, of): &Explained<'_>) -> Result<Left> {
    let mut point = Point {
        theta: of.fit.point.theta.clone(),
        starts: of.held_starts.clone(),
    };
    let mut predictor = bench.predictor(trials, &bench.test)?;
    let look = fit(
        &mut predictor,
        (bench.layout(), &given(bench, trials)),
        Begin::at(point.clone(), (&bench.open, &bench.reach)),
        (Effort::LOOK, &Silent),
    )?;
    let bounds = bounds(&predictor);
    let mut line = Linearisation {
        residuals: look.residuals,
        columns: Vec::new(),
        start_columns: look.starts.columns.clone(),
    };
    let mut least = look.cost;
    for _ in 0..STEPS {
        let normal = Normal::new(&line, &bounds, 0.0, &bench.reach);
        let none = DVector::zeros(0);
        let step: Vec<DVector<f64>> = (0..bounds.len())
            .map(|e| normal.start_step(e, &none))
            .collect();
        let mut promised = line.residuals.clone();
        for (range, by) in bounds.iter().zip(&step) {
            for (column, by) in line.start_columns.iter().zip(by.iter()) {
                range
                    .clone()
                    .for_each(|row| promised[row] -= by * column[row]);
            }
        }
        let most = (1.0 + LINEAR) * cost(&promised);
        if least <= most {
            return Ok(Left {
                cost: least,
                is_kept: least.is_finite(),
            });
        }
        let along = |part: f64| {
            let mut point = point.clone();
            for (start, by) in point.starts.iter_mut().zip(&step) {
                for (&coordinate, by) in bench.open.iter().zip(by.iter()) {
                    start.shift(bench.layout(), coordinate, part * by);
                }
            }
            point
        };
        let mut points = PARTS.map(along);
        let residuals = predictor.residuals(&points)?;
        let costs = residuals.iter().map(|r| cost(r)).enumerate();
        let best = costs.min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((place, value)) = best.filter(|(_, value)| *value < least) else {
            break;
        };
        least = value;
        std::mem::swap(&mut point, &mut points[place]);
        line.residuals.clone_from(&residuals[place]);
        if least <= most {
            return Ok(Left {
                cost: least,
                is_kept: true,
            });
        }
    }
    Ok(Left {
        cost: least,
        is_kept: false,
    })
}
