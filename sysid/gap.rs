//! The gap of a model on logs: root mean square of open-loop residuals, in units of the noise.
//!
//! A replay begins at the initial state of the log. Coordinates that the log leaves open are fitted
//! to the first tenth of the episode, which then does not count.

use asid_core::episode::InitialState;
use asid_core::error::Result;
use asid_core::{Layout, Model, Parameter};
use nalgebra::{DMatrix, DVector};

use crate::dataset::{Dataset, Replayer, Trial};
use crate::start::moved;

/// Share of an episode that an open initial state is fitted to.
const WARM_UP: f64 = 0.1;

/// Fewest rows that it is fitted to: fewer tell no speed.
const WARM_UP_ROWS: usize = 6;

/// Half steps of differences in an initial state, for positions and velocities.
///
/// They are in rad or m, and rad/s or m/s. Over them trajectories are linear to 1e-4, and rounding
/// is below 1e-8.
const STEPS: [f64; 2] = [1e-4, 1e-3];

/// Prior standard deviation of an open coordinate about its value in the first readings.
///
/// In rad or m, rad/s or m/s. It is so wide that it only fixes what no reading sees.
const PRIOR: f64 = 1.0;

/// Gauss-Newton steps of an initial state; the first readings give a start nearby.
const ITERATIONS: usize = 4;

/// Step lengths that are tried for each Gauss-Newton step.
const LENGTHS: [f64; 4] = [1.0, 0.5, 0.2, 0.05];

/// Sensitivities of an episode's residuals to its open initial coordinates.
pub struct StartSlopes {
    /// Derivatives, `rows * entries x open`; zero where a reading is missing.
    pub matrix: DMatrix<f64>,
    /// Residuals at the initial state.
    pub residuals: Vec<f64>,
}

/// Central differences in the open coordinates; `None` where a simulation diverged.
///
/// # Errors
/// As [`Replayer::residuals`].
pub fn start_slopes(
    replayer: &mut Replayer,
    layout: &Layout,
    data: &Dataset,
    trial: &Trial,
    theta: &[f64],
    start: &InitialState,
) -> Result<Option<StartSlopes>> {
    let step = |c: usize| STEPS[usize::from(c >= layout.nv)];
    let mut states = vec![start.clone()];
    for &c in &trial.open {
        states.push(moved(layout, start, c, step(c)));
        states.push(moved(layout, start, c, -step(c)));
    }
    let points: Vec<(&[f64], &InitialState)> = states.iter().map(|s| (theta, s)).collect();
    let found = replayer.residuals(data, trial, &points)?;
    let Some(rows): Option<Vec<Vec<f64>>> = found.into_iter().collect() else {
        return Ok(None);
    };
    let matrix = DMatrix::from_fn(rows[0].len(), trial.open.len(), |r, k| {
        let slope = (rows[2 * k + 1][r] - rows[2 * k + 2][r]) / (2.0 * step(trial.open[k]));
        if slope.is_finite() { slope } else { 0.0 }
    });
    Ok(Some(StartSlopes {
        matrix,
        residuals: rows.into_iter().next().unwrap_or_default(),
    }))
}

/// Sum of squares of the residuals that are present.
fn squares(residuals: &[f64]) -> f64 {
    residuals
        .iter()
        .filter(|x| x.is_finite())
        .map(|x| x * x)
        .sum()
}

