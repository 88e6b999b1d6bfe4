//! Late sensors: their readings are assigned to the rows that they measure.

use super::LinearEpisode;

/// Returns the delay of an entry's reading in row `k`, s.
///
/// It follows from the response to a ramp of a position, or of a speed if the entry reads no
/// position.
fn lag(h: &[f64], ramp: &[f64], time: f64) -> f64 {
    let (place, speed) = h.split_at(h.len() / 2);
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let lag = if square(place) > 0.0 {
        -product(place, speed) / square(place)
    } else if square(speed) > 0.0 {
        time - product(speed, ramp) / square(speed)
    } else {
        0.0
    };
    if lag.is_finite() { lag.max(0.0) } else { 0.0 }
}

/// Assigns late readings to the rows that they measure, so that their derivatives refer to the
/// state there.
///
/// A derivative through a long delay is right for slow motion only, and a smoother that iterates on
/// it diverges.
pub(super) fn retime(
    episode: &mut LinearEpisode,
    time: &[f64],
    ramps: &[f64],
    (ns, nx, m): (usize, usize, usize),
) {
    let rows = episode.rows;
    let nv = nx / 2;
    for s in 0..ns {
        let mut lags: Vec<f64> = (1..rows)
            .map(|k| {
                let h = &episode.h[(k * ns + s) * nx..(k * ns + s + 1) * nx];
                let ramp = &ramps[(k * ns + s) * nv..(k * ns + s + 1) * nv];
                lag(h, ramp, time[k])
            })
            .collect();
        let late = crate::noise::median(&mut lags).unwrap_or(0.0);
        let counts = rows > 1 && late >= 0.5 * (time[1] - time[0]);
        episode.late.push(if counts { late } else { 0.0 });
    }
    let late = episode.late.clone();
    episode.early = vec![0.0; ns];
    for (s, &late) in late.iter().enumerate().filter(|(_, l)| **l > 0.0) {
        let rows_told = told(time, late);
        let mut taken = vec![false; rows];
        // Forwards: a row is overwritten only after it has been moved.
        for (k, to) in rows_told.into_iter().enumerate() {
            let Some(to) = to else {
                if episode.residual[k * ns + s].is_finite() {
                    episode.early[s] += 1.0;
                }
                continue;
            };
            let shift = time[k] - time[to];
            episode.residual[to * ns + s] = episode.residual[k * ns + s];
            for i in 0..nx {
                episode.h[(to * ns + s) * nx + i] = episode.h[(k * ns + s) * nx + i];
            }
            for i in 0..nv {
                let place = episode.h[(to * ns + s) * nx + i];
                episode.h[(to * ns + s) * nx + nv + i] += shift * place;
            }
            taken[to] = true;
        }
        for k in (0..rows).filter(|&k| !taken[k]) {
            episode.residual[k * ns + s] = f64::NAN;
        }
    }
    retime_columns(&mut episode.reading_columns, time, &late, m);
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

/// Assigns columns of late readings (`rows x ns x m`) to the rows that they measure.
pub fn retime_columns(columns: &mut [f64], time: &[f64], late: &[f64], m: usize) {
    let ns = late.len();
    for (s, &late) in late.iter().enumerate().filter(|(_, l)| **l > 0.0) {
        for (k, to) in told(time, late).into_iter().enumerate() {
            if let Some(to) = to {
                for i in 0..m {
                    columns[(to * ns + s) * m + i] = columns[(k * ns + s) * m + i];
                }
            }
        }
    }
}
