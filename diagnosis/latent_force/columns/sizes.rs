//! Widths of priors: an effect may make up for forces as large as the missing ones, and for errors
//! of readings up to a part of their spread.

use asid_core::Result;
use nalgebra::DMatrix;

use super::force_response::ForceSlopes;
use super::source::{Along, Source, Wanted};
use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;
use crate::latent_force::step_error::StepError;
use crate::latent_force::step_map::LinearEpisode;

/// Step that first measures what a parameter does, relative to its range.
const TRIAL: f64 = 1e-5;
/// Multiple of the segments' residuals that one standard deviation of a prior causes at fixed
/// initial states.
///
/// At fixed initial states, an acceleration changes the readings 5 times as much as once the
/// initial states are fitted to it. And only a few segments may show an effect.
const REPLAY_MULTIPLE: f64 = 10.0;
/// Step of derivatives along replays, relative to a parameter's range: over a smaller step, contact
/// points that appear and vanish hide the derivative.
pub(super) const REPLAY_TRIAL: f64 = 0.03;
/// Inertial force of a degree of freedom that does not move, N or N m.
const SILENT: f64 = 1e-8;
/// Smallest missing force for the widths of priors, relative to the inertial forces.
const LEAST_MISSING: f64 = 0.1;
/// Quantile of the missing force that counts as its size.
const QUANTILE: f64 = 0.99;
/// That quantile of a normal variable's magnitude, in standard deviations.
const QUANTILE_OF_NORMAL: f64 = 2.6;
/// Change of a speed from row to row that counts as none, m/s or rad/s.
const STILL: f64 = 1e-9;
/// Error of a reading that an effect may make up for, relative to the reading's spread.
const READING_SHARE: f64 = 0.1;
/// Rows of each short part along which the steps are measured.
const PART: usize = 6;
/// Number of these parts, spread over all walks.
const PARTS: usize = 24;

/// Some short parts of the logs, evenly spread.
struct Parts<'c> {
    context: Context<'c>,
    /// The trajectory in each part, its derivatives with respect to forces, and
    /// [`LinearEpisode::carried`].
    states: Vec<Vec<f64>>,
    slopes: Vec<ForceSlopes>,
    carried: Vec<Vec<f64>>,
}

/// Returns short parts of the logs, with the trajectory there.
fn parts<'c>(
    context: &'c Context<'_>,
    estimate: &Estimate,
    (slopes_of, carried_of): (&[ForceSlopes], &[Vec<f64>]),
) -> Parts<'c> {
    let layout = &context.plant().layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let rows: usize = context.walks.iter().map(|w| w.len()).sum();
    let every = (rows / PARTS).max(PART);
    let (mut walks, mut states) = (Vec::new(), Vec::new());
    let (mut slopes, mut carried) = (Vec::new(), Vec::new());
    for (w, walk) in context.walks.iter().enumerate() {
        let mut first = 0;
        while first + 2 <= walk.len() {
            let range = first..(first + PART).min(walk.len());
            states.push(estimate.trajectory[w][range.start * width..range.end * width].to_vec());
            slopes.push(slopes_of[w].part(range.start..range.end - 1, 2 * nv * nv));
            if let Some(carried_of) = carried_of.get(w) {
                let size = 4 * nv * nv;
                carried.push(carried_of[range.start * size..(range.end - 1) * size].to_vec());
            }
            walks.push(walk.part(range));
            first += every;
        }
    }
    let context = Context {
        machine: context.machine,
        logs: context.logs,
        given: vec![None; walks.len()],
        read: vec![Vec::new(); walks.len()],
        as_read: vec![Vec::new(); walks.len()],
        open: context.open.clone(),
        scale: context.scale.clone(),
        position_noise: context.position_noise.clone(),
        reading_variance: context.reading_variance.clone(),
        alike: context.alike.clone(),
        inertial: context.inertial.clone(),
        islands: context.islands.clone(),
        one_step: context.one_step,
        step_error: StepError::default(),
        walks,
    };
    Parts {
        context,
        states,
        slopes,
        carried,
    }
}

