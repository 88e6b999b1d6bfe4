//! Columns along segments: of all candidates along a part of them, and of the leading ones along
//! the others.
//!
//! Along a segment a column is a replay of its own, which it shares with no other column. A machine
//! with contacts has hundreds of candidates. A candidate that leads on all segments also leads on a
//! third of them, if these are spread over the logs and contain motion. A log in which a puck is
//! never reached carries no information about the floor under it.

use asid_core::Result;

use crate::data::Logs;
use crate::latent_force::context::Context;
use crate::latent_force::walk::Walk;

use super::Columns;
use super::source::{Along, Source, Wanted};

/// One segment of each group of this many is replayed for all candidates.
const EVERY: usize = 3;
/// Fewest segments of that part: a single one does not represent the others.
const FEWEST: usize = 2;

/// Returns the walks along which all candidates are computed, and the others.
pub(super) fn parts(context: &Context<'_>) -> [Vec<usize>; 2] {
    let n = context.walks.len();
    if !context.has_segments() || n < EVERY * FEWEST {
        return [(0..n).collect(), Vec::new()];
    }
    let walks = context.walks.iter();
    let motion: Vec<f64> = walks.map(|w| motion(context.logs, w)).collect();
    let first = most_of_each(&motion);
    let others = (0..n).filter(|w| !first.contains(w));
    [first.clone(), others.collect()]
}

/// Returns a measure of the motion along a walk: the sum, over all entries of a reading, of the
/// logarithm of their variance in units of the noise.
///
/// The logarithm lets an object that moves a little count beside one that moves much. Sensors have
/// rates of their own, so each reading is compared with the first one of its channel.
fn motion(logs: &Logs, walk: &Walk) -> f64 {
    let width = logs.width();
    let readings = &logs.episodes[walk.episode].readings;
    let row = |k: usize| &readings[k * width..(k + 1) * width];
    let rows = &walk.rows[walk.segment.unwrap_or(0)..];
    let mut first = vec![f64::NAN; width];
    for &k in rows {
        let missing = first.iter_mut().zip(row(k)).filter(|(f, _)| f.is_nan());
        missing.for_each(|(first, x)| *first = *x);
    }
    let noise = logs.entry_noise();
    let mut differ = vec![0.0; noise.len()];
    // Rows, sum and sum of squares of each entry.
    let mut sums = vec![[0.0_f64; 3]; noise.len()];
    for &k in rows {
        logs.reading_difference(row(k), &first, &mut differ);
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

/// Returns the index of the largest value of each group of [`EVERY`] consecutive ones; the middle
/// one if none is larger.
///
/// A shorter last group counts only if it contains its middle index.
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

/// Selects the items of some walks, where they have one.
fn some<T: Clone>(all: &[T], which: &[usize]) -> Vec<T> {
    which.iter().filter_map(|&w| all.get(w).cloned()).collect()
}

/// Returns columns along some of the walks, zero along the others, and whether there was time for
/// all.
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
        assigned: &some(source.assigned, which),
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

/// What the columns along the other walks are computed with.
pub(super) struct Rest<'r> {
    pub(super) source: &'r Source<'r>,
    pub(super) wanted: &'r [Wanted],
    /// Factor of each column, as its prior's standard deviation is now known.
    pub(super) factors: &'r [f64],
    /// The walks.
    pub(super) which: &'r [usize],
}

impl Columns {
    /// Adds the columns of the leading candidates (one flag per candidate) along the other walks.
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
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};
    use asid_mjcf::Plant;

    use super::*;

    /// Motion along ten rows in which a cart moves by `step`, m, per row; its camera, with a noise
    /// of 1 m, sees it in some of them.
    fn motion_seen_in(step: f64, is_seen: impl Fn(usize) -> bool) -> f64 {
        let scene = r#"<mujoco><worldbody><body name="cart">
            <joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <sensor><framepos name="camera" objtype="xbody" objname="cart"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("slide", scene, &[]).unwrap()).unwrap();
        let reading = |k: usize| {
            let place = [step * k as f64, 0.0, 0.0];
            if is_seen(k) { place } else { [f64::NAN; 3] }
        };
        let episode = Episode {
            time: (0..10).map(|k| 0.01 * f64::from(k)).collect(),
            channels: vec![ChannelColumns {
                name: "camera".into(),
                len: 3,
            }],
            readings: (0..10).flat_map(reading).collect(),
            ..Episode::default()
        };
        let named = vec![("log".into(), episode)];
        let logs = Logs::new(&plant, &["camera".to_owned()], named).unwrap();
        motion(&logs, &Walk::new(&logs, 0, plant.layout.timestep))
    }

    /// Symptom: laws of a puck were screened where it lay still. Cause: a segment in whose first
    /// row the camera had no reading counted as one without motion.
    #[test]
    fn a_motion_is_seen_whichever_row_is_read_first() {
        // Variance of ten evenly spaced places.
        let all = (30.0_f64.powi(2) * 8.25).ln_1p();
        assert!((motion_seen_in(30.0, |_| true) - all).abs() < 1e-9);
        let some = motion_seen_in(30.0, |k| k % 3 == 1);
        assert!((some - all).abs() < 1.0, "{some} instead of {all}");
        assert_eq!(motion_seen_in(0.0, |k| k % 3 == 1), 0.0);
        assert_eq!(motion_seen_in(30.0, |_| false), 0.0);
    }

    #[test]
    fn of_each_three_it_is_that_along_which_most_moves() {
        assert_eq!(most_of_each(&[3.0, 1.0, 2.0, 1.0, 1.0, 5.0]), [0, 5]);
        assert_eq!(most_of_each(&[1.0; 8]), [1, 4, 7]);
        assert_eq!(most_of_each(&[1.0, 1.0, 1.0, 9.0]), [1]);
    }
}
