//! Progress on standard error with the time left: a bar on a terminal, an occasional line
//! elsewhere.

use std::io::{IsTerminal as _, Write as _};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use asid_core::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two lines without a terminal. A log of an hour gets few lines, and the first comes
/// soon enough to show that the work proceeds.
const BETWEEN_LINES: Duration = Duration::from_secs(30);

/// A bar for each stage, one after the other; a line every half minute where standard error is no
/// terminal.
pub struct Bars {
    shown: Shown,
    stage: Mutex<Option<Stage>>,
}

/// What is shown.
#[derive(Clone, Copy, PartialEq)]
enum Shown {
    Nothing,
    Lines,
    Bars,
}

/// The current stage.
enum Stage {
    Bar(ProgressBar),
    Lines(Lines),
}

/// A stage whose progress is printed as lines.
struct Lines {
    name: String,
    done: u64,
    total: u64,
    begun: Instant,
    told: Instant,
}

impl Lines {
    /// The line that is due now, if any.
    fn due(&mut self) -> Option<String> {
        if self.told.elapsed() < BETWEEN_LINES {
            return None;
        }
        self.told = Instant::now();
        let gone = self.begun.elapsed().as_secs_f64();
        Some(told(&self.name, (self.done, self.total), gone))
    }
}

/// A stage as a line, after `gone` seconds.
fn told(name: &str, (done, total): (u64, u64), gone: f64) -> String {
    let left = gone * (total.max(done) - done) as f64 / done.max(1) as f64;
    match done {
        0 => format!("{name}: {gone:.0} s gone"),
        _ => format!("{name}: {done} of {total}, {gone:.0} s gone, {left:.0} s left"),
    }
}

impl Bars {
    /// Shows progress unless `quiet`.
    pub fn new(quiet: bool) -> Self {
        let shown = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Shown::Nothing,
            (false, true) => Shown::Bars,
            (false, false) => Shown::Lines,
        };
        Self {
            shown,
            stage: Mutex::new(None),
        }
    }

    /// Prints lines above the bar.
    pub fn line(&self, text: &str) {
        self.with(|stage| match stage {
            Some(Stage::Bar(bar)) => bar.suspend(|| print(text)),
            _ => print(text),
        });
    }

    fn with(&self, f: impl FnOnce(&mut Option<Stage>)) {
        if let Ok(mut stage) = self.stage.lock() {
            f(&mut stage);
        }
    }
}

/// Prints a line; a closed standard error does not stop the work.
fn print(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

impl Progress for Bars {
    fn begin(&self, stage: &str, total: u64) {
        let begun = match self.shown {
            Shown::Nothing => return,
            Shown::Lines => Stage::Lines(Lines {
                name: stage.to_owned(),
                done: 0,
                total,
                begun: Instant::now(),
                told: Instant::now(),
            }),
            Shown::Bars => {
                let target = ProgressDrawTarget::stderr();
                let bar = ProgressBar::with_draw_target(Some(total), target);
                let template = "{msg:24} {bar:30} {pos}/{len}  {elapsed} gone, {eta} left";
                if let Ok(style) = ProgressStyle::with_template(template) {
                    bar.set_style(style);
                }
                bar.set_message(stage.to_owned());
                bar.enable_steady_tick(Duration::from_millis(500));
                Stage::Bar(bar)
            }
        };
        self.with(|stage| *stage = Some(begun));
    }

    fn advance(&self, units: u64) {
        self.with(|stage| match stage {
            Some(Stage::Bar(bar)) => bar.inc(units),
            Some(Stage::Lines(lines)) => {
                lines.done += units;
                if let Some(line) = lines.due() {
                    print(&line);
                }
            }
            None => {}
        });
    }

    fn note(&self, text: &str) {
        self.with(|stage| match stage {
            Some(Stage::Bar(bar)) => bar.set_message(text.to_owned()),
            Some(Stage::Lines(lines)) => text.clone_into(&mut lines.name),
            None => {}
        });
    }

    fn end(&self) {
        self.with(|stage| {
            if let Some(Stage::Bar(bar)) = stage.take() {
                bar.finish_and_clear();
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn a_line_tells_the_time_left_at_the_rate_so_far() {
        assert_eq!(
            told("exploring", (10, 40), 20.0),
            "exploring: 10 of 40, 20 s gone, 60 s left"
        );
        assert_eq!(told("exploring", (0, 40), 31.0), "exploring: 31 s gone");
        assert_eq!(
            told("exploring", (3, 2), 9.0),
            "exploring: 3 of 2, 9 s gone, 0 s left"
        );
    }
}