/// The initial state of an episode that best fits its first `rows` rows.
///
/// # Errors
/// As [`Replayer::residuals`].
pub fn fit_start(
    replayer: &mut Replayer,
    layout: &Layout,
    data: &Dataset,
    trial: &Trial,
    theta: &[f64],
    rows: usize,
) -> Result<InitialState> {
    let mut start = trial.start.clone();
    if trial.open.is_empty() {
        return Ok(start);
    }
    let length = rows * data.entries();
    for _ in 0..ITERATIONS {
        let Some(slopes) = start_slopes(replayer, layout, data, trial, theta, &start)? else {
            return Ok(start);
        };
        let s = slopes.matrix.rows(0, length);
        let r = DVector::from_iterator(
            length,
            slopes.residuals[..length]
                .iter()
                .map(|x| if x.is_finite() { *x } else { 0.0 }),
        );
        let n = trial.open.len();
        let normal = s.transpose() * s + DMatrix::identity(n, n) / (PRIOR * PRIOR);
        let Some(factor) = normal.cholesky() else {
            return Ok(start);
        };
        let step = factor.solve(&(-(s.transpose() * &r)));
        let tried: Vec<InitialState> = LENGTHS
            .iter()
            .map(|length| {
                let moves = trial.open.iter().zip(step.iter());
                moves.fold(start.clone(), |state, (&c, by)| {
                    moved(layout, &state, c, length * by)
                })
            })
            .collect();
        let points: Vec<(&[f64], &InitialState)> = tried.iter().map(|s| (theta, s)).collect();
        let found = replayer.residuals(data, trial, &points)?;
        let costs = found
            .iter()
            .map(|r| r.as_ref().map_or(f64::INFINITY, |r| squares(&r[..length])));
        let best = costs.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let before = squares(&slopes.residuals[..length]);
        match best {
            Some((k, cost)) if cost < before => {
                start = tried[k].clone();
                if cost > before * (1.0 - 1e-6) {
                    break;
                }
            }
            _ => break,
        }
    }
    Ok(start)
}

/// Number of rows that an open initial state is fitted to; 0 where nothing is open.
#[must_use]
pub fn warm_up(trial: &Trial) -> usize {
    if trial.open.is_empty() {
        return 0;
    }
    let rows = trial.episode.rows();
    ((WARM_UP * rows as f64).ceil() as usize)
        .max(WARM_UP_ROWS)
        .min(rows)
}

/// The gap of a model on some logs.
#[derive(Clone, Debug)]
pub struct Gap {
    /// Root mean square over all readings that count; infinite where a replay diverged.
    ///
    /// It is NaN where no reading counts, as in logs that are no longer than the rows that an open
    /// initial state is fitted to.
    pub value: f64,
    /// Residuals of each episode that count (`rows x entries`); empty where it diverged.
    pub residuals: Vec<Vec<f64>>,
}

/// The gap at given parameter values.
///
/// # Errors
/// When a value is not physical or the engine fails.
pub fn gap(
    model: &dyn Model,
    parameters: &[Parameter],
    theta: &[f64],
    data: &Dataset,
    threads: usize,
) -> Result<Gap> {
    let layout = model.layout();
    let size = data
        .trials
        .iter()
        .map(|t| 1 + 2 * t.open.len())
        .max()
        .unwrap_or(1);
    let mut replayer = Replayer::new(model, parameters, size.max(LENGTHS.len()), threads)?;
    let (mut sum, mut count, mut all) = (0.0, 0usize, Vec::new());
    for trial in &data.trials {
        let first = warm_up(trial);
        let start = fit_start(&mut replayer, layout, data, trial, theta, first)?;
        let found = replayer.residuals(data, trial, &[(theta, &start)])?;
        let Some(Some(residuals)) = found.into_iter().next() else {
            all.push(Vec::new());
            sum = f64::INFINITY;
            continue;
        };
        let counted = residuals[(first * data.entries()).min(residuals.len())..].to_vec();
        sum += squares(&counted);
        count += counted.iter().filter(|x| x.is_finite()).count();
        all.push(counted);
    }
    Ok(Gap {
        value: root_mean(sum, count),
        residuals: all,
    })
}

/// Root of the mean of `count` squares; NaN for none of them, since 0 would be a perfect replay.
fn root_mean(sum: f64, count: usize) -> f64 {
    match count {
        0 if sum.is_finite() => f64::NAN,
        _ => (sum / count.max(1) as f64).sqrt(),
    }
}

/// The message for logs in which no reading counts, such as `held out`.
#[must_use]
pub fn too_short(logs: &str) -> String {
    format!(
        "the logs {logs} are too short for a gap: an open start is fitted to the first {WARM_UP_ROWS} rows at least, and no reading is left behind them"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a gap of 0.00 on logs of six rows, as if the model replayed them perfectly.
    ///
    /// Cause: an initial state was fitted to all of them, and the mean of no residual was 0.
    #[test]
    fn a_log_that_is_all_warm_up_has_no_gap() {
        assert!(root_mean(0.0, 0).is_nan());
        assert_eq!(root_mean(8.0, 2), 2.0);
        // A replay that diverged is reported as such.
        assert_eq!(root_mean(f64::INFINITY, 0), f64::INFINITY);
    }
}
