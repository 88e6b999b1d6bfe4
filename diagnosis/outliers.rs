//! Outliers: readings far from those before and after them, such as dropped bits, lost packets, a
//! tracker's wrong match.
//!
//! Such a reading is neither noise nor physics, and one of them weighs more in a sum of squares
//! than hundreds of good ones. It is left out as if it were missing. Motion is not touched:
//!
//! - A kink or a step lies on the line of the readings on one of its sides. An outlier lies on
//!   neither line, and far away on the same side of both.
//! - A strong acceleration bends several readings in the same direction. An outlier bends its
//!   neighbours in the opposite direction, half as much as itself.

use asid_core::layout::Sensor;
use asid_core::{Episode, Layout};

use crate::wiring::record::align_signs;

/// Distance from both lines, relative to the typical distance, from which on a reading is an
/// outlier.
///
/// The distance from a line through two neighbours has 2.4 times the standard deviation of white
/// noise. One reading in 1e9 lies beyond 4.5 of those on both sides (the two distances share the
/// reading's noise and are otherwise independent). This leaves room for tails heavier than those of
/// the normal distribution.
const FAR: f64 = 4.5;
/// Share of a column beyond which far readings are normal for the sensor, and stay.
const MOST: f64 = 0.03;
/// Ratio of a normal variable's standard deviation to the median of its magnitude.
const NORMAL: f64 = crate::noise::NORMAL;

/// Readings that were left out of a sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Name of the sensor.
    pub sensor: String,
    /// Number of readings over all logs.
    pub count: usize,
}

/// Least bend of an outlier's neighbours, in the opposite direction, as a share of its own; without
/// noise it is a half.
const BENDS: f64 = 0.25;

/// A reading's distances from the lines through the two before it and the two after it, and whether
/// it is `alone`.
///
/// The distances are in units of the standard deviation that the noise of a reading gives them.
/// `alone` says whether the reading bends its neighbours as an outlier does.
struct Distances {
    row: usize,
    before: f64,
    after: f64,
    alone: bool,
}

/// Returns the distance of a reading from the line through two others, divided by the root of the
/// sum of its squared weights.
fn from_line([t, x]: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = (t - a[0]) / (b[0] - a[0]);
    let weights = 1.0 + along * along + (1.0 - along).powi(2);
    (x - a[1] - along * (b[1] - a[1])) / weights.sqrt()
}

/// Returns the distances of those readings of a column that have two neighbours on each side.
fn distances(time: &[f64], column: impl Iterator<Item = f64>) -> Vec<Distances> {
    let present: Vec<(usize, [f64; 2])> = column
        .enumerate()
        .filter(|(_, x)| x.is_finite())
        .map(|(k, x)| (k, [time[k], x]))
        .collect();
    present
        .windows(5)
        .map(|w| {
            let p = |i: usize| w[i].1;
            let bend = |i: usize| from_line(p(i), p(i - 1), p(i + 1));
            let own = bend(2);
            Distances {
                row: w[2].0,
                before: from_line(p(2), p(0), p(1)),
                after: from_line(p(2), p(4), p(3)),
                alone: [1, 3]
                    .iter()
                    .all(|&i| bend(i) * own.signum() < -BENDS * own.abs()),
            }
        })
        .collect()
}

/// Returns a sensor's readings in a log, `rows x entries`, with the signs of quaternions aligned.
fn table(episode: &Episode, layout: &Layout, sensor: &Sensor) -> Vec<f64> {
    let mut table = episode.select(layout, std::slice::from_ref(&sensor.name));
    if sensor.len == 4 {
        align_signs(&mut table, sensor.len, 0);
    }
    table
}

/// Sets outliers to NaN in some logs with common sensors; returns how many there were.
pub fn leave_out(logs: &mut [&mut Episode], layout: &Layout) -> Vec<LeftOut> {
    let mut found = Vec::new();
    for sensor in &layout.sensors {
        let mut far: Vec<Vec<usize>> = vec![Vec::new(); logs.len()];
        let mut readings = 0;
        let tables: Vec<Vec<f64>> = logs.iter().map(|e| table(e, layout, sensor)).collect();
        for c in 0..sensor.len {
            let each: Vec<Vec<Distances>> = logs
                .iter()
                .zip(&tables)
                .map(|(e, table)| {
                    let column = table.iter().skip(c).step_by(sensor.len);
                    distances(&e.time, column.copied())
                })
                .collect();
            let both = |d: &Distances| {
                if d.alone && d.before * d.after > 0.0 {
                    d.before.abs().min(d.after.abs())
                } else {
                    0.0
                }
            };
            let all = each.iter().flatten();
            let mut sizes: Vec<f64> = all.flat_map(|d| [d.before.abs(), d.after.abs()]).collect();
            readings += sizes.len() / 2;
            // Where most readings do not move at all, any motion would be far.
            sizes.retain(|x| *x > 0.0);
            let Some(typical) = crate::noise::median(&mut sizes) else {
                continue;
            };
            for (rows, each) in far.iter_mut().zip(&each) {
                let own = each.iter().filter(|d| both(d) > FAR * NORMAL * typical);
                rows.extend(own.map(|d| d.row));
            }
        }
        let count: usize = far
            .iter_mut()
            .map(|rows| {
                rows.sort_unstable();
                rows.dedup();
                rows.len()
            })
            .sum();
        let most = MOST * readings as f64 / sensor.len as f64;
        if count == 0 || count as f64 > most {
            continue;
        }
        for (episode, rows) in logs.iter_mut().zip(far) {
            let (width, range) = (episode.width(), episode.channel(&sensor.name));
            for (row, range) in rows.iter().zip(std::iter::repeat(range).flatten()) {
                episode.readings[row * width + range.start..row * width + range.end].fill(f64::NAN);
            }
        }
        found.push(LeftOut {
            sensor: sensor.name.clone(),
            count,
        });
    }
    found
}

