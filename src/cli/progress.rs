//! Progress bars on standard error, with the time left.

use std::io::Write as _;
use std::sync::Mutex;
use std::time::Duration;

use asid_core::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar for each stage, one after the other.
pub struct Bars {
    quiet: bool,
    bar: Mutex<Option<ProgressBar>>,
}

impl Bars {
    /// Bars that are drawn unless `quiet` or standard error is no terminal.
    pub fn new(quiet: bool) -> Self {
        Self {
            quiet,
            bar: Mutex::new(None),
        }
    }

    /// Prints lines above the bar.
    pub fn line(&self, text: &str) {
        let print = || {
            // A closed standard error is no reason to stop the work.
            let _ = writeln!(std::io::stderr(), "{text}");
        };
        self.with(|bar| match bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        });
    }

    fn with(&self, f: impl FnOnce(&mut Option<ProgressBar>)) {
        if let Ok(mut bar) = self.bar.lock() {
            f(&mut bar);
        }
    }
}

impl Progress for Bars {
    fn begin(&self, stage: &str, total: u64) {
        if self.quiet {
            return;
        }
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template(
            "{msg:24} {bar:30} {pos}/{len}  {elapsed} gone, {eta} left",
        ) {
            bar.set_style(style);
        }
        bar.set_message(stage.to_owned());
        bar.enable_steady_tick(Duration::from_millis(500));
        self.with(|b| *b = Some(bar));
    }

    fn advance(&self, units: u64) {
        self.with(|b| {
            if let Some(bar) = b {
                bar.inc(units);
            }
        });
    }

    fn note(&self, text: &str) {
        self.with(|b| {
            if let Some(bar) = b {
                bar.set_message(text.to_owned());
            }
        });
    }

    fn end(&self) {
        self.with(|b| {
            if let Some(bar) = b.take() {
                bar.finish_and_clear();
            }
        });
    }
}
