//! The regime of motion of a machine at each row of a log, so that a label says where the excess
//! lies.
//!
//! Names and limits are those by which a diagnosis reports (`docs/withheld.md`). The regime is read
//! from the world itself, with its causes, and not from a model. For a sensor of a joint it
//! describes that joint, for a sensor of a body's pose the contacts of that body.

use std::collections::BTreeMap;

use crate::anatomy::{Anatomy, Reads, Sensor};
use crate::engine::Sim;
use crate::gap::Refit;
use crate::label::Place;
use crate::motion::Motion;

/// Share of an episode that is its start. The contract of `where` sets this number and the next
/// two.
const START: f64 = 0.03;
/// Share of a joint's largest speed in an episode up to which the joint stands.
const SLOW: f64 = 0.03;
/// Rows before and after a standing joint whose velocities decide about a reversal.
const AROUND: usize = 5;
/// Share of the squared excess below which a place is not listed: far below the tenth from which a
/// place counts.
const LISTED: f64 = 0.005;

/// State of the part of the machine that a sensor reads, at one row.
#[derive(Clone, Copy, Debug, Default)]
struct Glance {
    /// Velocity of the joint, rad/s or m/s.
    speed: f64,
    /// Whether a drive of the joint is at a limit of its command or of its force.
    saturated: bool,
    /// The body that the sensor's body touches, if any.
    touches: Option<usize>,
}

/// The states of a world along its episodes.
pub struct Watch<'a> {
    anatomy: &'a Anatomy,
    motions: &'a [Motion],
    /// Rows x sensors of all episodes, one after the other.
    seen: Vec<Glance>,
}

impl<'a> Watch<'a> {
    /// A watch that has seen nothing yet.
    #[must_use]
    pub fn new(anatomy: &'a Anatomy, motions: &'a [Motion]) -> Self {
        Self {
            anatomy,
            motions,
            seen: Vec::new(),
        }
    }

    /// Records the state of a world after a step of an episode, if a row falls on that step.
    pub fn look(&mut self, sim: &Sim, step: usize) {
        let motion = &self.motions[sim.episode];
        let step_of = |row: usize| (row as f64 * motion.period / sim.dt).round() as usize;
        let row = (step as f64 * sim.dt / motion.period).round() as usize;
        if row >= motion.rows || step_of(row) != step {
            return;
        }
        for sensor in &self.anatomy.sensors {
            self.seen.push(match sensor.reads {
                Reads::Joint(joint) => Glance {
                    speed: sim.qvel()[self.anatomy.joints[joint].dof],
                    saturated: (0..self.anatomy.drives.len())
                        .any(|d| self.anatomy.drives[d].joint == Some(joint) && sim.saturated(d)),
                    touches: None,
                },
                Reads::Body(body) => Glance {
                    touches: sim.touches(body),
                    ..Glance::default()
                },
                Reads::Other => Glance::default(),
            });
        }
    }

    /// Regimes of all sensors at all rows, in the order of the rows.
    #[must_use]
    pub fn regimes(&self) -> Vec<String> {
        let n = self.anatomy.sensors.len();
        let mut regimes = Vec::with_capacity(self.seen.len());
        let mut left = &self.seen[..];
        for motion in self.motions {
            let (episode, after) = left.split_at((motion.rows * n).min(left.len()));
            left = after;
            for (i, glance) in episode.iter().enumerate() {
                let (row, sensor) = (i / n, i % n);
                let of_sensor: Vec<f64> = match self.anatomy.sensors[sensor].reads {
                    Reads::Joint(_) => around(episode, n, sensor, row),
                    _ => Vec::new(),
                };
                regimes.push(self.name(sensor, glance, (row, motion.rows), &of_sensor));
            }
        }
        regimes
    }

    fn name(
        &self,
        sensor: usize,
        glance: &Glance,
        (row, rows): (usize, usize),
        speeds: &[f64],
    ) -> String {
        if (row as f64) < START * rows as f64 {
            return "start".into();
        }
        match (self.anatomy.sensors[sensor].reads, glance.touches) {
            (Reads::Other, _) => "motion".into(),
            (Reads::Body(_), None) => "free".into(),
            (Reads::Body(body), Some(other)) => {
                let names = &self.anatomy.bodies;
                format!("contact {}/{}", names[body], names[other])
            }
            (Reads::Joint(_), _) if glance.saturated => "saturated".into(),
            (Reads::Joint(_), _) => match *speeds {
                [largest, ..] if glance.speed.abs() > SLOW * largest => "moving".into(),
                [_, before, after] if before * after < 0.0 => "reversal".into(),
                _ => "standing".into(),
            },
        }
    }
}

/// Largest speed of a sensor's joint in an episode, and its velocities `AROUND` rows before and
/// after.
///
/// The velocities are missing if the episode ends before the later row.
fn around(episode: &[Glance], n: usize, sensor: usize, row: usize) -> Vec<f64> {
    let speeds = || episode.iter().skip(sensor).step_by(n).map(|g| g.speed);
    let mut found = vec![speeds().fold(0.0, |a: f64, v| a.max(v.abs()))];
    if let Some(after) = speeds().nth(row + AROUND) {
        found.extend(speeds().nth(row.saturating_sub(AROUND)));
        found.push(after);
    }
    found
}

/// Shares of the squared excess by column and regime, largest first.
#[must_use]
pub fn places(anatomy: &Anatomy, left: &Refit, regimes: &[String]) -> Vec<Place> {
    // The sensor and the name of each column of a row.
    let columns: Vec<(usize, String)> = anatomy
        .sensors
        .iter()
        .enumerate()
        .flat_map(|(s, sensor)| Sensor::columns(sensor).into_iter().map(move |c| (s, c)))
        .collect();
    let mut sums: BTreeMap<(&str, &str), f64> = BTreeMap::new();
    let rows = left.residual.chunks_exact(columns.len());
    for (row, regimes) in rows.zip(regimes.chunks_exact(anatomy.sensors.len())) {
        for (x, (sensor, column)) in row.iter().zip(&columns) {
            *sums.entry((column, &regimes[*sensor])).or_default() += x * x;
        }
    }
    let total: f64 = sums.values().sum();
    let mut places: Vec<Place> = sums
        .into_iter()
        .map(|((signal, regime), sum)| Place {
            signal: signal.to_owned(),
            regime: regime.to_owned(),
            share: sum / total.max(f64::MIN_POSITIVE),
        })
        .filter(|p| p.share >= LISTED)
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}
