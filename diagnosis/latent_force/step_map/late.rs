//! Late sensors: their readings are assigned to the rows that they measure.

use crate::noise::median;

use super::LinearEpisode;

/// Share of a coordinate's response below which it is none: differences of readings are right to
/// about a millionth.
const FLAT: f64 = 1e-4;

/// Returns the delay of an entry's reading in row `k`, s.
///
/// A reading that is late by `l` follows a position with derivative `p` and a speed with derivative
/// `s`, so `h` has `p` and `s - l p`. Its response to a ramp of the speeds, `ramp`, is
/// `s (time - l)`. The delay is the least that solves both. A reading of a position alone (`s = 0`)
/// leaves only `l = -h / p`, and one of a speed alone `l = time - ramp / s`.
fn lag(h: &[f64], ramp: &[f64], time: f64) -> f64 {
    let (place, speed) = h.split_at(h.len() / 2);
    // The coordinate that shows most.
    let size = |i: &usize| place[*i].abs() * time + speed[*i].abs();
    let Some(most) = (0..place.len()).max_by(|a, b| size(a).total_cmp(&size(b))) else {
        return 0.0;
    };
    let (p, h, r) = (place[most], speed[most], ramp[most]);
    let roots = if p.abs() * time < FLAT * h.abs() {
        [time - r / h, f64::NAN]
    } else if r.abs() < FLAT * p.abs() * time * time {
        [-h / p, f64::NAN]
    } else {
        // p l^2 + (h - p time) l + (r - h time) = 0
        let (b, c) = (h / p - time, (r - h * time) / p);
        let half = (b * b / 4.0 - c).max(0.0).sqrt();
        [-b / 2.0 - half, -b / 2.0 + half]
    };
    // Differences of readings are right to about a millionth.
    let lags = roots.into_iter().filter(|l| *l > -FLAT * time && *l < time);
    lags.fold(f64::INFINITY, f64::min).clamp(0.0, time)
}

/// Assigns late readings to the rows that they measure, so that their derivatives refer to the
/// state there.
///
/// A derivative through a long delay is right for slow motion only, and a smoother that iterates on
/// it diverges.
pub(super) fn retime(
    episode: &mut LinearEpisode,
    time: &[f64],
    (ramps, is_late): (&[f64], &[bool]),
    (nx, m): (usize, usize),
) {
    let (rows, ns) = (episode.rows, is_late.len());
    let nv = nx / 2;
    let mut seconds: Vec<f64> = time.windows(2).map(|t| t[1] - t[0]).collect();
    let row = median(&mut seconds).unwrap_or(f64::INFINITY);
    episode.early = vec![0.0; ns];
    episode.assigned = (0..rows * ns).map(|at| Some(at / ns)).collect();
    for s in (0..ns).filter(|&s| is_late[s]) {
        let mut lags: Vec<f64> = (1..rows)
            .map(|k| {
                let h = &episode.h[(k * ns + s) * nx..(k * ns + s + 1) * nx];
                let ramp = &ramps[(k * ns + s) * nv..(k * ns + s + 1) * nv];
                lag(h, ramp, time[k])
            })
            .collect();
        let late = median(&mut lags).unwrap_or(0.0);
        if late >= 0.5 * row {
            assign(episode, s, (time, late), (ns, nx));
        }
    }
    retime_columns(&mut episode.reading_columns, &episode.assigned, ns, m);
}

/// Assigns the readings of an entry that are `late`, s, to the rows that they measure.
///
/// Where rows are uneven, two readings may measure the same row. The later one takes it, and the
/// other counts as one before the first row does.
fn assign(
    episode: &mut LinearEpisode,
    s: usize,
    (time, late): (&[f64], f64),
    (ns, nx): (usize, usize),
) {
    let nv = nx / 2;
    let mut taken = vec![false; episode.rows];
    // Forwards: a row is overwritten only after it has been moved.
    for (k, to) in told(time, late).into_iter().enumerate() {
        let from = k * ns + s;
        let is_read = episode.residual[from].is_finite();
        // A row without a reading displaces none.
        episode.assigned[from] = to.filter(|_| is_read);
        if !is_read {
            continue;
        }
        let Some(to) = to else {
            episode.early[s] += 1.0;
            continue;
        };
        if taken[to] {
            episode.early[s] += 1.0;
        }
        let shift = time[k] - time[to];
        let at = to * ns + s;
        episode.residual[at] = episode.residual[from];
        for i in 0..nx {
            episode.h[at * nx + i] = episode.h[from * nx + i];
        }
        for i in 0..nv {
            let place = episode.h[at * nx + i];
            episode.h[at * nx + nv + i] += shift * place;
        }
        taken[to] = true;
    }
    for k in (0..episode.rows).filter(|&k| !taken[k]) {
        episode.residual[k * ns + s] = f64::NAN;
    }
}

/// For each row: the row that a reading taken then measures if it is `late` (s); `None` before the
/// first row.
fn told(time: &[f64], late: f64) -> Vec<Option<usize>> {
    let mut to = 0;
    time.iter()
        .map(|t| {
            let told = t - late;
            if told < time[0] {
                return None;
            }
            while to + 1 < time.len() && (time[to + 1] - told).abs() <= (time[to] - told).abs() {
                to += 1;
            }
            Some(to)
        })
        .collect()
}

