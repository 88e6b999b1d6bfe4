//! The noise of a sensor, where nobody says it: third differences of its readings, which a smooth motion leaves small.

use asid_core::Episode;
use asid_core::signal::Signal;

use crate::physics::Study;
use crate::statistics::median;

/// Ratio of a normal variable's deviation to the median of its size.
const NORMAL: f64 = 1.482_602_218_505_602;
/// Deviation of the third difference of white noise of deviation one, the root of 1 + 9 + 9 + 1.
const THIRD: f64 = 4.472_135_954_999_58;
/// Noise that a sensor has at least, as a share of the spread of its readings: double precision and a log's digits.
const LEAST: f64 = 1e-6;

/// The sensors that a study's logs have, with the noise that it gives, or that their readings show.
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
