//! Columns along segments: of all candidates along a part of the segments, and of those that lead there along the others.
//!
//! Of a segment a column is a replay of its own, which no other column shares, and a machine with contacts has hundreds of
//! candidates. What leads on all segments leads on a third of them too, where they are spread over the logs and something moves along them: a log in
//! which a puck is never reached tells nothing of what it slides on.

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
    if !context.has_segments() || n < EVERY * FEWEST {
        return [(0..n).collect(), Vec::new()];
    }
    let motion: Vec<f64> = context.walks.iter().map(|w| motion(context, w)).collect();
    let first = most_of_each(&motion);
    let others = (0..n).filter(|w| !first.contains(w));
    [first.clone(), others.collect()]
}

/// How much moves along a walk: of all entries of its readings, the logarithm of their variance in units of the noise, so that a thing that moves a little
/// counts beside one that moves much.
fn motion(context: &Context<'_>, walk: &Walk) -> f64 {
    let logs = context.logs;
    let width = logs.width();
    let readings = &logs.episodes[walk.episode].readings;
    let row = |k: usize| &readings[k * width..(k + 1) * width];
    let rows = &walk.rows[walk.segment.unwrap_or(0)..];
    let noise = logs.entry_noise();
    let mut differ = vec![0.0; noise.len()];
    // Rows, sum and sum of squares of each entry.
    let mut sums = vec![[0.0_f64; 3]; noise.len()];
    for &k in rows {
        logs.reading_difference(row(k), row(rows[0]), &mut differ);
        for (sums, x) in sums.iter_mut().zip(&differ).filter(|(_, x)| x.is_finite()) {
            sums[0] += 1.0;
            sums[1] += x;
            sums[2] += x * x;
        }
    }
    let of_entry = |([n, sum, squares], noise): (&[f64; 3], &f64)| {
        let n = n.max(1.0);
        ((squares / n - (sum / n).powi(2)).max(0.0) / (noise * noise)).ln_1p()
    };
    sums.iter().zip(&noise).map(of_entry).sum()
}

/// Of each so many in a row the place of the largest, of the middle one where none is larger; of the last ones, if they are fewer, where they have a
/// middle.
fn most_of_each(values: &[f64]) -> Vec<usize> {
    let most = |first: usize| {
        let own = first..(first + EVERY).min(values.len());
        let middle = first + EVERY / 2;
        let larger = |most, w| if values[w] > values[most] { w } else { most };
        own.contains(&middle).then(|| own.fold(middle, larger))
    };
    let firsts = (0..values.len()).step_by(EVERY);
    firsts.filter_map(most).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_each_three_it_is_that_along_which_most_moves() {
        assert_eq!(most_of_each(&[3.0, 1.0, 2.0, 1.0, 1.0, 5.0]), [0, 5]);
        assert_eq!(most_of_each(&[1.0; 8]), [1, 4, 7]);
        assert_eq!(most_of_each(&[1.0, 1.0, 1.0, 9.0]), [1]);
    }
}
