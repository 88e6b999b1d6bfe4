//! How long work tells that it goes on, and learns that it should stop.

/// Where progress is told to. Libraries never print.
pub trait Progress: Sync {
    /// A stage begins; `total` units of work are expected.
    fn begin(&self, stage: &str, total: u64);
    /// Some units are done.
    fn advance(&self, units: u64);
    /// The present figure of merit, in words.
    fn note(&self, _text: &str) {}
    /// How the explanations tried so far rank, best first: each with its figure of merit. `stage` says what it rests on.
    fn ranking(&self, _stage: &str, _rows: &[(String, f64)]) {}
    /// Whether the work is to end with what is known: what is under way stops at its next step, and nothing further begins.
    fn is_stopped(&self) -> bool {
        false
    }
    /// Whether the little that stopped work does for a good end, such as a last fit of the values that were found, is to stay undone too.
    fn is_late(&self) -> bool {
        self.is_stopped()
    }
    /// The stage is over.
    fn end(&self);
}

/// Progress of work that may go on until it is late: a search that has no last fit to come to, or that fit.
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

/// Progress that nobody looks at.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _units: u64) {}
    fn end(&self) {}
}
