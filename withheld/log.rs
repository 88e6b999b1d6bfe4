//! The logs of a case: what its sensors read, with noise, at the rows of a file.

use std::fmt::Write as _;

use rand::Rng;

use crate::anatomy::{Anatomy, JointKind};
use crate::faults::{LogFault, Wiring};
use crate::gap::in_steps;
use crate::motion::Motion;
use crate::random::normal;
use crate::simulate::Record;

/// How a case's logs are written.
#[derive(Clone, Debug)]
pub struct Style {
    /// Correlation of a sensor's noise from one row to the next; 0 is white.
    pub colour: f64,
    /// Standard deviation of the reading times about the rows' stamps, as a share of the time
    /// between rows.
    pub jitter: f64,
    /// Whether the first row holds the initial state.
    pub starts: bool,
    /// A fault of the log.
    pub fault: Option<LogFault>,
    /// A fault of wiring.
    pub wiring: Option<Wiring>,
}

/// Share of readings that are spikes, in a log with this fault.
const SPIKES: f64 = 0.004;
/// Range of the size of a spike, in standard deviations of the noise.
const SPIKE: [f64; 2] = [15.0, 60.0];
/// One of this many readings is left, in a log with missing readings.
const ONE_IN: usize = 3;
/// Quantisation step of an encoder at rest, in standard deviations of its sensor's noise.
///
/// Its error has the same standard deviation as the noise: the uniform error of a step has the
/// standard deviation of the step over the root of 12.
const ENCODER: f64 = 3.464;

/// One log as comma-separated values.
#[must_use]
pub fn text(
    anatomy: &Anatomy,
    record: &Record,
    steps: &[(usize, f64)],
    (episode, motion): (usize, &Motion),
    style: &Style,
    random: &mut impl Rng,
) -> String {
    let readings = readings(anatomy, record, steps, (episode, motion), style, random);
    let mut columns: Vec<String> = vec!["time".into()];
    let mut commands: Vec<String> = Vec::new();
    commands.extend(anatomy.drives.iter().map(|d| format!("ctrl.{}", d.name)));
    let mut sensors: Vec<String> = anatomy.sensors.iter().flat_map(|s| s.columns()).collect();
    let mut values = readings;
    if let Some(wiring) = &style.wiring {
        wiring.apply(&mut commands, &mut sensors, &mut values);
    }
    columns.extend(commands);
    columns.extend(sensors);
    let start = if style.starts {
        start(anatomy, motion)
    } else {
        Vec::new()
    };
    columns.extend(start.iter().map(|(name, _)| name.clone()));
    let mut out = columns.join(",");
    out.push('\n');
    let nu = anatomy.drives.len();
    for (row, values) in values.iter().enumerate() {
        let _ = write!(out, "{:.6}", row as f64 * motion.period);
        for u in &motion.commands[row * nu..(row + 1) * nu] {
            let _ = write!(out, ",{u}");
        }
        for value in values {
            match value {
                v if v.is_nan() => out.push(','),
                v => {
                    let _ = write!(out, ",{}", digits(*v));
                }
            }
        }
        for (_, value) in &start {
            match row {
                0 => {
                    let _ = write!(out, ",{value}");
                }
                _ => out.push(','),
            }
        }
        out.push('\n');
    }
    out
}

/// A reading with seven significant digits.
fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".into();
    }
    let decimals = (6.0 - value.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Readings with noise, one row each; NaN for a missing reading.
fn readings(
    anatomy: &Anatomy,
    record: &Record,
    steps: &[(usize, f64)],
    (episode, motion): (usize, &Motion),
    style: &Style,
    random: &mut impl Rng,
) -> Vec<Vec<f64>> {
    let fault = style.fault;
    let (jitter, colour) = (style.jitter, style.colour);
    let late = style.wiring.as_ref().map_or(0.0, Wiring::clock);
    let mut noise = vec![f64::NAN; anatomy.width()];
    let mut rows = Vec::with_capacity(motion.rows);
    for row in 0..motion.rows {
        let off = normal(random).clamp(-3.0, 3.0) * jitter;
        let time = (row as f64 + off) * motion.period - late;
        let mut values = Vec::with_capacity(anatomy.width());
        for (number, sensor) in anatomy.sensors.iter().enumerate() {
            let kept = fault != Some(LogFault::Missing) || random.random_range(0..ONE_IN) == 0;
            let spike = fault == Some(LogFault::Spikes) && random.random::<f64>() < SPIKES;
            let first = values.len();
            for column in sensor.address..sensor.address + sensor.len {
                let fresh = normal(random);
                let before = noise[column];
                noise[column] = if before.is_nan() {
                    fresh
                } else {
                    colour * before + (1.0 - colour * colour).sqrt() * fresh
                };
                let exact = record.at(episode, time, column);
                let encoder = fault == Some(LogFault::Encoder) && number == 0;
                let mut value = if encoder {
                    in_steps(exact, column, &[(column, ENCODER * sensor.noise)])
                } else {
                    in_steps(exact + noise[column] * sensor.noise, column, steps)
                };
                if spike {
                    let size = random.random_range(SPIKE[0]..SPIKE[1]);
                    let sign = if random.random::<bool>() { 1.0 } else { -1.0 };
                    value += sign * size * sensor.noise;
                }
                values.push(if kept { value } else { f64::NAN });
            }
            if sensor.is_orientation() {
                let norm = values[first..].iter().map(|v| v * v).sum::<f64>().sqrt();
                values[first..].iter_mut().for_each(|v| *v /= norm);
            }
        }
        rows.push(values);
    }
    rows
}

/// Columns of the initial state in the first row.
fn start(anatomy: &Anatomy, motion: &Motion) -> Vec<(String, f64)> {
    let mut columns = Vec::new();
    let mut add = |what: &str, joint: &str, values: &[f64]| match values {
        [value] => columns.push((format!("{what}.{joint}"), *value)),
        values => {
            let numbered = values.iter().enumerate();
            columns.extend(numbered.map(|(i, v)| (format!("{what}.{joint}.{i}"), *v)));
        }
    };
    for j in &anatomy.joints {
        let (nq, _) = sizes(j.kind);
        add("qpos", &j.name, &motion.qpos[j.qpos..j.qpos + nq]);
    }
    for j in &anatomy.joints {
        let (_, nv) = sizes(j.kind);
        add("qvel", &j.name, &motion.qvel[j.dof..j.dof + nv]);
    }
    columns
}

fn sizes(kind: JointKind) -> (usize, usize) {
    match kind {
        JointKind::Free => (7, 6),
        JointKind::Hinge | JointKind::Slide => (1, 1),
    }
}
