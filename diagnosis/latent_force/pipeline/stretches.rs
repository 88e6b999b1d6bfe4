//! Stretches of long logs that a search takes: where each begins, and one more.
//!
//! Logs often begin at rest, and rows at rest tell little. The further stretches lie at other places in each log, spread evenly over
//! the logs' length (Weyl's sequence of the golden ratio, which leaves no large gap for any number of logs).

use crate::latent_force::walk::Walk;

/// Share of the rows that the beginning of a log gets: replays start from what is smoothed there.
const BEGINNING: f64 = 1.0 / 3.0;
/// Fractional part of the golden ratio: how far the places of two logs that follow each other lie apart.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Takes `rows` rows of each walk along whole logs, or all where it has no more.
pub(super) fn stretches(walks: &[Walk], rows: impl Fn(&Walk) -> usize) -> Vec<Walk> {
    let mut taken = Vec::with_capacity(2 * walks.len());
    for (i, walk) in walks.iter().enumerate() {
        let rows = rows(walk);
        if rows >= walk.len() {
            taken.push(walk.clone());
            continue;
        }
        let first = ((BEGINNING * rows as f64).round() as usize).max(2);
        let other = rows.saturating_sub(first).max(2);
        let free = walk.len().saturating_sub(first + other);
        let place = (GOLDEN * (i + 1) as f64).fract();
        let at = first + (place * free as f64).round() as usize;
        // Without a seam where they meet.
        if at == first {
            taken.push(walk.part(0..(first + other).min(walk.len())));
        } else {
            taken.extend([walk.part(0..first), walk.part(at..at + other)]);
        }
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(rows: usize) -> Walk {
        Walk {
            episode: 0,
            rows: (0..rows).collect(),
            time: (0..rows).map(|k| k as f64).collect(),
            substeps: vec![1; rows - 1],
            ctrl: Vec::new(),
            segment: None,
        }
    }

    #[test]
    fn a_short_log_is_taken_whole_and_a_long_one_in_two_stretches() {
        let walks = [30, 1000, 1000, 1000].map(walk);
        let taken = stretches(&walks, |_| 90);
        assert_eq!(taken[0], walks[0]);
        let ends: Vec<[usize; 2]> = taken[1..]
            .iter()
            .map(|w| [w.rows[0], w.rows[w.len() - 1] + 1])
            .collect();
        // 30 rows and 60 of the other 910, at the second to the fourth multiple of the golden ratio.
        let at = |n: f64| 30 + ((n * GOLDEN).fract() * 910.0).round() as usize;
        let places = [2.0, 3.0, 4.0].map(at);
        let want = places.map(|at| [[0, 30], [at, at + 60]]).concat();
        assert_eq!(ends, want);
    }
}
