//! History of an episode as a fixed number of values, the input of a network.
//!
//! The episode is sampled at *marks*: its start and the ends of its control steps. The entries of a
//! mark are position and orientation of every tracked part, the position of the end effector, and
//! that position relative to each part. The first reading of position, orientation and effector is
//! taken as it is; later ones are differences from it. The reason is scale: a displacement of a
//! centimetre is informative about the object's physics, but the decimetres between start poses
//! would dominate it.
//!
//! The first reading stands at the start, also where it comes late: an object rests until it is
//! touched. Its own mark then lacks it. A network of whole episodes is never shown a pose where it
//! expects a displacement.
//!
//! Missing and future values are NaN and have a mask of 0. One network thus handles episodes of any
//! length with any reading missing.

use asid_core::layout::Recording;
use asid_core::nalgebra::{Matrix3, Vector3};
use asid_core::signal::unit_quaternion;
use asid_core::{Episode, Problem, Result};

/// How the entries of a mark are computed from a reading's row.
#[derive(Clone, Debug)]
enum Part {
    /// Copied: first entry and number of entries.
    Plain(usize, usize),
    /// Two columns of the rotation matrix of the quaternion that begins at this entry.
    Rotation(usize),
    /// Position of the end effector (first entry) minus the position of a part (second entry).
    Relative(usize, usize),
}

impl Part {
    fn len(&self) -> usize {
        match self {
            Self::Plain(_, len) => *len,
            Self::Rotation(_) => 6,
            Self::Relative(..) => 3,
        }
    }

    fn write(&self, reading: &[f64], out: &mut [f64]) {
        match *self {
            Self::Plain(start, len) => out.copy_from_slice(&reading[start..start + len]),
            Self::Rotation(start) => {
                let wxyz = &reading[start..start + 4];
                if wxyz.iter().all(|x| x.is_finite()) {
                    let rotation = unit_quaternion(wxyz).to_rotation_matrix();
                    out.copy_from_slice(&rotation.matrix().as_slice()[..6]);
                } else {
                    out.fill(f64::NAN);
                }
            }
            Self::Relative(effector, place) => {
                for (i, o) in out.iter_mut().enumerate() {
                    *o = reading[effector + i] - reading[place + i];
                }
            }
        }
    }
}

/// Converts episodes of a problem to numbers: the entries of all marks, then the masks of all
/// marks.
#[derive(Clone, Debug)]
pub struct History {
    parts: Vec<Part>,
    /// First entry of each tracked signal in a reading's row.
    tracked: Vec<usize>,
    /// Number of entries per mark.
    entries: usize,
    marks: usize,
    /// Channels of a reading's row, in order.
    channels: Vec<String>,
    width: usize,
    /// Time between marks, s.
    period: f64,
}

impl History {
    /// History layout of a problem's exploration episodes.
    ///
    /// # Errors
    /// When the scene lacks a channel of the protocol.
    pub fn new(problem: &Problem<'_>) -> Result<Self> {
        let protocol = problem.task.exploration();
        let channels = protocol.channels();
        let recording: Recording = problem.model.layout().recording(&channels)?;
        let tracked = protocol.signals.len();
        let effector = (tracked..channels.len())
            .map(|i| recording.range(i))
            .find(|r| r.len() == 3);
        let mut parts = Vec::new();
        for i in 0..tracked {
            let range = recording.range(i);
            if range.len() == 4 {
                parts.push(Part::Rotation(range.start));
                continue;
            }
            parts.push(Part::Plain(range.start, range.len()));
            if let (3, Some(effector)) = (range.len(), &effector) {
                parts.push(Part::Relative(effector.start, range.start));
            }
        }
        parts.extend(effector.map(|r| Part::Plain(r.start, 3)));
        Ok(Self {
            entries: parts.iter().map(Part::len).sum(),
            parts,
            tracked: (0..tracked).map(|i| recording.range(i).start).collect(),
            marks: protocol.horizon + 1,
            width: recording.width(),
            period: protocol.frame_period * protocol.frames_per_step as f64,
            channels,
        })
    }

