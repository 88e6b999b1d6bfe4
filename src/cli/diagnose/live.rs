//! A running diagnosis: bars, current rankings, and its end.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use anyhow::Result;
use asid_core::{Error, Progress};
use signal_hook::consts::SIGINT;

use super::super::interrupt::INTERRUPTED;
use super::super::progress::Bars;

/// Share of the time limit after which the search takes up nothing new. A larger share tries more
/// and leaves less time for fitting values.
const SEARCHING: f64 = 0.75;
/// Share of the time limit after which fits to whole replays end. The last replays and the report
/// take the rest (5 to 15 % of the time of diagnoses of 5 s to a minute).
const FITTING: f64 = 0.87;
/// Number of rows of a ranking that are printed.
const ROWS: usize = 5;
/// Characters of a name that are printed; the name of a group of many joints is long.
const WIDEST: usize = 90;

/// Progress on standard error, which ends the work at a time limit or at the first Ctrl-C. A second
/// Ctrl-C ends the process at once.
pub struct Live {
    bars: Bars,
    quiet: bool,
    begun: Instant,
    /// Time limit of a diagnosis, minutes.
    minutes: Option<f64>,
    /// End times of the search and of the fits; none before a diagnosis starts.
    until: [Option<Instant>; 2],
    interrupted: Arc<AtomicBool>,
    told: AtomicBool,
    first_table: OnceLock<f64>,
}

impl Live {
    /// Starts the clock; `minutes` is the time limit of each diagnosis.
    pub fn new(quiet: bool, minutes: Option<f64>) -> Self {
        Self {
            bars: Bars::new(quiet),
            quiet,
            begun: Instant::now(),
            minutes,
            until: [None; 2],
            interrupted: Arc::new(AtomicBool::new(false)),
            told: AtomicBool::new(false),
            first_table: OnceLock::new(),
        }
    }

    /// Starts a diagnosis: its time limit counts from now on.
    pub fn start(&mut self) {
        let begun = Instant::now();
        let minutes = self.minutes;
        self.until = [SEARCHING, FITTING].map(|share| {
            let limit = minutes.map(|m| Duration::from_secs_f64(60.0 * share * m));
            limit.and_then(|l| begun.checked_add(l))
        });
        *self.told.get_mut() = false;
    }

    /// Starts a diagnosis. From now on the first Ctrl-C ends the search, and a second one ends the
    /// process.
    pub fn watch(&mut self) -> Result<()> {
        self.start();
        let failed = |e| Error::Failed(format!("cannot watch for signals: {e}"));
        let flag = || Arc::clone(&self.interrupted);
        // The order matters: the first signal finds the flag clear, then sets it.
        signal_hook::flag::register_conditional_shutdown(SIGINT, INTERRUPTED, flag())
            .map_err(failed)?;
        signal_hook::flag::register(SIGINT, flag()).map_err(failed)?;
        Ok(())
    }

    fn is_past(&self, end: usize) -> bool {
        self.until[end].is_some_and(|until| Instant::now() >= until)
    }

    /// Whether Ctrl-C was pressed; `is_stopped` is also true when the time is up.
    pub fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::SeqCst)
    }

    /// Elapsed time, s.
    pub fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// Time until the first ranking, s.
    pub fn seconds_to_first_table(&self) -> Option<f64> {
        self.first_table.get().copied()
    }
}

/// A ranking as lines.
fn table(stage: &str, seconds: f64, rows: &[(String, f64)]) -> String {
    let mut text = format!("{seconds:.1} s, {stage}:");
    for (name, value) in rows.iter().take(ROWS) {
        let mut name: String = name.clone();
        if name.chars().count() > WIDEST {
            name = name.chars().take(WIDEST - 1).chain(['…']).collect();
        }
        let _ = write!(text, "\n  {value:>9.1}  {name}");
    }
    if rows.len() > ROWS {
        let _ = write!(text, "\n  and {} more", rows.len() - ROWS);
    }
    text
}

impl Progress for Live {
    fn begin(&self, stage: &str, total: u64) {
        self.bars.begin(stage, total);
    }

    fn advance(&self, units: u64) {
        self.bars.advance(units);
    }

    fn note(&self, text: &str) {
        self.bars.note(text);
    }

    fn ranking(&self, stage: &str, rows: &[(String, f64)]) {
        let seconds = self.seconds();
        let first = self.first_table.set(seconds).is_ok();
        if self.quiet || rows.is_empty() {
            return;
        }
        let stage = if first {
            format!("first table, {stage} (evidence, natural logarithm)")
        } else {
            stage.to_owned()
        };
        self.bars.line(&table(&stage, seconds, rows));
    }

    fn is_stopped(&self) -> bool {
        let interrupted = self.is_interrupted();
        let stopped = interrupted || self.is_past(0);
        if stopped && !self.quiet && !self.told.swap(true, Ordering::SeqCst) {
            let why = if interrupted {
                "stopping: what is known is written; Ctrl-C once more ends at once"
            } else {
                "the time is up: what is known is written"
            };
            self.bars.line(why);
        }
        stopped
    }

    fn is_late(&self) -> bool {
        self.is_interrupted() || self.is_past(1)
    }

    fn end(&self) {
        self.bars.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stops_when_the_time_is_up_or_at_an_interruption_and_knows_when_the_first_table_came() {
        let live = Live::new(true, None);
        assert!(!live.is_stopped() && live.seconds_to_first_table().is_none());
        live.ranking("screening", &[("a@x".into(), 3.0)]);
        let first = live.seconds_to_first_table();
        live.ranking("fits", &[]);
        assert_eq!(live.seconds_to_first_table(), first);
        live.interrupted.store(true, Ordering::SeqCst);
        assert!(live.is_stopped() && live.is_interrupted());
        assert!(live.is_late());
        let mut over = Live::new(true, Some(0.0));
        over.start();
        assert!(over.is_stopped() && over.is_late());
        let mut long = Live::new(true, Some(1e9));
        long.start();
        assert!(!long.is_stopped());
    }

    /// Symptom: after long runs of a task the search had no time, and the task was not tried again.
    /// Cause: the limit counted from before the runs, and its end was taken for an interruption.
    #[test]
    fn the_time_limit_counts_from_the_start_of_a_diagnosis_and_its_end_is_no_interruption() {
        let mut live = Live::new(true, Some(0.0));
        assert!(!live.is_stopped() && !live.is_late());
        live.start();
        assert!(live.is_stopped() && live.is_late());
        assert!(!live.is_interrupted());
        live.minutes = Some(1e9);
        live.start();
        assert!(!live.is_stopped());
    }

    #[test]
    fn a_ranking_is_cut_to_what_a_terminal_shows() {
        let rows: Vec<(String, f64)> = (0..7).map(|i| ("é".repeat(200), f64::from(i))).collect();
        let text = table("screening", 2.04, &rows);
        assert!(text.starts_with("2.0 s, screening:\n        0.0  é"));
        assert!(text.ends_with("and 2 more"));
        assert!(text.lines().all(|l| l.chars().count() < WIDEST + 15));
    }
}
