//! The course of a fit: the evidence at each linearisation, and the best one.

use super::{Fitted, MISLED};

/// The linearisations of a fit so far.
#[derive(Default)]
pub(super) struct Course {
    /// The best linearisation.
    best: Option<Fitted>,
    /// The best with derivatives taken at that point; those of a similar model, or of another
    /// point, may overstate the evidence.
    own: Option<Fitted>,
    /// Evidence at each linearisation.
    all: Vec<f64>,
    /// Best evidence after each linearisation.
    reached: Vec<f64>,
}

impl Course {
    /// Returns the best evidence before a linearisation whose evidence is `here`, by its `own`
    /// derivatives or by others.
    ///
    /// If its own derivatives show far less than the best, the best by own derivatives replaces it.
    pub(super) fn before(&mut self, here: f64, is_own: bool) -> Option<f64> {
        let misled = |best: &Fitted| best.evidence - here > MISLED;
        if is_own && self.best.as_ref().is_some_and(misled) {
            self.best.clone_from(&self.own);
        }
        self.best.as_ref().map(|b| b.evidence)
    }

    /// Adds a linearisation.
    pub(super) fn add(&mut self, here: f64, is_own: bool, fitted: impl Fn() -> Fitted) {
        self.all.push(here);
        let is_better = |than: &Option<Fitted>| than.as_ref().is_none_or(|b| here > b.evidence);
        if is_better(&self.best) {
            self.best = Some(fitted());
        }
        if is_own && is_better(&self.own) {
            self.own = Some(fitted());
        }
        self.reached.extend(self.best.as_ref().map(|b| b.evidence));
    }

    /// Evidence at each linearisation.
    pub(super) fn all(&self) -> &[f64] {
        &self.all
    }

    /// Best evidence after each linearisation.
    pub(super) fn reached(&self) -> &[f64] {
        &self.reached
    }

    /// Returns the best linearisation.
    pub(super) fn best(self) -> Option<Fitted> {
        self.best
    }
}