/// Returns priors' standard deviations from the effect of a trial step of each parameter, one per
/// `(candidate, start, parameter)`.
///
/// The step acts along the trajectory of the first estimate, and makes up for the missing force of
/// the second.
///
/// Zero where the step has no effect, and where work was stopped before it was measured. The flag
/// says whether all were measured.
pub(super) fn sizes(
    context: &Context<'_>,
    (estimate, lacking): (&Estimate, &Estimate),
    source: &Source<'_>,
    trials: &[(usize, Vec<f64>, usize)],
) -> Result<(Vec<f64>, bool)> {
    let nv = context.plant().layout.nv;
    let (nx, ns) = (2 * nv, context.logs.entries.len());
    let Parts {
        context: short,
        states,
        slopes,
        carried,
    } = parts(context, estimate, (source.slopes, source.carried));
    let candidates = source.candidates;
    let wanted: Vec<Wanted> = trials
        .iter()
        .map(|(c, begin, p)| {
            let [low, high] = candidates[*c].ranges[*p];
            Wanted::slope(candidates, *c, begin, *p, TRIAL * (high - low))
        })
        .collect();
    let m = wanted.len();
    let source = Source {
        candidates,
        replayed: source.replayed,
        models: source.models,
        carried: &carried,
        slopes: &slopes,
        assigned: &[],
        // A parameter without effect has no size, so nothing of another column may leak into its
        // column.
        together: false,
        progress: source.progress,
    };
    let (columns, complete) = source.columns(&short, &states, &wanted)?;
    // A joint that neither moves nor lacks a force shows no size.
    let missing: Vec<f64> = lacking
        .force_quantile(context, QUANTILE)
        .iter()
        .zip(&context.inertial)
        .map(|(w, inertial)| {
            if *inertial > SILENT {
                w.max(LEAST_MISSING * inertial)
            } else {
                f64::INFINITY
            }
        })
        .collect();
    let spread = spreads(context);
    let mut sums = vec![vec![0.0; nv]; m];
    let mut readings = vec![0.0; m];
    let (mut rows, mut count) = (0.0, 0.0);
    for ((walk, (states, read)), slopes) in short.walks.iter().zip(&columns).zip(&slopes) {
        for k in 0..walk.len() - 1 {
            let matrix = DMatrix::from_fn(nv, nv, |i, j| slopes.held[(k * nx + nv + i) * nv + j]);
            let change = DMatrix::from_fn(nv, m, |d, i| states[(k * nx + nv + d) * m + i]);
            if let Some(force) = matrix.lu().solve(&change) {
                for (i, sums) in sums.iter_mut().enumerate() {
                    for (sum, f) in sums.iter_mut().zip(force.column(i).iter()) {
                        *sum += f * f;
                    }
                }
            }
            rows += 1.0;
        }
        for k in 0..walk.len() {
            for (s, spread) in spread.iter().enumerate() {
                for (i, sum) in readings.iter_mut().enumerate() {
                    *sum += (read[(k * ns + s) * m + i] / spread).powi(2);
                }
            }
            count += 1.0;
        }
    }
    let sizes = (0..m)
        .map(|i| {
            let acting = sums[i]
                .iter()
                .zip(&missing)
                .filter(|(s, f)| **s > 0.0 && f.is_finite());
            let active = acting.count().max(1) as f64;
            let ratio: f64 = sums[i]
                .iter()
                .zip(&missing)
                .map(|(s, f)| s / rows / (f * f))
                .sum();
            let by_force = (active / ratio).sqrt();
            let by_reading = READING_SHARE * (count / readings[i]).sqrt();
            let (c, _, p) = &trials[i];
            let [low, high] = candidates[*c].limits(*p);
            let size = by_force.min(by_reading).min(0.5 * (high - low));
            let acts = ratio > 0.0 || readings[i] > 0.0;
            if acts && size.is_finite() { size } else { 0.0 }
        })
        .collect();
    Ok((sizes, complete))
}

/// Returns the spread of the readings of each entry.
pub(super) fn spreads(context: &Context<'_>) -> Vec<f64> {
    let logs = context.logs;
    let mut out = Vec::with_capacity(logs.entries.len());
    let width = logs.width();
    let mut at = 0;
    for sensor in &logs.sensors {
        let own = logs
            .entries
            .iter()
            .filter(|e| logs.sensors[e.sensor].name == sensor.name)
            .count();
        let len = if sensor.rotation { 4 } else { own };
        for c in 0..own {
            let values: Vec<f64> = logs
                .episodes
                .iter()
                .flat_map(|e| e.readings.iter().skip(at + c).step_by(width).copied())
                .filter(|x| x.is_finite())
                .collect();
            let n = values.len().max(1) as f64;
            let mean = values.iter().sum::<f64>() / n;
            let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
            out.push(if sensor.rotation {
                1.0
            } else {
                variance.sqrt().max(sensor.noise)
            });
        }
        at += len;
    }
    out
}