#[cfg(test)]
mod tests {
    use asid_core::Scene;
    use asid_core::episode::ChannelColumns;
    use asid_mjcf::Plant;

    use super::*;

    fn layout() -> Layout {
        let scene = r#"<mujoco><worldbody><body>
            <joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <sensor><jointpos name="place" joint="slide"/></sensor></mujoco>"#;
        Plant::of(&Scene::from_xml("slide", scene, &[]).unwrap())
            .unwrap()
            .layout
    }

    fn episode(readings: Vec<f64>) -> Episode {
        Episode {
            time: (0..readings.len()).map(|k| 0.01 * k as f64).collect(),
            channels: vec![ChannelColumns {
                name: "place".into(),
                len: 1,
            }],
            readings,
            ..Episode::default()
        }
    }

    /// Noise of standard deviation 1 without a pattern that a line would follow.
    fn noise(k: usize) -> f64 {
        let hash = (k as u64)
            .wrapping_mul(0x9E37_79B9_7F4A_7C15)
            .rotate_left(31);
        let hash = hash.wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (0..12)
            .map(|i| ((hash.rotate_left(5 * i) & 0xFFFF) as f64) / 65536.0)
            .sum::<f64>()
            - 6.0
    }

    #[test]
    fn spikes_are_left_out_and_nothing_else() {
        let mut readings: Vec<f64> = (0..600)
            .map(|k| 300.0 * (0.02 * k as f64).sin() + noise(k))
            .collect();
        let spikes = [40, 41 + 60, 300, 555];
        for (i, &k) in spikes.iter().enumerate() {
            readings[k] += [25.0, -40.0, 18.0, -60.0][i];
        }
        let mut log = episode(readings);
        let found = leave_out(&mut [&mut log], &layout());
        assert_eq!(found[0].count, 4, "{found:?}");
        let gone: Vec<usize> = (0..600).filter(|&k| log.readings[k].is_nan()).collect();
        assert_eq!(gone, spikes);
    }

    /// Symptom: readings of a turning body were left out one by one.
    ///
    /// Cause: a quaternion with the other sign is far from those before and after it, number by
    /// number, though it is the same orientation.
    #[test]
    fn an_orientation_of_the_other_sign_stays() {
        let mut layout = layout();
        layout.sensors[0].kind = "framequat".into();
        layout.sensors[0].len = 4;
        let turned = |k: usize| {
            let half = 0.005 * k as f64 + 1e-4 * noise(k);
            let sign = if k == 300 { -1.0 } else { 1.0 };
            [half.cos(), 0.0, 0.0, half.sin()].map(|x| sign * x)
        };
        let mut log = Episode {
            time: (0..600).map(|k| 0.01 * f64::from(k)).collect(),
            channels: vec![ChannelColumns {
                name: "place".into(),
                len: 4,
            }],
            readings: (0..600).flat_map(turned).collect(),
            ..Episode::default()
        };
        assert_eq!(leave_out(&mut [&mut log], &layout), []);
    }

    #[test]
    fn a_jerk_in_a_long_rest_stays() {
        let readings: Vec<f64> = (0..600)
            .map(|k| {
                let since = (f64::from(k) - 300.0).clamp(0.0, 8.0);
                0.01 * noise(k as usize) + 0.5 * since * since
            })
            .collect();
        let mut log = episode(readings);
        assert_eq!(leave_out(&mut [&mut log], &layout()), []);
    }

    #[test]
    fn a_bounce_and_a_step_of_an_encoder_stay() {
        // Noise-free: every kink is far beyond the noise.
        let bounce: Vec<f64> = (0..400)
            .map(|k| {
                let phase = f64::from(k % 80) / 80.0;
                4.0 * phase * (1.0 - phase)
            })
            .collect();
        let stairs: Vec<f64> = (0..400).map(|k| f64::from(k / 37)).collect();
        for readings in [bounce, stairs] {
            let mut log = episode(readings);
            assert_eq!(leave_out(&mut [&mut log], &layout()), []);
        }
    }
}
