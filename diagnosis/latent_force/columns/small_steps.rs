//! Steps that slopes along whole replays are taken over, made smaller until what they change is small beside the motion.
//!
//! A share of a catalogue's range fits no machine by itself: thirty N s/m stop a cart of one kilogram at once, and what that changes of its log is no
//! slope. How much the readings change says so.

use asid_core::Result;

use crate::latent_force::context::Context;

use super::in_part::along;
use super::sizes::spreads;
use super::source::{Along, Source, Wanted};

/// Most that a step may change the readings of a sensor by, root mean square over the replays, as a share of their spread: a chord that long is right
/// to about a tenth where the motion bends over its own size.
const MOST: f64 = 0.1;
/// The same in deviations of their noise, below which nothing is seen of it.
const LEAST: f64 = 3.0;
/// Smallest factor of a step at a time: a change that saturates says nothing of how far it is too large.
const SMALLER: f64 = 0.1;
/// Times that steps are made smaller, at most: a catalogue's range may be a thousand times too wide for a machine.
const TIMES: usize = 3;

/// What each of `m` steps changes of the readings of each entry, in units of the most that it may; of the entry that it changes most.
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

/// Takes the columns `found` along some walks anew over smaller steps, for those slopes whose steps change the motion; with the values that each
/// slope begins at, none of a secant. Says whether there was time.
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