/// Returns priors' standard deviations where some walks are segments: the smaller of those from
/// replays and from rows of the other walks.
///
/// Trajectory, noise and missing changes of speed are those of the first estimate, and the residuals
/// of replays to make up for those of the second.
pub(super) fn sizes_along(
    (context, estimates): (&Context<'_>, (&Estimate, &Estimate)),
    linear: &[LinearEpisode],
    taken: (&[Along], &[usize]),
    m: usize,
) -> Vec<f64> {
    let by_rows = sizes_along_rows((context, estimates.0), linear, taken, m);
    let by_replay = sizes_by_replay(context, estimates, taken, m).into_iter();
    by_replay.zip(by_rows).map(|(a, b)| a.min(b)).collect()
}

/// Returns priors' standard deviations from the change of readings per unit of each parameter along
/// replays of the walks `which`.
///
/// The columns are `rows x ns x m`. The result is a few times the residuals, because the free
/// initial states take up most of a change.
fn sizes_by_replay(
    context: &Context<'_>,
    (estimate, lacking): (&Estimate, &Estimate),
    (columns, which): (&[Along], &[usize]),
    m: usize,
) -> Vec<f64> {
    let ns = context.logs.entries.len();
    let mut squares = vec![0.0; m];
    let mut n = 0.0;
    for &w in which {
        let (walk, (_, read)) = (&context.walks[w], &columns[w]);
        let lead = walk.segment.unwrap_or(0);
        for k in lead..walk.len() {
            for (s, r) in estimate.noise.r.iter().enumerate() {
                for (i, sum) in squares.iter_mut().enumerate() {
                    *sum += read[(k * ns + s) * m + i].powi(2) / r;
                }
                n += 1.0;
            }
        }
    }
    let left = 1.0 + lacking.missing(context).readings;
    let size = |s: f64| REPLAY_MULTIPLE * (left * n / s).sqrt();
    squares.into_iter().map(size).collect()
}

/// Returns priors' standard deviations from the change of speeds per row and per unit of each
/// parameter, along some walks.
///
/// Segments are left out. The reference is the missing change of speed there. Infinite where a
/// parameter has no effect.
fn sizes_along_rows(
    (context, estimate): (&Context<'_>, &Estimate),
    linear: &[LinearEpisode],
    (columns, which): (&[Along], &[usize]),
    m: usize,
) -> Vec<f64> {
    let layout = &context.plant().layout;
    let (nv, nx, width) = (layout.nv, 2 * layout.nv, layout.nq + layout.nv);
    let rows = |w: &&usize| context.walks[**w].segment.is_none();
    let (mut missing, mut moved) = (vec![0.0; nv], vec![0.0; nv]);
    let mut squares = vec![0.0; nv * m];
    for &w in which.iter().filter(rows) {
        let states = &estimate.trajectory[w];
        for k in 0..context.walks[w].len() - 1 {
            for d in 0..nv {
                let speed = |row: usize| states[row * width + layout.nq + d];
                missing[d] += linear[w].defect[k * nx + nv + d].powi(2);
                moved[d] += (speed(k + 1) - speed(k)).powi(2);
                let at = (k * nx + nv + d) * m;
                let row = columns[w].0[at..at + m].iter();
                let own = &mut squares[d * m..(d + 1) * m];
                own.iter_mut().zip(row).for_each(|(s, x)| *s += x * x);
            }
        }
    }
    let most = |(missing, moved): (&f64, &f64)| {
        let most = missing.max(LEAST_MISSING * LEAST_MISSING * moved);
        QUANTILE_OF_NORMAL * QUANTILE_OF_NORMAL * most
    };
    let most: Vec<f64> = missing.iter().zip(&moved).map(most).collect();
    let size = |i: usize| {
        let acting = (0..nv).filter(|d| squares[d * m + i] > 0.0 && most[*d] > STILL * STILL);
        let ratios: Vec<f64> = acting.map(|d| squares[d * m + i] / most[d]).collect();
        (ratios.len() as f64 / ratios.iter().sum::<f64>()).sqrt()
    };
    let sizes = (0..m).map(size);
    sizes
        .map(|s| if s > 0.0 { s } else { f64::INFINITY })
        .collect()
}
