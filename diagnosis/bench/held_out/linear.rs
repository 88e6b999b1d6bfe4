//! Starts of the logs held out by the slopes of one linearisation.

use asid_core::Result;
use asid_core::progress::Silent;
use nalgebra::DVector;

use crate::bench::Bench;
use crate::fit::{Begin, Effort, bounds, cost, fit};
use crate::linearise::Linearisation;
use crate::normal::Normal;
use crate::predict::Point;

use super::{Explained, given};

/// Share of the cost that slopes promise, by which that of a replay may lie above it where replays count as linear in the start: a percent of the
/// gap, which is told to no more.
const LINEAR: f64 = 0.02;
/// Most steps: the second mends what curvature makes of the first, the third shows that nothing is left to mend.
const STEPS: usize = 3;
/// Parts of a step of Gauss and Newton that are tried side by side.
const PARTS: [f64; 3] = [1.0, 0.3, 0.1];

/// What is left of the logs.
pub(super) struct Left {
    /// Squared residuals of the whole logs, in units of the noise.
    pub(super) cost: f64,
    /// Whether that is the least which the slopes promise.
    pub(super) is_kept: bool,
}

/// What an explanation leaves of the logs after steps of their starts by the slopes of one linearisation (a chord method).
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
