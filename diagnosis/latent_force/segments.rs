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
/// shorter than a row.
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
        near[first..last].fill(true);
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
    let rows = range.len();
    let seconds = walk.time[range.end - 1] - walk.time[range.start];
    let pieces = (seconds / duration).round() as usize;
    let pieces = pieces.clamp(1, (rows / FEWEST).max(1));
    for i in 0..pieces {
        let first = range.start + i * rows / pieces;
        let end = range.start + (i + 1) * rows / pieces;
        let begin = walk.time[first] - LEAD;
        let lead = walk.time[..first].partition_point(|t| *t < begin - 1e-9);
        if end - lead < 2 {
            continue;
        }
        let mut part = walk.part(lead..end);
        part.segment = Some(first - lead);
        out.push(part);
    }
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
}