/// Assigns columns of late readings (`rows x ns x m`) to the rows that they measure, as
/// [`LinearEpisode::assigned`] says.
pub fn retime_columns(columns: &mut [f64], assigned: &[Option<usize>], ns: usize, m: usize) {
    for (from, to) in assigned.iter().enumerate() {
        let at = to.map_or(from, |to| to * ns + from % ns);
        if at != from {
            columns.copy_within(from * m..(from + 1) * m, at * m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latent_force::smoother::{NoiseModel, Problem, Start, log_likelihood};
    use crate::latent_force::walk::Walk;

    /// Rows of a log, time between them and delay of its sensor, s.
    const ROWS: usize = 60;
    const ROW: f64 = 0.01;
    const LATE: f64 = 0.015;
    /// Standard deviation of a reading, m, and variance of the missing force, N².
    const NOISE: f64 = 1e-3;
    const FORCE: f64 = 0.1;

    /// Times of rows at 100 Hz: even, off by up to 30 %, with a gap of 0.2 s, and with a first row
    /// that is half a second early.
    fn all_times() -> [Vec<f64>; 4] {
        let off = |k: usize| match k {
            0 => 0.0,
            k => 0.3 * ROW * (7.0 * k as f64).sin(),
        };
        let times = |f: &dyn Fn(usize) -> f64| (0..ROWS).map(|k| ROW * k as f64 + f(k)).collect();
        [
            times(&|_| 0.0),
            times(&off),
            times(&|k| if k < 20 { 0.0 } else { 0.2 }),
            times(&|k| if k < 1 { 0.0 } else { 0.5 }),
        ]
    }

    /// A slide of 1 kg with a position sensor that is late, before its readings are assigned; in a
    /// unit of which a metre has `unit`. Every `missing`th reading is missing.
    fn slide(time: &[f64], unit: f64, missing: usize) -> LinearEpisode {
        let residual = |k: usize| match (k + 1) % missing {
            0 => f64::NAN,
            _ => 1e-3 * unit * (0.9 * k as f64).cos(),
        };
        let a = |t: &[f64]| [1.0, t[1] - t[0], 0.0, 1.0];
        LinearEpisode {
            rows: ROWS,
            defect: vec![0.0; 2 * (ROWS - 1)],
            a: time.windows(2).flat_map(a).collect(),
            residual: (0..ROWS).map(residual).collect(),
            h: [unit, -LATE * unit].repeat(ROWS),
            reading_columns: (0..ROWS).map(residual).collect(),
            ..LinearEpisode::default()
        }
    }

    fn retimed(time: &[f64], unit: f64, missing: usize) -> LinearEpisode {
        let mut episode = slide(time, unit, missing);
        retime(&mut episode, time, (&[0.0; ROWS], &[true]), (2, 1));
        episode
    }

    fn readings(episode: &LinearEpisode) -> f64 {
        let read = episode.residual.iter().filter(|x| x.is_finite());
        read.count() as f64
    }

    /// Symptom: a model with the true delay lost to models without one. Cause: where rows are
    /// uneven, one reading overwrote another, or a missing one did, and its evidence was gone.
    #[test]
    fn no_reading_is_lost_where_rows_are_uneven() {
        for time in all_times() {
            for missing in [usize::MAX, 3] {
                let before = readings(&slide(&time, 1.0, missing));
                let found = retimed(&time, 1.0, missing);
                assert_eq!(readings(&found) + found.early[0], before, "{time:?}");
                assert!(found.early[0] > 0.0, "late by more than half a row");
                // Columns stay with their readings.
                let pairs = found.residual.iter().zip(&found.reading_columns);
                assert!(pairs.filter(|(x, _)| x.is_finite()).all(|(x, y)| x == y));
            }
        }
    }

    /// Symptom: after a delay of one sensor was found, the readings of others were moved by half a
    /// second, and nothing else was found.
    ///
    /// Cause: a sensor that reads the speed of a body was taken for one of its place, since its
    /// readings depend on the place too.
    #[test]
    fn the_delay_of_a_speed_is_told_where_it_depends_on_the_place() {
        for late in [0.0, 0.04, 0.2] {
            for (time, p, s) in [
                (0.5, -3.0, 0.4),
                (1.7, 0.2, 0.4),
                (1.0, 0.0, 2.0),
                (1.0, 2.0, 0.0),
            ] {
                let found = lag(&[p, s - late * p], &[s * (time - late)], time);
                assert!((found - late).abs() < 1e-6, "{late} {p} {s}: {found}");
            }
        }
    }

    /// In a unit a thousandth as long, each reading is a thousandth as likely, counted or not.
    #[test]
    fn the_evidence_of_a_delay_does_not_depend_on_the_unit_of_its_sensor() {
        for time in all_times() {
            let walk = Walk {
                episode: 0,
                rows: (0..ROWS).collect(),
                substeps: vec![1; ROWS - 1],
                ctrl: Vec::new(),
                at_steps: Vec::new(),
                segment: None,
                time: time.clone(),
            };
            let b: Vec<f64> = time.windows(2).flat_map(|t| [0.0, t[1] - t[0]]).collect();
            let start = Start {
                mean: vec![0.0; 2],
                variance: vec![1.0; 2],
                unknown: vec![1.0; 2],
            };
            let likelihood = |unit: f64| {
                let noise = NoiseModel {
                    q: vec![FORCE],
                    tau: vec![0.1],
                    white: vec![FORCE],
                    r: vec![(NOISE * unit).powi(2)],
                };
                let linear = retimed(&time, unit, 3);
                let problem = Problem {
                    walk: &walk,
                    linear: &linear,
                    b: &b,
                    start: &start,
                    free: &[],
                    scatter: &[],
                };
                log_likelihood(problem, &noise)
            };
            let fewer = likelihood(1.0) - likelihood(1000.0);
            let want = readings(&slide(&time, 1.0, 3)) * 1000.0_f64.ln();
            assert!((fewer - want).abs() < 1e-6 * want, "{fewer}, not {want}");
        }
    }
}
