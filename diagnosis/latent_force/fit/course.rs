//! What a fit has come through: the evidence at each linearisation, and the best of them.

use super::{Fitted, MISLED};

/// The linearisations of a fit so far.
#[derive(Default)]
pub(super) struct Course {
    /// The best of all.
    best: Option<Fitted>,
    /// The best by slopes that were taken there: by those of a like model, or of another place, it may come out far too well.
    own: Option<Fitted>,
    /// Evidence at each.
    all: Vec<f64>,
    /// Evidence of the best after each.
    reached: Vec<f64>,
}

impl Course {
    /// Evidence of the best before a linearisation, by whose slopes, its `own` or not, it is `here`. Where own slopes show far less, the best by
    /// such takes the place of the best.
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

    /// Evidence of the best after each.
    pub(super) fn reached(&self) -> &[f64] {
        &self.reached
    }

    /// The best.
    pub(super) fn best(self) -> Option<Fitted> {
        self.best
    }
}
