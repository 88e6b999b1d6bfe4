//! Sizes of offsets and delays: Gauss-Newton on the residuals of the windows, with bounded weights.

use asid_core::Result;

use super::view::View;
use super::windows::{Misses, Windows};

/// Gauss-Newton steps. Misses are nearly linear in an offset over a window; a start several motions away takes some.
const STEPS: usize = 4;
/// Motions beyond which a residual counts no more than linearly (Huber's loss): some windows hold contacts.
const HUBER: f64 = 1.0;
/// Halvings of a step that does not help.
const HALVINGS: usize = 3;

/// Sum over residuals of Huber's loss, in motions.
fn loss(misses: &Misses) -> f64 {
    let width = misses.motion.len();
    let each = misses.residual.iter().enumerate().map(|(i, r)| {
        let x = r.abs() / misses.motion[i % width];
        match x {
            x if x.is_nan() => 0.0,
            x if x <= HUBER => 0.5 * x * x,
            x if x.is_finite() => HUBER * (x - 0.5 * HUBER),
            _ => 1e3,
        }
    });
    each.sum()
}

/// Step of Gauss and Newton from a slope by differences over `probe`.
fn step(here: &Misses, there: &Misses, probe: f64) -> f64 {
    let width = here.motion.len();
    let (mut gradient, mut curvature) = (0.0, 0.0);
    for (i, (a, b)) in here.residual.iter().zip(&there.residual).enumerate() {
        let scale = here.motion[i % width];
        let (r, slope) = (a / scale, (b - a) / scale / probe);
        if !(r.is_finite() && slope.is_finite()) {
            continue;
        }
        let weight = (HUBER / r.abs().max(HUBER)).min(1.0);
        gradient += weight * r * slope;
        curvature += weight * slope * slope;
    }
    if curvature > 0.0 { -gradient / curvature } else { 0.0 }
}

/// The size at which misses are least, from a start on; `probe` is the difference that slopes are taken over, and steps
/// are at most `longest`.
///
/// # Errors
/// When the engine fails.
pub fn fit(
    windows: &mut Windows<'_>,
    view: &dyn Fn(f64) -> View,
    start: f64,
    (probe, longest): (f64, f64),
) -> Result<(f64, Misses)> {
    let mut size = start;
    let mut misses = windows.misses(&view(size))?;
    let mut best = loss(&misses);
    for _ in 0..STEPS {
        let there = windows.misses(&view(size + probe))?;
        let mut by = step(&misses, &there, probe).clamp(-longest, longest);
        let mut moved = false;
        for _ in 0..HALVINGS {
            let next = windows.misses(&view(size + by))?;
            let found = loss(&next);
            if found < best {
                (size, misses, best, moved) = (size + by, next, found, true);
                break;
            }
            by *= 0.5;
        }
        if !moved || by.abs() < 0.01 * probe {
            break;
        }
    }
    Ok((size, misses))
}
