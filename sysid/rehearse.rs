//! Rehearses motions in simulated true machines: logs as a real machine would give them.
//!
//! The log begins in the scene's first state, which is known. The machine settles, unread, as
//! before every motion of [`crate::play`], and then moves. An identification from the log therefore
//! matches the expectation of [`crate::tells`], as far as the machine is linear in its unknowns.

use asid_core::Episode;
use asid_core::episode::{ChannelColumns, InitialState};
use asid_core::error::{Error, Result};
use asid_core::problem::home;
use asid_core::rng::Rng;
use rand::Rng as _;
use rand_distr::StandardNormal;

use crate::limits::Excess;
use crate::play::Player;

/// Result of a rehearsal.
#[derive(Clone, Debug)]
pub struct Rehearsed {
    /// Its log, with noise.
    pub log: Episode,
    /// Violations of limits, checked after every physics step.
    pub excess: Excess,
}

/// Plays commands on a machine whose unknowns have the values `truth`, in their units.
///
/// Commands are `frames x nu`, with frames of `substeps` physics steps.
///
/// # Errors
/// When the machine diverges, its time to settle is not a whole number of frames, or the engine
/// fails.
pub fn rehearse(
    player: &mut Player<'_>,
    (commands, substeps): (&[f64], usize),
    truth: &[f64],
    rng: &mut Rng,
) -> Result<Rehearsed> {
    let nu = player.base.len();
    let fine: Vec<f64> = commands
        .chunks_exact(nu)
        .flat_map(|row| row.repeat(substeps))
        .collect();
    let played = player.play(&[(&fine, truth)], 1)?;
    let Some(played) = played.first().filter(|p| !p.readings.is_empty()) else {
        return Err(Error::Failed("the true machine diverges".into()));
    };
    let layout = &player.plant.layout;
    let settle = (player.settle / layout.timestep).round() as usize;
    if !settle.is_multiple_of(substeps) {
        return Err(Error::Config {
            key: "settle".into(),
            message: format!("{} s is no whole number of frames", player.settle),
        });
    }
    let before = settle / substeps;
    let mut ctrl = player.base.repeat(before);
    ctrl.extend_from_slice(commands);
    ctrl.extend_from_slice(&commands[commands.len() - nu..]);
    let width = player.width();
    let mut readings = vec![f64::NAN; (before + 1) * width];
    let rows = played.readings.chunks_exact(width);
    for row in rows.skip(substeps - 1).step_by(substeps) {
        let mut rest = row;
        for signal in &player.signals {
            let (own, other) = rest.split_at(layout.sensor(&signal.sensor)?.len);
            readings.extend(noisy(own, signal.noise, rng));
            rest = other;
        }
    }
    let channels = player.signals.iter().map(|s| layout.sensor(&s.sensor));
    let channels: Result<Vec<ChannelColumns>> = channels
        .map(|s| {
            s.map(|s| ChannelColumns {
                name: s.name.clone(),
                len: s.len,
            })
        })
        .collect();
    let period = substeps as f64 * layout.timestep;
    let (qpos, qvel) = home(layout);
    Ok(Rehearsed {
        log: Episode {
            time: (0..ctrl.len() / nu).map(|k| k as f64 * period).collect(),
            actuators: layout.actuators.iter().map(|a| a.name.clone()).collect(),
            ctrl,
            channels: channels?,
            readings,
            initial: Some(InitialState { qpos, qvel }),
        },
        excess: played.excess.clone(),
    })
}

/// Adds normal noise to a reading.
///
/// One of four entries is an orientation, which is turned about its body's axes.
fn noisy(reading: &[f64], deviation: f64, rng: &mut Rng) -> Vec<f64> {
    let mut normal = || deviation * rng.sample::<f64, _>(StandardNormal);
    if let [w, x, y, z] = *reading {
        let [a, b, c] = [normal() / 2.0, normal() / 2.0, normal() / 2.0];
        return vec![
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        ];
    }
    reading.iter().map(|x| x + normal()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use asid_core::signal::unit_quaternion;

    #[test]
    fn an_orientation_is_turned_by_the_noise() {
        let mut rng = Streams::new(1).stream("t");
        let still = [0.5, -0.5, 0.5, 0.5];
        let turns: Vec<f64> = (0..4000)
            .map(|_| {
                let turned = noisy(&still, 0.01, &mut rng);
                let by = unit_quaternion(&still).inverse() * unit_quaternion(&turned);
                by.angle().powi(2)
            })
            .collect();
        // Three axes; the mean of 12000 squares is accurate to 1.3 %.
        let deviation = (turns.iter().sum::<f64>() / 12000.0).sqrt();
        assert!((deviation / 0.01 - 1.0).abs() < 0.03, "{deviation}");
    }
}
