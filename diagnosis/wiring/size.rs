//! Estimates offsets and delays by Gauss-Newton steps on the residuals of the windows, with bounded
//! weights.
//!
//! A wrong mass makes a drive respond later or earlier, as a wrong clock does. So the study's own
//! parameters may be fitted together with the size.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use super::view::View;
use super::windows::{Misses, Windows};

/// Gauss-Newton steps. Misses are nearly linear in an offset over a window; an initial value
/// several motions away takes some.
const STEPS: usize = 4;
/// Residual, in motions, above which the loss is linear (Huber's loss): some windows contain
/// contacts.
const HUBER: f64 = 1.0;
/// Halvings of a step that does not lower the loss.
const HALVINGS: usize = 3;
/// Finite-difference step and largest step of a parameter, as shares of its range.
const PARAMETER: (f64, f64) = (0.01, 0.3);
/// Added to the diagonal of the normal equations, as a share of it: parameters without influence
/// stay where they are.
const RIDGE: f64 = 1e-6;
/// Loss of a residual where the engine failed, motions squared: larger than any finite one.
const FAILED: f64 = 1e3;

/// Settings of the fit of a size.
#[derive(Clone, Copy, Debug)]
pub struct Fit {
    /// Initial value.
    pub start: f64,
    /// Finite-difference step.
    pub probe: f64,
    /// Largest step.
    pub longest: f64,
    /// Whether the study's parameters are fitted together with it.
    pub parameters: bool,
}

/// Sum over residuals of Huber's loss, in motions.
fn loss(misses: &Misses) -> f64 {
    let width = misses.motion.len();
    let each = misses.residual.iter().enumerate().map(|(i, r)| {
        let x = r.abs() / misses.motion[i % width];
        match x {
            x if x.is_nan() => 0.0,
            x if x <= HUBER => 0.5 * x * x,
            x if x.is_finite() => HUBER * (x - 0.5 * HUBER),
            _ => FAILED,
        }
    });
    each.sum()
}

/// Gauss-Newton step from finite differences over `probes`.
fn step(here: &Misses, there: &[Misses], probes: &[f64]) -> DVector<f64> {
    let (n, width) = (probes.len(), here.motion.len());
    let (mut gradient, mut curvature) = (DVector::zeros(n), DMatrix::zeros(n, n));
    for (i, a) in here.residual.iter().enumerate() {
        let scale = here.motion[i % width];
        let r = a / scale;
        let slope = |k: usize| (there[k].residual[i] - a) / scale / probes[k];
        let slopes = DVector::from_fn(n, |k, _| slope(k));
        if !(r.is_finite() && slopes.iter().all(|s| s.is_finite())) {
            continue;
        }
        let weight = (HUBER / r.abs().max(HUBER)).min(1.0);
        gradient += weight * r * &slopes;
        curvature += weight * &slopes * slopes.transpose();
    }
    for k in 0..n {
        curvature[(k, k)] = curvature[(k, k)] * (1.0 + RIDGE) + f64::MIN_POSITIVE;
    }
    let solved = curvature.cholesky().map(|c| c.solve(&gradient));
    solved.map_or_else(|| DVector::zeros(n), |x| -x)
}

/// Root mean square derivative of a reading with respect to its offset, below which windows do not
/// show the offset.
const TELLS: f64 = 0.05;

/// How much larger a size would have to be for some windows.
///
/// `here` are their misses at the size, `there` those at a size larger by `probe`. `None` if the
/// size has no influence on them.
#[must_use]
pub fn further(here: &Misses, there: &Misses, probe: f64) -> Option<f64> {
    let pairs = here.residual.iter().zip(&there.residual);
    let slopes = pairs
        .map(|(a, b)| ((b - a) / probe).powi(2))
        .filter(|s| s.is_finite());
    let (sum, n) = slopes.fold((0.0, 0.0), |(sum, n), s| (sum + s, n + 1.0));
    (sum > TELLS * TELLS * n).then(|| step(here, std::slice::from_ref(there), &[probe])[0])
}

/// Returns the size with the smallest loss, and its misses. The windows keep the matching
/// parameters.
///
/// # Errors
/// When the engine fails.
pub fn fit(
    windows: &mut Windows<'_>,
    view: &dyn Fn(f64) -> View,
    with: Fit,
) -> Result<(f64, Misses)> {
    let ranges: Vec<[f64; 2]> = if with.parameters {
        windows.ranges()
    } else {
        Vec::new()
    };
    let spans = || ranges.iter().map(|r| r[1] - r[0]);
    let probes: Vec<f64> = std::iter::once(with.probe)
        .chain(spans().map(|s| PARAMETER.0 * s))
        .collect();
    let longest: Vec<f64> = std::iter::once(with.longest)
        .chain(spans().map(|s| PARAMETER.1 * s))
        .collect();
    let mut at = vec![with.start];
    at.extend(windows.theta().iter().take(ranges.len()));
    let mut evaluate = |at: &[f64]| -> Result<Misses> {
        if with.parameters {
            windows.set_theta(&at[1..]);
        }
        windows.misses(&view(at[0]))
    };
    let mut misses = evaluate(&at)?;
    let mut best = loss(&misses);
    for _ in 0..STEPS {
        let mut there = Vec::with_capacity(at.len());
        let mut signed = probes.clone();
        for k in 0..at.len() {
            // The step goes the other way at the upper end of the range.
            if k > 0 && at[k] + probes[k] > ranges[k - 1][1] {
                signed[k] = -probes[k];
            }
            let mut beside = at.clone();
            beside[k] += signed[k];
            there.push(evaluate(&beside)?);
        }
        let mut by = step(&misses, &there, &signed);
        let share = (by.iter().zip(&longest))
            .map(|(b, l)| (l / b.abs().max(f64::MIN_POSITIVE)).min(1.0))
            .fold(1.0, f64::min);
        by *= share;
        let mut moved = false;
        for _ in 0..HALVINGS {
            let mut next: Vec<f64> = at.iter().zip(by.iter()).map(|(a, b)| a + b).collect();
            for (x, range) in next[1..].iter_mut().zip(&ranges) {
                *x = x.clamp(range[0], range[1]);
            }
            let found = evaluate(&next)?;
            let value = loss(&found);
            if value < best {
                (at, misses, best, moved) = (next, found, value, true);
                break;
            }
            by *= 0.5;
        }
        if !moved || by.iter().zip(&probes).all(|(b, p)| b.abs() < 0.01 * p) {
            break;
        }
    }
    if with.parameters {
        windows.set_theta(&at[1..]);
    }
    Ok((at[0], misses))
}
