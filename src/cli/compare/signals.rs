//! How a comparison is stopped.
//!
//! SIGINT and SIGTERM end it at once. Finished cells are already on disk; running cells are lost.
//! SIGUSR1 ends it without loss: no further cell begins, and running cells are finished.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::Result;
use asid_comparison::shard::Shard;
use asid_comparison::store::no_writer;
use asid_core::Error;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;

use crate::cli::failure;
use crate::cli::interrupt::INTERRUPTED;
use crate::cli::shell;

/// Exit status after SIGTERM: the work is not finished.
const STOPPED: i32 = 1;

/// Text that says how to resume a comparison, or a share of it.
pub fn how_to_go_on(out: &Path, shard: Option<Shard>) -> String {
    let settings = out.join("config.toml").display().to_string();
    let out = out.display().to_string();
    let command = ["asid", "compare", "--config", &settings, "--out", &out].map(str::to_owned);
    let share = shard.map(|s| ["--shard".to_owned(), s.to_string()]);
    let command = shell::line(command.into_iter().chain(share.into_iter().flatten()));
    format!("`{command}` goes on with it")
}

/// The comparison to stop: the line that says how to resume it, and the flag that stops new cells.
struct Watched {
    line: String,
    drain: Arc<AtomicBool>,
}

/// The running comparison; a figure has several, one after the other.
static WATCHED: Mutex<Option<Watched>> = Mutex::new(None);

/// Watches for signals from now on; the returned flag is set when no further cell may begin.
///
/// # Errors
/// When the system refuses to.
pub fn watch(out: &Path, shard: Option<Shard>) -> Result<Arc<AtomicBool>> {
    let failed = |e: std::io::Error| Error::Failed(format!("cannot watch for signals: {e}"));
    let drain = Arc::new(AtomicBool::new(false));
    let watched = Watched {
        line: format!("stopped; {}", how_to_go_on(out, shard)),
        drain: Arc::clone(&drain),
    };
    let before = current().replace(watched);
    if before.is_some() {
        return Ok(drain);
    }
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1]).map_err(failed)?;
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || signals.forever().for_each(stop))
        .map_err(failed)?;
    Ok(drain)
}

fn current() -> MutexGuard<'static, Option<Watched>> {
    WATCHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Stops the work as the signal demands.
fn stop(signal: i32) {
    let current = current();
    let Some(watched) = &*current else { return };
    if signal == SIGUSR1 {
        watched.drain.store(true, Ordering::SeqCst);
        failure::note("told to stop: runs that have begun are finished");
    } else {
        // Let a file that is being written finish, and begin no other.
        let _held = no_writer();
        failure::note(&watched.line);
        let status = match signal {
            SIGINT => INTERRUPTED,
            _ => STOPPED,
        };
        signal_hook::low_level::exit(status);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a share that was stopped named a command that would run all shares.
    #[test]
    fn a_share_goes_on_as_a_share() {
        let shard = "2/4".parse::<Shard>().unwrap();
        let line = how_to_go_on(Path::new("a"), Some(shard));
        assert!(line.contains("--out a --shard 2/4`"), "{line}");
        assert!(!how_to_go_on(Path::new("a"), None).contains("--shard"));
    }
}
