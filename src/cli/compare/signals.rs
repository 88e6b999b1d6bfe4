//! How a comparison is stopped.
//!
//! SIGINT and SIGTERM end it at once: finished cells are files already, and those that run are
//! lost. SIGUSR1 ends it without loss: no cell is begun any more, and those that run are finished.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Result;
use asid_comparison::store::no_writer;
use asid_core::Error;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;

use crate::cli::failure;

/// Status of a process that did not do all its work.
const STOPPED: i32 = 1;

/// What goes on with a comparison.
pub fn how_to_go_on(out: &Path) -> String {
    let out = out.display();
    format!("`asid compare --config {out}/config.toml --out {out}` goes on with it")
}

/// Watches for signals from now on; the word is set once no cell is to be begun.
///
/// # Errors
/// When the system refuses to.
pub fn watch(out: &Path) -> Result<Arc<AtomicBool>> {
    let failed = |e: std::io::Error| Error::Failed(format!("cannot watch for signals: {e}"));
    let drain = Arc::new(AtomicBool::new(false));
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1]).map_err(failed)?;
    let word = Arc::clone(&drain);
    let line = format!("stopped; {}", how_to_go_on(out));
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || {
            for signal in signals.forever() {
                if signal == SIGUSR1 {
                    word.store(true, Ordering::SeqCst);
                    failure::note("told to stop: runs that have begun are finished");
                } else {
                    // A file that is being written is finished, and no other one begun.
                    let _held = no_writer();
                    failure::note(&line);
                    signal_hook::low_level::exit(STOPPED);
                }
            }
        })
        .map_err(failed)?;
    Ok(drain)
}
