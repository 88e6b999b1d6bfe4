//! Shifts late readings and commands to the times that they belong to.

use asid_core::Episode;
use asid_core::layout::Layout;

/// Most rows over which a late reading is interpolated: over more the motion is not linear.
const SPAN: usize = 2;
/// Share of a row time within which a reading belongs to a row as it is, since stamps are rounded.
const ON_ROW: f64 = 1e-3;

/// Shifts readings that are `delay` (s) older than their stamps.
///
/// Between rows they are interpolated linearly; beyond the last row they are missing. `delays` has
/// one entry for each column of readings.
pub(super) fn readings(episode: &mut Episode, layout: &Layout, delays: &[f64]) {
    let width = episode.width();
    let before = episode.readings.clone();
    let mut first = 0;
    for channel in &episode.channels {
        let columns = first..first + channel.len;
        first = columns.end;
        let rotation = layout.sensor(&channel.name).is_ok_and(|s| s.len == 4);
        let delay = delays[columns.start];
        if delays[columns.clone()].iter().all(|d| *d == 0.0) {
            continue;
        }
        // The entries of an orientation have one delay.
        let whole = |c: usize| if rotation { delay } else { delays[c] };
        for c in columns.clone() {
            let present = |k: usize| {
                let row = &before[k * width + columns.start..k * width + columns.end];
                if rotation {
                    row.iter().all(|x| x.is_finite())
                } else {
                    before[k * width + c].is_finite()
                }
            };
            for k in 0..episode.time.len() {
                let at = episode.time[k] + whole(c);
                episode.readings[k * width + c] = match between(&episode.time, at, &present) {
                    None => f64::NAN,
                    Some((a, b, along)) => {
                        let (x, mut y) = (before[a * width + c], before[b * width + c]);
                        if rotation {
                            let dot: f64 = columns
                                .clone()
                                .map(|i| before[a * width + i] * before[b * width + i])
                                .sum();
                            y *= dot.signum();
                        }
                        x + along * (y - x)
                    }
                };
            }
        }
    }
}

/// The rows before and after a time, and its relative position between them.
///
/// `None` where readings are missing or far apart.
fn between(time: &[f64], at: f64, present: &dyn Fn(usize) -> bool) -> Option<(usize, usize, f64)> {
    let after = time.partition_point(|t| *t < at);
    let near = |k: usize| {
        let usual = (time[time.len() - 1] - time[0]) / (time.len() - 1).max(1) as f64;
        (time[k] - at).abs() < ON_ROW * usual
    };
    for k in [after.wrapping_sub(1), after] {
        if k < time.len() && near(k) {
            return present(k).then_some((k, k, 0.0));
        }
    }
    if after == 0 || after == time.len() {
        return None;
    }
    let a = (after.saturating_sub(SPAN)..after)
        .rev()
        .find(|&k| present(k))?;
    let b = (after..time.len().min(a + SPAN + 1)).find(|&k| present(k))?;
    Some((a, b, (at - time[a]) / (time[b] - time[a])))
}

/// Delays commands: the command of a row is the mean of what arrives during it.
///
/// `delays` has one entry for each actuator.
pub(super) fn commands(episode: &mut Episode, delays: &[f64]) {
    let (nu, rows) = (delays.len(), episode.time.len());
    let before = episode.ctrl.clone();
    for (a, &delay) in delays.iter().enumerate().filter(|(_, d)| **d != 0.0) {
        // Integral of the held command from the first row on.
        let mut sums = vec![0.0; rows];
        for k in 1..rows {
            let dt = episode.time[k] - episode.time[k - 1];
            sums[k] = sums[k - 1] + before[(k - 1) * nu + a] * dt;
        }
        let integral = |t: f64| -> f64 {
            let k = episode.time.partition_point(|x| *x <= t);
            match k {
                // Before the first row the command is the same as in it.
                0 => before[a] * (t - episode.time[0]),
                _ => sums[k - 1] + before[(k - 1) * nu + a] * (t - episode.time[k - 1]),
            }
        };
        for k in 0..rows {
            // The last row's command is held as long as the row before.
            let from = episode.time[k];
            let to = match episode.time.get(k + 1) {
                Some(next) => *next,
                None => 2.0 * from - episode.time[k - 1],
            };
            let mean = (integral(to - delay) - integral(from - delay)) / (to - from);
            episode.ctrl[k * nu + a] = mean;
        }
    }
}
