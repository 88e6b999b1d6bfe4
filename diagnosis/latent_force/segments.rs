//! Cuts logs into short segments where bodies touch.
//!
//! A missing force of any size and direction is no model of a lasting contact. If it presses two
//! bodies together, any friction force can act between them. So a stretch with contact is cut into
//! segments. Each is a replay from an initial state of its own (multiple shooting, Bock and Plitt
//! 1984), and its residuals have a variance of their own. Elsewhere the missing force is smoothed.
//!
//! A long segment is more informative: a small force moves a body the further the longer it acts,
//! and there are fewer initial states to estimate. A short one is closer to linear in its initial
//! state: over a quarter of a second even a model with impacts is. So a segment is [as long
//! as](DURATIONS) its replays can be repeated ([`super::scatter`]).
//!
//! A segment begins some rows before its readings count. Over these rows the contact settles, and
//! effects build up their memory. An error of the initial state in a direction that a contact
//! blocks decays as it does in the machine.
//!
//! No segment leads over rows that are missing for longer than it lasts itself. A log does not say
//! what its machine did meanwhile, and a replay over them would cost the readings on both sides.

use crate::noise::median;

use super::walk::Walk;

/// Durations of segments, s, shortest first.
///
/// The first is a few times a contact's time constant (0.02 s by default in MuJoCo). Over it, a few
/// per cent of a force move a body by about a sensor's resolution. The second covers a few impacts,
/// the last a whole stretch of contact.
pub const DURATIONS: [f64; 3] = [0.25, 1.0, f64::INFINITY];
/// Longest stretch without contact that counts to the contacts around it, s: the readings of
/// segments also show what is missing there.
const BETWEEN: f64 = 0.5;
/// Time that a segment runs before its readings count, s: five time constants of a contact.
const LEAD: f64 = 0.1;
/// Time about a row with contact that counts as contact too, s: readings are noisy, and a bounce is
/// shorter than a row. The neighbouring rows always count: a replay leads from one row to the next.
const ABOUT: f64 = 0.1;
/// Fewest rows of a segment that count.
const FEWEST: usize = 4;

/// Cuts a walk into segments of a duration, s, where bodies touch (one flag a row); the rest stays
/// whole.
#[must_use]
pub fn cut(walk: &Walk, touches: &[bool], duration: f64) -> Vec<Walk> {
    let n = walk.len();
    if !touches.contains(&true) {
        return vec![walk.clone()];
    }
    let mut near = vec![false; n];
    for k in (0..n).filter(|&k| touches[k]) {
        let time = walk.time[k];
        let first = walk.time.partition_point(|t| *t < time - ABOUT);
        let last = walk.time.partition_point(|t| *t <= time + ABOUT);
        near[first.min(k.saturating_sub(1))..last.max(k + 2).min(n)].fill(true);
    }
    let runs = merged(walk, runs_of(&near));
    let mut out = Vec::new();
    for (range, touching) in runs {
        if touching {
            segments(walk, range, duration, &mut out);
        } else {
            out.push(walk.part(range));
        }
    }
    out
}

/// Makes a walk one segment from its first row on if bodies touch in any row (one flag a row).
#[must_use]
pub fn whole(walk: &Walk, touches: &[bool]) -> Walk {
    let mut walk = walk.clone();
    if touches.contains(&true) {
        walk.segment = Some(0);
    }
    walk
}

/// Returns the walks that begin an episode, one for each episode.
///
/// A later segment may begin at the first row too, for its lead.
#[must_use]
pub fn firsts(walks: &[Walk]) -> Vec<usize> {
    let begins = |&w: &usize| w == 0 || walks[w].episode != walks[w - 1].episode;
    (0..walks.len()).filter(begins).collect()
}

type Run = (std::ops::Range<usize>, bool);

fn runs_of(flags: &[bool]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (k, &flag) in flags.iter().enumerate() {
        match runs.last_mut() {
            Some((range, last)) if *last == flag => range.end = k + 1,
            _ => runs.push((k..k + 1, flag)),
        }
    }
    runs
}

/// Joins short runs without contact to their neighbours with contact.
fn merged(walk: &Walk, runs: Vec<Run>) -> Vec<Run> {
    let mut out: Vec<Run> = Vec::new();
    for (range, touching) in runs {
        let seconds = walk.time[range.end - 1] - walk.time[range.start];
        let touching = touching || seconds < BETWEEN;
        match out.last_mut() {
            Some((before, last)) if *last == touching => before.end = range.end,
            _ => out.push((range, touching)),
        }
    }
    out
}

/// Cuts some rows into segments of about equal duration.
fn segments(walk: &Walk, range: std::ops::Range<usize>, duration: f64, out: &mut Vec<Walk>) {
    let ends = pieces(&walk.time[range.clone()], duration);
    for pair in ends.windows(2) {
        let (first, end) = (range.start + pair[0], range.start + pair[1]);
        let begin = walk.time[first] - LEAD;
        let lead = walk.time[..first].partition_point(|t| *t < begin - 1e-9);
        let mut part = walk.part(lead..end);
        part.segment = Some(first - lead);
        out.push(part);
    }
}

