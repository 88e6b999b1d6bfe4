//! Gauss-Newton fit of a few values to replays, with derivatives from finite differences.
//!
//! The fit ranks sets by what they can leave, and the fit to the logs begins where it ends. So a
//! few steps suffice.

use asid_core::{Progress, Result};
use nalgebra::{DMatrix, DVector};

/// Most Gauss-Newton steps of one fit.
const STEPS: usize = 4;
/// Fractions of a step that are tried, until one leaves less.
const PARTS: [f64; 2] = [1.0, 0.5];
/// Share of the power above the noise that a step must remove for a further step.
const GAINED: f64 = 0.05;
/// Change of the residuals over a finite difference, relative to them, that counts as rounding.
const ROUNDING: f64 = 1e-10;

/// A value to fit.
pub(super) struct Value {
    /// Initial value.
    pub(super) start: f64,
    /// Step of its finite difference.
    pub(super) step: f64,
    /// Lower and upper bound.
    pub(super) bounds: [f64; 2],
}

/// Residuals at some values; the sum of their squares is the mean square of readings in units of
/// their noise.
pub(super) type Residuals<'r> = &'r dyn Fn(&[f64]) -> Result<Vec<f64>>;

/// Values whose residuals are smaller than at the start, and these residuals.
///
/// # Errors
/// When residuals cannot be computed.
pub(super) fn fitted(
    residuals: Residuals<'_>,
    values: &[Value],
    progress: &dyn Progress,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let mut at: Vec<f64> = values.iter().map(|v| v.start).collect();
    let mut here = residuals(&at)?;
    for _ in 0..STEPS {
        if progress.is_stopped() {
            break;
        }
        let Some(step) = step(residuals, values, (&at, &here))? else {
            break;
        };
        let before = power(&here);
        for part in PARTS {
            let moved = at.iter().zip(step.iter()).zip(values);
            let moved: Vec<f64> = moved
                .map(|((x, by), v)| (x - part * by).clamp(v.bounds[0], v.bounds[1]))
                .collect();
            let there = residuals(&moved)?;
            if power(&there) < before {
                (at, here) = (moved, there);
                break;
            }
        }
        if before - power(&here) <= GAINED * (before - 1.0) {
            break;
        }
    }
    Ok((at, here))
}

/// The Gauss-Newton step; `None` if the derivatives cannot be computed.
fn step(
    residuals: Residuals<'_>,
    values: &[Value],
    (at, here): (&[f64], &[f64]),
) -> Result<Option<DVector<f64>>> {
    let here = DVector::from_column_slice(here);
    let mut slopes = DMatrix::zeros(here.len(), values.len());
    for (i, value) in values.iter().enumerate() {
        let is_near = at[i] + value.step > value.bounds[1];
        let by = if is_near { -value.step } else { value.step };
        let mut moved = at.to_vec();
        moved[i] += by;
        let there = DVector::from_vec(residuals(&moved)?);
        if there.len() != here.len() {
            return Ok(None);
        }
        let change = there - &here;
        // Rounding leads to no value.
        if change.norm() <= ROUNDING * here.norm() {
            continue;
        }
        slopes.set_column(i, &(change / by));
    }
    if slopes.iter().chain(here.iter()).any(|x| !x.is_finite()) {
        return Ok(None);
    }
    // A value that no residual depends on stays where it is.
    Ok(least_squares(&slopes, &here))
}

/// The coefficients of columns that come closest to some residuals; 0 for a column of zeros.
///
/// `None` if they cannot be computed. Columns have the length one in the equations that are solved,
/// so that the unit of a value does not decide whether its column counts.
pub(super) fn least_squares(
    columns: &DMatrix<f64>,
    residuals: &DVector<f64>,
) -> Option<DVector<f64>> {
    let length = |norm: f64| if norm > 0.0 { norm } else { 1.0 };
    let each = columns.column_iter().map(|c| length(c.norm()));
    let lengths = DVector::from_iterator(columns.ncols(), each);
    let mut units = columns.clone();
    for (mut column, length) in units.column_iter_mut().zip(lengths.iter()) {
        column /= *length;
    }
    let gram = units.tr_mul(&units);
    let moment = units.tr_mul(residuals);
    let found = gram.svd(true, true).solve(&moment, f64::EPSILON.sqrt());
    Some(found.ok()?.component_div(&lengths))
}

/// Sum of squares.
pub(super) fn power(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

#[cfg(test)]
mod tests {
    use asid_core::progress::Silent;

    use super::*;

    fn value(start: f64, bounds: [f64; 2]) -> Value {
        Value {
            start,
            step: 1e-6,
            bounds,
        }
    }

    /// By hand: a spring of stiffness 1/x under a load y deflects by x y. With the load itself read
    /// too, both are found, although each can stand in for the other.
    #[test]
    fn two_values_that_stand_in_for_each_other_are_told_apart() {
        let residuals = |z: &[f64]| Ok(vec![30.0 * (z[0] * z[1] - 6.0), 10.0 * (z[1] - 3.0)]);
        let start = [value(0.5, [0.0, 10.0]), value(5.0, [0.0, 10.0])];
        let (found, left) = fitted(&residuals, &start, &Silent).unwrap();
        assert!((found[0] - 2.0).abs() < 1e-3, "{found:?}");
        assert!((found[1] - 3.0).abs() < 1e-3, "{found:?}");
        assert!(power(&left) < 1e-3);
    }

    #[test]
    fn a_value_stays_within_its_bounds() {
        let residuals = |z: &[f64]| Ok(vec![40.0 * (z[0] - 2.0)]);
        let (found, _) = fitted(&residuals, &[value(0.5, [0.0, 1.0])], &Silent).unwrap();
        assert_eq!(found, [1.0]);
    }

    #[test]
    fn what_no_replay_depends_on_stays_where_it_is() {
        let residuals = |z: &[f64]| Ok(vec![40.0 * (z[0] - 2.0), 7.0]);
        let start = [value(0.5, [0.0, 9.0]), value(4.0, [0.0, 9.0])];
        let (found, _) = fitted(&residuals, &start, &Silent).unwrap();
        assert!(
            (found[0] - 2.0).abs() < 1e-6 && found[1] == 4.0,
            "{found:?}"
        );
    }

    /// Symptom: a servo's stiffness in N/m stayed where it was, although replays depend on it.
    /// Cause: its column is small, since a newton per metre does little, and counted as one of
    /// zeros.
    #[test]
    fn a_value_is_found_in_any_unit() {
        let residuals = |z: &[f64]| Ok(vec![40e-6 * (z[0] - 2e6)]);
        let value = Value {
            start: 0.5e6,
            step: 1e3,
            bounds: [0.0, 9e6],
        };
        let (found, _) = fitted(&residuals, &[value], &Silent).unwrap();
        assert!((found[0] / 2e6 - 1.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn replays_that_diverge_are_not_followed() {
        let residuals = |z: &[f64]| Ok(vec![if z[0] > 1.0 { f64::NAN } else { 5.0 - z[0] }]);
        let (found, left) = fitted(&residuals, &[value(0.5, [0.0, 9.0])], &Silent).unwrap();
        assert_eq!((found, left), (vec![0.5], vec![4.5]));
    }
}
