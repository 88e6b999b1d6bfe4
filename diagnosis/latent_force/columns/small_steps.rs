//! Steps of derivatives along whole replays, reduced until the changes that they cause are small
//! beside the motion.
//!
//! A fixed fraction of a catalogue's range does not suit every machine. 30 N s/m stop a cart of
//! 1 kg at once, and the change of its log is then no derivative. The size of the change of the
//! readings shows this.

use asid_core::Result;

use crate::latent_force::context::Context;

use super::in_part::along;
use super::sizes::spreads;
use super::source::{Along, Source, Wanted};

/// Largest change of a sensor's readings by a step, relative to their spread (root mean square over
/// the replays).
///
/// A secant of that length is right to about a tenth where the motion bends over its own size.
const MOST: f64 = 0.1;
/// The same in standard deviations of their noise, below which no change is visible.
const LEAST: f64 = 3.0;
/// Smallest factor of a step per round: a saturated change does not show by how much the step is
/// too large.
const SMALLER: f64 = 0.1;
/// Most rounds of reducing a step: a catalogue's range may be a thousand times too wide for a
/// machine.
const TIMES: usize = 3;

/// Returns the change of readings by each of `m` steps, in units of the largest that is allowed,
/// for the entry that changes most.
fn changes(context: &Context<'_>, found: &[Along], wanted: &[Wanted], walks: &[usize]) -> Vec<f64> {
    let (m, entries) = (wanted.len(), &context.logs.entries);
    let noise = context.reading_variance.iter().map(|v| v.sqrt());
    let most = spreads(context).into_iter().zip(noise);
    let most: Vec<f64> = most.map(|(s, n)| (MOST * s).max(LEAST * n)).collect();
    let mut squares = vec![0.0; entries.len() * m];
    let mut rows = 0.0_f64;
    for &w in walks {
        for row in found[w].1.chunks_exact(entries.len() * m) {
            squares.iter_mut().zip(row).for_each(|(s, x)| *s += x * x);
            rows += 1.0;
        }
    }
    let change = |i: usize| {
        let of_entry = |e: usize| (squares[e * m + i] / rows.max(1.0)).sqrt() / most[e];
        let largest = (0..entries.len()).map(of_entry).fold(0.0, f64::max);
        largest * wanted[i].scale.abs()
    };
    (0..m).map(change).collect()
}

/// Recomputes the columns `found` along some walks over smaller steps, for the derivatives whose
/// steps change the motion.
///
/// `begins` holds the values at which each derivative begins, `None` for a secant. Returns whether
/// there was time.
pub(super) fn take_smaller_steps(
    source: &Source<'_>,
    (context, states): (&Context<'_>, &[Vec<f64>]),
    (wanted, begins): (&mut [Wanted], &[Option<&[f64]>]),
    (found, walks): (&mut [Along], &[usize]),
) -> Result<bool> {
    let m = wanted.len();
    if m == 0 {
        return Ok(true);
    }
    for _ in 0..TIMES {
        let changes = changes(context, found, wanted, walks);
        let mut due = Vec::new();
        for (i, begin) in begins.iter().enumerate() {
            let Some(begin) = begin.filter(|_| changes[i] > 1.0) else {
                continue;
            };
            let factor = (1.0 / changes[i]).max(SMALLER);
            let own = &mut wanted[i];
            own.scale *= factor;
            for (value, begin) in own.values.iter_mut().zip(begin) {
                *value = begin + factor * (*value - begin);
            }
            due.push(i);
        }
        if due.is_empty() {
            break;
        }
        let again: Vec<Wanted> = due.iter().map(|&i| wanted[i].clone()).collect();
        let (smaller, complete) = along(source, (context, states), &again, walks)?;
        for &w in walks {
            let pairs = [
                (&mut found[w].0, &smaller[w].0),
                (&mut found[w].1, &smaller[w].1),
            ];
            for (to, from) in pairs {
                let rows = to.chunks_exact_mut(m).zip(from.chunks_exact(due.len()));
                for (to, from) in rows {
                    due.iter().zip(from).for_each(|(&i, x)| to[i] = *x);
                }
            }
        }
        if !complete {
            return Ok(false);
        }
    }
    Ok(true)
}
