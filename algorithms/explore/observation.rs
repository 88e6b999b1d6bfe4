//! Observations of an exploration policy.
//!
//! An observation consists of a reading, the elapsed share of the episode, and the information
//! gathered so far. Its entries are chosen so that a small network can use them:
//!
//! - An orientation becomes two columns of its rotation matrix, which have neither the jump of an
//!   angle nor the double sign of a quaternion (Zhou et al. 2019, "On the continuity of rotation
//!   representations").
//! - The position of the end effector is also given in the frame of the object, where the effect of
//!   a push does not depend on how the object lies.
//!
//! The end effector is the first proprioceptive channel with three entries; without one the
//! relative entries are left out.

use asid_core::signal::unit_quaternion;
use asid_core::{Problem, Result};
use nalgebra::Vector3;

/// Smallest expected standard deviation that is resolved, prior-scaled.
const SMALLEST_STD: f64 = 1e-6;

/// A group of observation entries that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// What the group is, such as `rod_pos` or `ee_pos in the frame of rod_quat`.
    pub name: String,
    /// Number of entries.
    pub len: usize,
}

/// How entries are computed from a reading's row.
#[derive(Clone, Debug)]
enum Part {
    /// Copied: first entry and number of entries.
    Plain(usize, usize),
    /// First and second column of the rotation matrix of the quaternion that begins at this entry.
    Rotation(usize),
    /// The end effector in the frame of the object: the entry where each begins, and that of the
    /// object's quaternion if it has one.
    Relative {
        effector: usize,
        object: usize,
        rotation: Option<usize>,
    },
}

/// Turns readings into observations.
#[derive(Clone, Debug)]
pub struct Observer {
    parts: Vec<Part>,
    entries: Vec<Entry>,
    width: usize,
    unknowns: usize,
}

impl Observer {
    /// The observer of a problem's exploration episodes.
    ///
    /// # Errors
    /// When the scene lacks a channel of the protocol.
    pub fn new(problem: &Problem<'_>) -> Result<Self> {
        let mut observer = Self::of_readings(problem)?;
        observer.unknowns = problem.parameters.len();
        for parameter in problem.parameters {
            observer.entries.push(Entry {
                name: format!("-log expected std of {}, prior-scaled", parameter.name),
                len: 1,
            });
        }
        Ok(observer)
    }

    /// Observer without the information gathered so far.
    ///
    /// It uses only the readings and the clock, so that no simulation has to run along.
    ///
    /// # Errors
    /// As [`Observer::new`].
    pub fn of_readings(problem: &Problem<'_>) -> Result<Self> {
        let protocol = problem.task.exploration();
        let names = protocol.channels();
        let recording = problem.model.layout().recording(&names)?;
        let mut parts = Vec::new();
        let mut entries = Vec::new();
        let mut add = |part: Part, name: String| {
            entries.push(Entry {
                name,
                len: part.len(),
            });
            parts.push(part);
        };
        let tracked = protocol.signals.len();
        let effector = (tracked..names.len()).find(|&i| recording.range(i).len() == 3);
        for (i, name) in names.iter().enumerate() {
            let range = recording.range(i);
            let is_tracked = i < tracked;
            if is_tracked && range.len() == 4 {
                add(Part::Rotation(range.start), format!("{name} as rotation"));
            } else {
                add(Part::Plain(range.start, range.len()), name.clone());
            }
            if let (true, 3, Some(effector)) = (is_tracked, range.len(), effector) {
                let next = (i + 1 < tracked).then(|| recording.range(i + 1));
                let rotation = next.filter(|r| r.len() == 4).map(|r| r.start);
                let seen = |frame| Part::Relative {
                    effector: recording.range(effector).start,
                    object: range.start,
                    rotation: frame,
                };
                add(seen(None), format!("{} - {name}", names[effector]));
                if rotation.is_some() {
                    let frame = format!("{} in the frame of {}", names[effector], names[i + 1]);
                    add(seen(rotation), frame);
                }
            }
        }
        entries.push(Entry {
            name: "share of the episode".into(),
            len: 1,
        });
        Ok(Self {
            parts,
            entries,
            width: recording.width(),
            unknowns: 0,
        })
    }

    /// The entries of an observation, in order.
    #[must_use]
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Number of entries of an observation.
    #[must_use]
    pub fn observation_len(&self) -> usize {
        self.parts.iter().map(Part::len).sum::<usize>() + 1 + self.unknowns
    }

    /// Writes the observation for a reading's row at `share` of the episode, with the expected
    /// standard deviation of each unknown (prior-scaled).
    ///
    /// Entries of missing readings are 0.
    pub fn observe(&self, reading: &[f64], share: f64, expected_std: &[f64], out: &mut [f64]) {
        debug_assert_eq!(reading.len(), self.width);
        let mut at = 0;
        for part in &self.parts {
            let row = &mut out[at..at + part.len()];
            part.write(reading, row);
            for x in row {
                *x = if x.is_finite() { *x } else { 0.0 };
            }
            at += part.len();
        }
        out[at] = share;
        for (o, std) in out[at + 1..].iter_mut().zip(expected_std) {
            *o = -std.max(SMALLEST_STD).ln();
        }
    }
}

impl Part {
    fn len(&self) -> usize {
        match self {
            Self::Plain(_, len) => *len,
            Self::Rotation(_) => 6,
            Self::Relative { .. } => 3,
        }
    }

    fn write(&self, reading: &[f64], out: &mut [f64]) {
        let vector = |at: usize| Vector3::from_column_slice(&reading[at..at + 3]);
        match *self {
            Self::Plain(start, len) => out.copy_from_slice(&reading[start..start + len]),
            Self::Rotation(start) => {
                let rotation = unit_quaternion(&reading[start..start + 4]).to_rotation_matrix();
                out.copy_from_slice(&rotation.matrix().as_slice()[..6]);
            }
            Self::Relative {
                effector,
                object,
                rotation,
            } => {
                let mut seen = vector(effector) - vector(object);
                if let Some(at) = rotation {
                    seen = unit_quaternion(&reading[at..at + 4]).inverse() * seen;
                }
                out.copy_from_slice(seen.as_slice());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about z: the object's x axis points along the world's y.
    const QUARTER: [f64; 4] = [
        std::f64::consts::FRAC_1_SQRT_2,
        0.0,
        0.0,
        std::f64::consts::FRAC_1_SQRT_2,
    ];

    #[test]
    fn the_end_effector_is_seen_from_the_object() {
        // Object at (1, 2, 0), end effector half a metre along the object's own x.
        let mut reading = vec![1.0, 2.0, 0.0];
        reading.extend(QUARTER);
        reading.extend([1.0, 2.5, 0.0]);
        let part = Part::Relative {
            effector: 7,
            object: 0,
            rotation: Some(3),
        };
        let mut out = [0.0; 3];
        part.write(&reading, &mut out);
        for (a, b) in out.iter().zip([0.5, 0.0, 0.0]) {
            assert!((a - b).abs() < 1e-12, "{out:?}");
        }
    }

    #[test]
    fn a_rotation_has_no_double_sign() {
        let negated = QUARTER.map(|x| -x);
        let (mut a, mut b) = ([0.0; 6], [0.0; 6]);
        Part::Rotation(0).write(&QUARTER, &mut a);
        Part::Rotation(0).write(&negated, &mut b);
        assert_eq!(a, b);
        // Columns of the rotation: x goes to y, y to -x.
        for (x, expected) in a.iter().zip([0.0, 1.0, 0.0, -1.0, 0.0, 0.0]) {
            assert!((x - expected).abs() < 1e-12, "{a:?}");
        }
    }
}
