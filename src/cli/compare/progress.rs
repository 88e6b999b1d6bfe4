//! Progress of a comparison on standard error.

use std::io::{IsTerminal as _, Write as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use asid_comparison::cell::CellKey;

/// Time between two lines in a log, where no line can be overwritten.
const LOG: Duration = Duration::from_secs(30);

/// Counts finished cells.
pub struct Progress {
    quiet: bool,
    total: usize,
    begun: Instant,
    state: Mutex<State>,
}

struct State {
    done: usize,
    told: Option<Instant>,
}

impl Progress {
    /// Progress of this many cells.
    pub fn new(quiet: bool, total: usize) -> Self {
        Self {
            quiet,
            total,
            begun: Instant::now(),
            state: Mutex::new(State {
                done: 0,
                told: None,
            }),
        }
    }

    /// Counts a finished cell.
    pub fn advance(&self, key: &CellKey) {
        let Ok(mut state) = self.state.lock() else {
            return;
        };
        state.done += 1;
        let (done, total) = (state.done, self.total);
        let mut stderr = std::io::stderr().lock();
        let in_place = stderr.is_terminal();
        let due = in_place || done == total || state.told.is_none_or(|t| t.elapsed() >= LOG);
        if self.quiet || !due {
            return;
        }
        state.told = Some(Instant::now());
        let each = self.begun.elapsed().as_secs_f64() / done as f64;
        let left = each * (total - done) as f64;
        let text = format!("{done}/{total} runs, {left:.0} s left ({})", key.words());
        let _ = if in_place {
            write!(stderr, "\r{text:<110}")
        } else {
            writeln!(stderr, "{text}")
        };
    }

    /// Ends the progress line.
    pub fn end(&self) {
        let mut stderr = std::io::stderr().lock();
        let told = self.state.lock().is_ok_and(|s| s.told.is_some());
        if told && stderr.is_terminal() {
            let _ = writeln!(stderr);
        }
    }
}