/// Cuts rows at some times, s, into pieces of about a duration, s; returns the first row of each,
/// and last the number of rows.
///
/// No piece has fewer than [`FEWEST`] rows, unless there are fewer. So pieces are longer where a
/// few rows are missing.
fn pieces(time: &[f64], duration: f64) -> Vec<usize> {
    let mut firsts = Vec::new();
    for pair in stretches(time, duration).windows(2) {
        let own = evenly(&time[pair[0]..pair[1]], duration);
        firsts.extend(own.into_iter().map(|first| pair[0] + first));
    }
    firsts.push(time.len());
    firsts
}

/// Cuts rows where they are missing for longer than a segment of a duration, s, lasts; returns the
/// first row of each stretch, and last the number of rows.
///
/// A segment lasts at least as long as [`FEWEST`] rows usually do. A stretch of fewer rows stays
/// with the one before.
fn stretches(time: &[f64], duration: f64) -> Vec<usize> {
    let rows = time.len();
    let mut seconds: Vec<f64> = time.windows(2).map(|t| t[1] - t[0]).collect();
    let usual = median(&mut seconds).unwrap_or(0.0);
    let longest = duration.max(FEWEST as f64 * usual);
    let mut firsts = vec![0];
    for k in FEWEST..rows {
        let begun = firsts[firsts.len() - 1];
        let is_missing = time[k] - time[k - 1] > longest;
        if is_missing && k >= begun + FEWEST && k + FEWEST <= rows {
            firsts.push(k);
        }
    }
    firsts.push(rows);
    firsts
}

