//! Columns along segments: of all candidates along a part of the segments, and of those that lead there along the others.
//!
//! Of a segment a column is a replay of its own, which no other column shares, and a machine with contacts has hundreds of
//! candidates. What leads on all segments leads on a third of them too, for they are spread evenly over the logs.

use asid_core::Result;

use crate::latent_force::context::Context;
use crate::latent_force::walk::Walk;

use super::Columns;
use super::source::{Along, Source, Wanted};

/// Of so many segments one is replayed for all candidates.
const EVERY: usize = 3;
/// Fewest segments of that part: one does not stand for the others.
const FEWEST: usize = 2;

/// The walks along which all candidates are taken, and the others.
pub(super) fn parts(context: &Context<'_>) -> [Vec<usize>; 2] {
    let n = context.walks.len();
    let whole = !context.has_segments() || n < EVERY * FEWEST;
    let is_first = |w: &usize| whole || w % EVERY == EVERY / 2;
    let (first, others) = (0..n).partition(is_first);
    [first, others]
}

/// What some of the walks have, where any has it.
fn some<T: Clone>(all: &[T], which: &[usize]) -> Vec<T> {
    which.iter().filter_map(|&w| all.get(w).cloned()).collect()
}

/// Columns along some of the walks, zero along the others; and whether there was time for all of them.
pub(super) fn along(
    source: &Source<'_>,
    (context, states): (&Context<'_>, &[Vec<f64>]),
    wanted: &[Wanted],
    which: &[usize],
) -> Result<(Vec<Along>, bool)> {
    if which.len() == context.walks.len() {
        return source.columns(context, states, wanted);
    }
    let part = context.of_walks(which);
    let own = Source {
        carried: &some(source.carried, which),
        slopes: &some(source.slopes, which),
        late: &some(source.late, which),
        ..*source
    };
    let (found, complete) = own.columns(&part, &some(states, which), wanted)?;
    let (nx, ns) = (2 * context.plant().layout.nv, context.logs.entries.len());
    let m = wanted.len();
    let nothing = |w: &Walk| {
        let n = w.len();
        (vec![0.0; (n - 1) * nx * m], vec![0.0; n * ns * m])
    };
    let mut out: Vec<Along> = context.walks.iter().map(nothing).collect();
    for (&w, found) in which.iter().zip(found) {
        out[w] = found;
    }
    Ok((out, complete))
}

/// What the columns of candidates along the other walks are taken with.
pub(super) struct Rest<'r> {
    pub(super) source: &'r Source<'r>,
    pub(super) wanted: &'r [Wanted],
    /// What each column is multiplied by: its prior's deviation is known by now.
    pub(super) factors: &'r [f64],
    /// The walks.
    pub(super) which: &'r [usize],
}

impl Columns {
    /// Adds the columns of candidates that lead (one flag a candidate) along the rest of the walks.
    pub(super) fn add_rest(
        &mut self,
        (context, states): (&Context<'_>, &[Vec<f64>]),
        rest: &Rest<'_>,
        leads: &[bool],
    ) -> Result<()> {
        let places: Vec<usize> = (0..rest.wanted.len())
            .filter(|&i| leads[rest.wanted[i].candidate])
            .collect();
        let wanted: Vec<Wanted> = places.iter().map(|&i| rest.wanted[i].clone()).collect();
        let (found, complete) = along(rest.source, (context, states), &wanted, rest.which)?;
        self.complete &= complete;
        let width = self.center.len();
        for &w in rest.which {
            let linear = &mut self.linear[w];
            let to = [&mut linear.state_columns, &mut linear.reading_columns];
            for (to, from) in to.into_iter().zip([&found[w].0, &found[w].1]) {
                let rows = to
                    .chunks_exact_mut(width)
                    .zip(from.chunks_exact(wanted.len().max(1)));
                for (to, from) in rows {
                    for (&i, x) in places.iter().zip(from) {
                        to[self.base + i] = x * rest.factors[i];
                    }
                }
            }
        }
        Ok(())
    }
}
