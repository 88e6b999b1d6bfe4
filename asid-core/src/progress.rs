//! How long work reports its progress and learns that it should stop.

/// Receiver of progress reports. Libraries never print.
pub trait Progress: Sync {
    /// A stage begins; `total` units of work are expected.
    fn begin(&self, stage: &str, total: u64);
    /// `units` of work are done.
    fn advance(&self, units: u64);
    /// Reports the current figure of merit, as text.
    fn note(&self, _text: &str) {}
    /// Reports the ranking of the explanations tried so far, best first, each with its figure of
    /// merit.
    ///
    /// `stage` says what the ranking is based on.
    fn ranking(&self, _stage: &str, _rows: &[(String, f64)]) {}
    /// Whether to end the work with what is known: current work stops at its next step, and nothing
    /// further begins.
    fn is_stopped(&self) -> bool {
        false
    }
    /// Whether stopped work must also skip its short conclusion, such as a last fit of the values
    /// found.
    fn is_late(&self) -> bool {
        self.is_stopped()
    }
    /// The stage is finished.
    fn end(&self);
}

/// Progress of work that may continue until it is late: a search without a last fit to follow, or
/// that fit.
pub struct UntilLate<'a>(pub &'a dyn Progress);

impl Progress for UntilLate<'_> {
    fn begin(&self, stage: &str, total: u64) {
        self.0.begin(stage, total);
    }
    fn advance(&self, units: u64) {
        self.0.advance(units);
    }
    fn note(&self, text: &str) {
        self.0.note(text);
    }
    fn ranking(&self, stage: &str, rows: &[(String, f64)]) {
        self.0.ranking(stage, rows);
    }
    fn is_stopped(&self) -> bool {
        self.0.is_late()
    }
    fn end(&self) {
        self.0.end();
    }
}

/// Progress that nobody receives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _units: u64) {}
    fn end(&self) {}
}