/// Cuts rows at some times, s, into pieces of about a duration, s; returns the first row of each.
fn evenly(time: &[f64], duration: f64) -> Vec<usize> {
    let rows = time.len();
    let seconds = time[rows - 1] - time[0];
    let n = (seconds / duration).round() as usize;
    let n = n.clamp(1, (rows / FEWEST).max(1));
    // The last row lasts as long as the mean of the others.
    let whole = seconds * rows as f64 / rows.saturating_sub(1).max(1) as f64;
    let mut firsts = vec![0];
    for i in 1..n {
        let begin = time[0] + whole * i as f64 / n as f64;
        let first = time.partition_point(|t| *t <= begin + 1e-9) - 1;
        if first >= firsts[firsts.len() - 1] + FEWEST && first + FEWEST <= rows {
            firsts.push(first);
        }
    }
    firsts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 Hz.
    fn walk(rows: usize) -> Walk {
        Walk {
            episode: 0,
            rows: (0..rows).collect(),
            time: (0..rows).map(|k| 0.01 * k as f64).collect(),
            substeps: vec![5; rows - 1],
            ctrl: Vec::new(),
            at_steps: Vec::new(),
            segment: None,
        }
    }

    /// The rows of a walk that count.
    fn counted(walk: &Walk) -> std::ops::Range<usize> {
        let rows = &walk.rows[walk.segment.unwrap_or(0)..];
        rows[0]..rows[rows.len() - 1] + 1
    }

    #[test]
    fn without_contact_a_walk_stays_whole() {
        let walk = walk(300);
        assert_eq!(cut(&walk, &[false; 300], 0.25), [walk]);
    }

    #[test]
    fn every_row_counts_once() {
        let walk = walk(400);
        let touches: Vec<bool> = (0..400).map(|k| (150..230).contains(&k)).collect();
        let parts = cut(&walk, &touches, 0.25);
        let mut next = 0;
        for part in &parts {
            assert_eq!(counted(part).start, next);
            next = counted(part).end;
        }
        assert_eq!(next, 400);
        // Contact plus a tenth of a second on either side: rows 140 to 239 in four segments.
        assert_eq!(parts.len(), 6);
        assert_eq!(counted(&parts[1]), 140..165);
        assert_eq!(parts[1].segment, Some(10));
        assert_eq!(parts[0].segment, None);
        assert_eq!(parts[5].segment, None);
    }

    #[test]
    fn a_log_that_begins_with_contact_has_no_lead() {
        let walk = walk(100);
        let parts = cut(&walk, &[true; 100], 0.25);
        assert_eq!(parts[0].segment, Some(0));
        assert_eq!(parts.len(), 4);
    }

    #[test]
    fn a_log_can_be_one_segment_from_its_first_row_on() {
        let walk = walk(400);
        let touches: Vec<bool> = (0..400).map(|k| (150..230).contains(&k)).collect();
        assert_eq!(counted(&whole(&walk, &touches)), 0..400);
        assert_eq!(whole(&walk, &touches).segment, Some(0));
        assert_eq!(whole(&walk, &[false; 400]), walk);
    }

    #[test]
    fn a_stretch_of_contact_can_be_one_segment() {
        let walk = walk(400);
        let touches: Vec<bool> = (0..400).map(|k| (150..230).contains(&k)).collect();
        let parts = cut(&walk, &touches, f64::INFINITY);
        assert_eq!(parts.len(), 3);
        assert_eq!(counted(&parts[1]), 140..240);
    }

    /// Whether every row counts in one walk, in order, and every walk can be replayed.
    #[track_caller]
    fn assert_covers(walk: &Walk, parts: &[Walk]) {
        let mut next = 0;
        for part in parts {
            assert_eq!(counted(part).start, next);
            next = counted(part).end;
            assert!(part.len() > 1 && part.substeps.len() + 1 == part.len());
        }
        assert_eq!(next, walk.len());
        assert_eq!(firsts(parts), [0]);
        assert_eq!(parts[0].rows[0], 0);
    }

    fn at(time: Vec<f64>) -> Walk {
        Walk {
            rows: (0..time.len()).collect(),
            substeps: vec![5; time.len() - 1],
            time,
            ..walk(2)
        }
    }

    /// Symptom: a panic, "range end index 1 out of range for slice of length 0". Cause: a single
    /// row of contact can be no segment and was left out. If it was the first row, no walk began
    /// the episode.
    #[test]
    fn a_single_row_of_contact_is_a_segment_with_its_neighbours() {
        // A message that was sent once, half a second before the others.
        let early = |k: usize| if k == 0 { 0.0 } else { 0.49 + 0.01 * k as f64 };
        let walk = at((0..200).map(early).collect());
        let first: Vec<bool> = (0..200).map(|k| k == 0).collect();
        let parts = cut(&walk, &first, 0.25);
        assert_covers(&walk, &parts);
        assert_eq!(counted(&parts[0]), 0..2);
        // 5 Hz, and contact in any one row.
        let walk = at((0..20).map(|k| 0.2 * f64::from(k)).collect());
        for touching in 0..20 {
            let touches: Vec<bool> = (0..20).map(|k| k == touching).collect();
            assert_covers(&walk, &cut(&walk, &touches, 0.25));
        }
    }

    /// Symptom: readings on both sides of a dropout decided nothing. Cause: a segment was replayed
    /// over it, under a command that the machine may not have held.
    #[test]
    fn no_segment_leads_over_a_dropout() {
        // Two seconds are missing after 0.3 s, and half a second after 0.6 s.
        let missing = |k: usize| match k {
            0..30 => 0.0,
            30..60 => 2.0,
            _ => 2.5,
        };
        let walk = at((0..100).map(|k| 0.01 * k as f64 + missing(k)).collect());
        let longest = |duration: f64| {
            let parts = cut(&walk, &[true; 100], duration);
            assert_covers(&walk, &parts);
            let rows = parts.iter().flat_map(|p| p.time.windows(2));
            rows.map(|t| t[1] - t[0]).fold(0.0, f64::max)
        };
        assert!(longest(0.25) < 0.011, "{}", longest(0.25));
        // Half a second is within a segment of a second.
        assert!((longest(1.0) - 0.51).abs() < 1e-9, "{}", longest(1.0));
        assert!((longest(f64::INFINITY) - 2.01).abs() < 1e-9);
        // Three rows before a dropout are too few for a segment.
        let early = |k: usize| 0.01 * k as f64 + if k < 3 { 0.0 } else { 2.0 };
        let time: Vec<f64> = (0..40).map(early).collect();
        assert_eq!(stretches(&time, 0.25), [0, 40]);
        // Rows that are all far apart are no dropouts.
        let time: Vec<f64> = (0..20).map(f64::from).collect();
        assert_eq!(pieces(&time, 0.25), [0, 4, 8, 12, 16, 20]);
    }

    /// Symptom: logs were replayed from the state of another log. Cause: where rows are missing,
    /// pieces were far shorter than a segment, and the lead of the second one began at the first
    /// row as well.
    #[test]
    fn one_walk_begins_an_episode_however_its_rows_are_spaced() {
        let time = |k: usize| 0.01 * k as f64 + if k < 30 { 0.0 } else { 2.0 };
        let walk = at((0..60).map(time).collect());
        let parts = cut(&walk, &[true; 60], 0.25);
        assert_covers(&walk, &parts);
        assert_eq!(parts.iter().filter(|p| p.rows[0] == 0).count(), 1);
        // Two walks of the later episode begin at its first row.
        let mut walks = vec![parts[0].clone(); 3];
        walks[0].episode = 4;
        assert_eq!(firsts(&walks), [0, 1]);
        for duration in DURATIONS {
            for touching in 0..60 {
                let touches: Vec<bool> = (0..60).map(|k| k >= touching).collect();
                assert_covers(&walk, &cut(&walk, &touches, duration));
            }
        }
    }
}
