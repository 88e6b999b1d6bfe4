//! Mean square of readings about their own mean: what a replay must beat to have any skill.
//!
//! An effect that quiets a machine may bring replays closer to readings that do not follow the
//! commands at all. Such a replay predicts nothing: the mean of the log does as well. A replay has
//! skill if it leaves less than the mean does (the skill score of Murphy 1988,
//! doi:10.1175/1520-0493(1988)116<2417:SSBOTM>2.0.CO;2).

use crate::data::Logs;

/// Returns the mean square of the readings about their mean over each log, in units of the noise;
/// NaN without readings.
///
/// Readings are taken relative to the first of their sensor in the log, so that those of an
/// orientation are rotation vectors.
#[must_use]
pub fn about_the_mean(logs: &Logs) -> f64 {
    let (width, entries, noise) = (logs.width(), logs.entries.len(), logs.entry_noise());
    let (mut sum, mut count) = (0.0, 0_usize);
    for (i, episode) in logs.episodes.iter().enumerate() {
        let rows = episode.plan.rows();
        let first: Vec<f64> = (0..width)
            .map(|c| {
                let mut column = episode.readings.iter().skip(c).step_by(width);
                column.find(|x| x.is_finite()).copied().unwrap_or(f64::NAN)
            })
            .collect();
        let mut from_first = vec![f64::NAN; rows * entries];
        logs.difference(i, &first.repeat(rows), &mut from_first);
        for (j, noise) in noise.iter().enumerate() {
            let column = from_first.iter().skip(j).step_by(entries);
            let column: Vec<f64> = column.copied().filter(|x| x.is_finite()).collect();
            let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
            sum += (column.iter())
                .map(|x| ((x - mean) / noise).powi(2))
                .sum::<f64>();
            count += column.len();
        }
    }
    sum / count as f64
}

#[cfg(test)]
mod tests {
    use crate::data::tests::{log, plant};

    use super::*;

    #[test]
    fn readings_about_their_mean_are_counted_log_by_log_in_units_of_the_noise() {
        let episodes = vec![
            log("a", &[1.0, 3.0, f64::NAN, 5.0]),
            log("b", &[7.0, 7.0, 7.0, 7.0]),
        ];
        let mut logs = Logs::new(&plant(), &["place".to_owned()], episodes).unwrap();
        logs.set_noise(&[0.5]);
        // 4 + 0 + 4 of the first log over 0.5 squared, divided by seven readings.
        assert!((about_the_mean(&logs) - 8.0 / 0.25 / 7.0).abs() < 1e-12);
    }
}
