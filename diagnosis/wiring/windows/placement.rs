//! Placement of the windows in the logs, and their duration.

use super::misses::mean;
use super::{LOCAL, WINDOWS};
use crate::wiring::hypotheses::LATEST;
use crate::wiring::record::Recorded;
use crate::wiring::view::ColumnView;

/// Durations of windows that are tried, shortest first, s.
const DURATIONS: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
/// Multiple of the noise by which a quantity must leave its straight line for a window to be long
/// enough.
const SHOWS: f64 = 8.0;

/// A window, by its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    /// Index of its log.
    pub(super) episode: usize,
    /// Start time, s.
    pub(super) start: f64,
    /// Whether it begins at the initial state that the log gives.
    pub(super) given: bool,
}

/// Shortest duration over which most quantities leave their straight lines by clearly more than the
/// noise.
pub(super) fn duration(record: &[Recorded], width: usize, longest: f64) -> f64 {
    let fits = |d: f64| -> bool {
        let half = LOCAL * d;
        let mut shown = Vec::new();
        for entry in 0..width {
            let view = ColumnView::own(entry);
            let (mut moved, mut noise) = (Vec::new(), Vec::new());
            for r in record {
                let steps = ((r.seconds() / d) as usize).min(WINDOWS);
                for k in 1..steps.saturating_sub(1) {
                    let start = r.seconds() * k as f64 / steps as f64;
                    let Some((value, slope)) = r.local(view, start, half) else {
                        continue;
                    };
                    let read = |s: f64| r.reading(view, start + s, d);
                    moved.push((read(d) - value - slope * d).abs());
                    noise.push((read(0.0) - value).abs());
                }
            }
            moved.retain(|x| x.is_finite());
            noise.retain(|x| x.is_finite());
            let (Some(moved), Some(noise)) = (mean(&moved), mean(&noise)) else {
                continue;
            };
            shown.push(moved > SHOWS * noise);
        }
        2 * shown.iter().filter(|s| **s).count() > shown.len()
    };
    let possible = DURATIONS.iter().copied().filter(|d| *d <= longest);
    let mut last = DURATIONS[0].min(longest);
    for d in possible {
        last = d;
        if fits(d) {
            break;
        }
    }
    last
}

/// Windows spread evenly over the episodes, and one at each initial state that a log gives.
pub(super) fn place(record: &[Recorded], duration: f64, count: usize) -> Vec<Window> {
    let each = count.div_ceil(record.len().max(1));
    let mut windows = Vec::new();
    for (episode, r) in record.iter().enumerate() {
        let room = r.seconds() - duration;
        if room <= 0.0 {
            continue;
        }
        // Late readings are searched for after the end of their window.
        let room = (room - LATEST).max(0.5 * room);
        windows.extend((0..each).map(|k| Window {
            episode,
            start: room * (k as f64 + 0.5) / each as f64,
            given: false,
        }));
    }
    for (episode, r) in record.iter().enumerate() {
        if r.start.is_some() && r.seconds() > duration {
            windows.push(Window {
                episode,
                start: 0.0,
                given: true,
            });
        }
    }
    windows
}