    /// Number of entries of all marks, without the masks.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.marks * self.entries
    }

    /// Number of masks of all marks.
    #[must_use]
    pub fn masks(&self) -> usize {
        self.marks * self.tracked.len()
    }

    /// Number of values of a history.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries() + self.masks()
    }

    /// Never true: a history has at least the entries of its first mark.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of marks of an episode.
    #[must_use]
    pub fn marks(&self) -> usize {
        self.marks
    }

    /// An empty history: all entries unknown.
    #[must_use]
    pub fn blank(&self) -> Vec<f64> {
        let mut out = vec![f64::NAN; self.entries()];
        out.resize(self.len(), 0.0);
        out
    }

    /// Writes the entries of a mark: the mean of each entry over the rows that have it.
    ///
    /// The rows are `n x width`, NaN where a reading is missing.
    pub fn write(&self, history: &mut [f64], mark: usize, rows: &[f64]) {
        let mut sum = vec![0.0; self.entries];
        let mut count = vec![0.0_f64; self.entries];
        let mut seen = vec![0.0; self.tracked.len()];
        let mut entry = vec![0.0; self.entries];
        for row in rows.chunks_exact(self.width) {
            let mut at = 0;
            for part in &self.parts {
                part.write(row, &mut entry[at..at + part.len()]);
                at += part.len();
            }
            for ((s, n), x) in sum.iter_mut().zip(&mut count).zip(&entry) {
                if x.is_finite() {
                    *s += x;
                    *n += 1.0;
                }
            }
            for (mask, &start) in seen.iter_mut().zip(&self.tracked) {
                if row[start].is_finite() {
                    *mask = 1.0;
                }
            }
        }
        let out = &mut history[mark * self.entries..][..self.entries];
        for ((o, s), n) in out.iter_mut().zip(&sum).zip(&count) {
            *o = if *n > 0.0 { s / n } else { f64::NAN };
        }
        self.subtract_first(history, mark);
        let masks = self.entries() + mark * self.tracked.len();
        history[masks..masks + seen.len()].copy_from_slice(&seen);
    }

    /// Replaces the entries of a mark by differences from those of the start.
    ///
    /// Entries that the start lacks are moved there; they are then missing in this mark. Marks that
    /// were written before there was a first orientation are turned as well.
    fn subtract_first(&self, history: &mut [f64], mark: usize) {
        let mut unturned = mark;
        if mark > 0 {
            if self.frame(history).is_none() {
                unturned = 0;
            }
            let (before, from) = history.split_at_mut(mark * self.entries);
            let mut at = 0;
            for part in &self.parts {
                let range = at..at + part.len();
                at = range.end;
                if matches!(part, Part::Relative(..)) {
                    continue;
                }
                let pairs = before[range.clone()].iter_mut().zip(&mut from[range]);
                for (start, x) in pairs {
                    if start.is_finite() {
                        *x -= *start;
                    } else if x.is_finite() {
                        (*start, *x) = (*x, f64::NAN);
                    }
                }
            }
        }
        for mark in unturned..=mark {
            self.turn(history, mark);
        }
    }

    /// Rotation into the frame of the first part's first orientation; none where there is none yet.
    fn frame(&self, history: &[f64]) -> Option<Matrix3<f64>> {
        let is_rotation = |part: &Part| matches!(part, Part::Rotation(_));
        let first = self.parts.iter().position(is_rotation)?;
        let at: usize = self.parts[..first].iter().map(Part::len).sum();
        let column = |i: usize| Vector3::from_column_slice(&history[at + 3 * i..][..3]);
        let x = column(0).normalize();
        let z = x.cross(&column(1)).normalize();
        let frame = Matrix3::from_columns(&[x, z.cross(&x), z]).transpose();
        frame.iter().all(|x| x.is_finite()).then_some(frame)
    }

    /// Rotates differences and relative positions into the frame of the first part's first
    /// orientation.
    ///
    /// The response of an object to a push does not depend on how it lies. Without a first
    /// orientation the frame is the world's.
    fn turn(&self, history: &mut [f64], mark: usize) {
        let Some(frame) = self.frame(history) else {
            return;
        };
        let mut start = mark * self.entries;
        for part in &self.parts {
            let range = start..start + part.len();
            start = range.end;
            if part.len() % 3 == 0 && (mark > 0 || matches!(part, Part::Relative(..))) {
                for vector in history[range].chunks_exact_mut(3) {
                    let turned = frame * Vector3::from_column_slice(vector);
                    vector.copy_from_slice(turned.as_slice());
                }
            }
        }
    }

    /// Resets the marks from `from` on to unknown; a first reading that came later stays at the
    /// start unless `from` is 0.
    pub fn forget(&self, history: &mut [f64], from: usize) {
        let (entries, masks) = history.split_at_mut(self.entries());
        entries[from * self.entries..].fill(f64::NAN);
        masks[from * self.tracked.len()..].fill(0.0);
    }

    /// The history of a log at any sampling rate.
    ///
    /// Each row belongs to the first mark that is not before it. Channels that the log lacks are
    /// missing; rows after the last mark are left out.
    #[must_use]
    pub fn of_episode(&self, problem: &Problem<'_>, episode: &Episode) -> Vec<f64> {
        /// A row this share of a period after a mark still belongs to that mark, against rounding
        /// of the times.
        const SLACK: f64 = 1e-6;
        let readings = episode.select(problem.model.layout(), &self.channels);
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); self.marks];
        for (row, time) in readings.chunks_exact(self.width).zip(&episode.time) {
            let mark = ((time - episode.time[0]) / self.period - SLACK)
                .ceil()
                .max(0.0);
            if let Some(rows) = rows.get_mut(mark as usize) {
                rows.extend_from_slice(row);
            }
        }
        let mut history = self.blank();
        for (mark, rows) in rows.iter().enumerate() {
            self.write(&mut history, mark, rows);
        }
        history
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::with_problem;

    /// Rod: position (3), effector relative to it (3), rotation (6), effector (3); two tracked
    /// signals.
    #[test]
    fn marks_hold_means_of_what_is_there() {
        with_problem("rod-balancing", |problem| {
            let history = History::new(problem).unwrap();
            assert_eq!(history.entries(), 21 * 15);
            assert_eq!(history.masks(), 21 * 2);
            let mut numbers = history.blank();
            let mut row = vec![0.0; history.width];
            row[..3].copy_from_slice(&[0.5, 0.1, 0.0]);
            row[3..7].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
            row[7..10].copy_from_slice(&[0.4, 0.0, 0.1]);
            let mut other = row.clone();
            other[0] = 0.7;
            other[3..7].fill(f64::NAN);
            history.write(&mut numbers, 0, &[row.clone(), other].concat());
            let mark = &numbers[..15];
            assert!((mark[0] - 0.6).abs() < 1e-12 && (mark[3] + 0.2).abs() < 1e-12);
            assert_eq!(mark[6..12], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
            assert!(numbers[15..history.entries()].iter().all(|x| x.is_nan()));
            let masks = &numbers[history.entries()..];
            assert_eq!(masks[..3], [1.0, 1.0, 0.0]);
            // The next mark holds differences, except for the relative position of the effector.
            let mut later = row.clone();
            later[0] += 0.15;
            history.write(&mut numbers, 1, &later);
            let mark = &numbers[15..30];
            assert!((mark[0] - 0.05).abs() < 1e-12 && (mark[3] + 0.25).abs() < 1e-12);
            assert_eq!(mark[6..12], [0.0; 6]);
            history.forget(&mut numbers, 0);
            assert!(numbers[..history.entries()].iter().all(|x| x.is_nan()));
            assert!(numbers[history.entries()..].iter().all(|&m| m == 0.0));
        });
    }

    /// Symptom: where the first row of a log had no reading of the object, an estimator's answer
    /// was off by several of its standard deviations. Cause: the next mark held a pose where the
    /// network expects a displacement, and no later one was turned into the object's frame.
    #[test]
    fn a_first_reading_that_comes_late_is_that_of_the_start() {
        with_problem("rod-balancing", |problem| {
            let history = History::new(problem).unwrap();
            // The rod lies still, turned by 0.4, until it is pushed before the last mark.
            let rows: Vec<Vec<f64>> = [(0.0, 0.4), (0.0, 0.4), (0.0, 0.4), (0.05, 0.9)]
                .into_iter()
                .enumerate()
                .map(|(mark, (moved, yaw))| {
                    let (sin, cos) = (0.5_f64 * yaw).sin_cos();
                    let mut row = vec![0.0; history.width];
                    row[..3].copy_from_slice(&[0.5 + moved, 0.1, 0.02]);
                    row[3..7].copy_from_slice(&[cos, 0.0, 0.0, sin]);
                    row[7..10].copy_from_slice(&[0.3 + 0.1 * mark as f64, 0.0, 0.02]);
                    row
                })
                .collect();
            let of = |seen_from: usize| {
                let mut numbers = history.blank();
                for (mark, row) in rows.iter().enumerate() {
                    let mut row = row.clone();
                    if mark < seen_from {
                        row[..7].fill(f64::NAN);
                    }
                    history.write(&mut numbers, mark, &row);
                }
                numbers
            };
            let whole = of(0);
            for first in [1, 2] {
                let late = of(first);
                // A mark has position (3), effector as seen from the rod (3), rotation (6) and
                // effector (3). The start has all but what is seen from the rod.
                let start = (0..3).chain(6..15);
                let hand = (1..4).flat_map(|mark| 15 * mark + 12..15 * mark + 15);
                let seen = 15 * first + 3..15 * first + 6;
                let later = 15 * (first + 1)..15 * 4;
                for at in start.chain(hand).chain(seen).chain(later) {
                    assert!((whole[at] - late[at]).abs() < 1e-12, "{first}: entry {at}");
                }
                // The mark of the first reading says nothing of a displacement.
                let mark = &late[15 * first..][..15];
                assert!(mark[..3].iter().chain(&mark[6..12]).all(|x| x.is_nan()));
                let masks = late[history.entries()..].chunks_exact(2);
                for (mark, masks) in masks.take(4).enumerate() {
                    let shown = f64::from(u8::from(mark >= first));
                    assert_eq!(masks, [shown; 2], "mark {mark}");
                }
            }
        });
    }

    /// An episode rotated about the vertical, object and hand alike, has the same history after its
    /// first mark.
    #[test]
    fn a_turned_episode_tells_the_same() {
        with_problem("rod-balancing", |problem| {
            let history = History::new(problem).unwrap();
            let of = |yaw: f64| {
                let turn = asid_core::nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), yaw);
                let mut numbers = history.blank();
                for (mark, angle) in [0.4, 0.9].into_iter().enumerate() {
                    let place = turn * Vector3::new(0.1 * angle, 0.2, 0.0);
                    let hand = turn * Vector3::new(0.3, angle, 0.1);
                    let (sin, cos) = (0.5 * (angle + yaw)).sin_cos();
                    let mut row = vec![0.0; history.width];
                    row[..3].copy_from_slice(place.as_slice());
                    row[3..7].copy_from_slice(&[cos, 0.0, 0.0, sin]);
                    row[7..10].copy_from_slice(hand.as_slice());
                    history.write(&mut numbers, mark, &row);
                }
                numbers[15..30].to_vec()
            };
            for (a, b) in of(0.0).iter().zip(of(1.3)) {
                assert!((a - b).abs() < 1e-12, "{a} {b}");
            }
        });
    }
}
