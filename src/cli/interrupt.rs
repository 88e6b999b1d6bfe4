//! Ctrl-C in commands whose result is written whole at the end, or not at all. One line says what
//! was stopped and what was written.

use std::io::{IsTerminal as _, Write as _};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use anyhow::Result;
use asid_core::Error;
use signal_hook::consts::SIGINT;
use signal_hook::iterator::Signals;
use signal_hook::low_level;

use super::failure;

/// Exit status after SIGINT, as shells count it.
pub const INTERRUPTED: i32 = 130;

/// Whether a result was written; the lock is held during writing.
static WRITTEN: Mutex<bool> = Mutex::new(false);

/// Locks the flag that says whether a result was written; the writer sets it.
///
/// An interruption waits while the lock is held, so that it finds a result whole or not begun.
pub fn writing() -> MutexGuard<'static, bool> {
    WRITTEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on Ctrl-C ends the process with a line that names what was stopped: `what`, such as
/// `the run of TASK`.
pub fn watch(what: &str) -> Result<()> {
    let failed = |e| Error::Failed(format!("cannot watch for signals: {e}"));
    let mut signals = Signals::new([SIGINT]).map_err(failed)?;
    let (what, begun) = (what.to_owned(), Instant::now());
    std::thread::spawn(move || {
        if signals.forever().next().is_some() {
            let written = writing();
            end_line();
            failure::note(&told(&what, begun.elapsed().as_secs_f64(), *written));
            // Threads of engines may still run, so exit without tearing anything down.
            low_level::exit(INTERRUPTED);
        }
    });
    Ok(())
}

/// Text on an interruption.
fn told(what: &str, seconds: f64, written: bool) -> String {
    let left = if written {
        "its result is written"
    } else {
        "nothing was written, so begin it again"
    };
    format!("Ctrl-C: {what} was stopped after {seconds:.0} s; {left}")
}

/// Moves past a progress bar on a terminal.
fn end_line() {
    let mut stderr = std::io::stderr();
    if stderr.is_terminal() {
        let _ = writeln!(stderr);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interruption_says_what_was_stopped_and_what_is_left() {
        let line = told("the run of sphere", 2.3, false);
        assert!(line.contains("the run of sphere was stopped after 2 s; nothing was written"));
        assert!(told("the run of sphere", 2.3, true).ends_with("its result is written"));
    }
}
