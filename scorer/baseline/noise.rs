//! Estimates the noise of a sensor if nobody gives it.
//!
//! The estimate uses third differences of its readings, in which a smooth motion is small.

use asid_core::Episode;
use asid_core::signal::Signal;

use crate::physics::Study;
use crate::statistics::median;

/// Ratio of a normal variable's standard deviation to its median absolute value.
const NORMAL: f64 = 1.482_602_218_505_602;
/// Standard deviation of the third difference of white noise of standard deviation one: the root of
/// 1 + 9 + 9 + 1.
const THIRD: f64 = 4.472_135_954_999_58;
/// Smallest noise of a sensor, as a share of the spread of its readings: double precision and a
/// log's digits.
const LEAST: f64 = 1e-6;

/// The sensors of a study's logs, each with its given or estimated noise.
pub fn signals(study: &Study) -> Vec<Signal> {
    let sensors = study.plant.layout.sensors.iter();
    let logged = sensors.filter(|s| study.train.iter().any(|e| e.channel(&s.name).is_some()));
    let signal = |name: &String| Signal {
        noise: study
            .noise
            .get(name)
            .copied()
            .unwrap_or_else(|| shown(&study.train, name)),
        sensor: name.clone(),
    };
    logged.map(|s| signal(&s.name)).collect()
}

fn shown(episodes: &[Episode], sensor: &str) -> f64 {
    let (mut rough, mut spread) = (Vec::new(), 0.0_f64);
    for episode in episodes {
        let Some(range) = episode.channel(sensor) else {
            continue;
        };
        for column in range {
            let series: Vec<f64> = (0..episode.rows())
                .map(|k| episode.reading(k)[column])
                .collect();
            let third = series
                .windows(4)
                .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs());
            rough.extend(third.filter(|d| d.is_finite()));
            let present = || series.iter().copied().filter(|x| x.is_finite());
            let high = present().fold(f64::NEG_INFINITY, f64::max);
            spread = spread.max(high - present().fold(f64::INFINITY, f64::min));
        }
    }
    let noise = median(&rough).map_or(0.0, |m| NORMAL * m / THIRD);
    noise.max(LEAST * spread).max(f64::MIN_POSITIVE)
}
