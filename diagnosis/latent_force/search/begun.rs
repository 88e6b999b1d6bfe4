//! Where the fit of a set begins.

use asid_core::Result;

use crate::findings::NEGLIGIBLE;
use crate::latent_force::fit::taken_along;
use crate::latent_force::screen::Screened;

use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Fractions of the predicted distance from the null at which whole logs are replayed, besides the
/// full distance.
///
/// They are factors of two, because a fit converges from half or twice its values.
const PARTS: [f64; 4] = [0.25, 0.5, 2.0, 4.0];

impl Upon<'_> {
    /// The base with the candidates of a screened set, at the values where its fit begins.
    ///
    /// In segments, initial states move with the values, so that a link that becomes a centimetre
    /// longer keeps its distance from what it touches. A law without a derivative at its null
    /// begins at the start value whose replays of whole logs leave least. If a contact sticks at
    /// the null, no derivative shows at which value it slides. Segments whose initial states come
    /// from the null do not show it either.
    pub(super) fn begun(&self, look: &Look, screened: &Screened) -> Result<Set> {
        let mut best = self.enlarged(look, screened);
        let forms = &look.columns.forms;
        if !self.context.has_segments() {
            return Ok(best);
        }
        if !screened.forms.iter().any(|&f| look.is_secant(f)) {
            if let Some(further) = self.further(&best)? {
                return self.with_starts(further);
            }
            let fitted = &mut best.fitted;
            let model = (&fitted.hypothesis, &fitted.theta[..]);
            let along = (&look.columns.linear[..], &changes(look, screened)[..]);
            fitted.estimate = taken_along(self.context, model, along, &fitted.estimate)?;
            return Ok(best);
        }
        let mut from = screened.clone();
        let mut least = (self.open_loop.excess)(&best)?;
        for i in 0..screened.forms.len() {
            let own = screened.forms[i];
            let like = |&f: &usize| look.is_secant(f) && forms[f].candidate == forms[own].candidate;
            for f in (0..forms.len()).filter(like) {
                if self.progress.is_stopped() {
                    return Ok(best);
                }
                let mut other = from.clone();
                other.forms[i] = f;
                other.coefficients[i] = vec![1.0; forms[f].slopes.len()];
                let set = self.enlarged(look, &other);
                let left = (self.open_loop.excess)(&set)?;
                if left < least {
                    (least, best, from) = (left, set, other);
                }
            }
        }
        self.with_starts(best)
    }

    /// An enlarged set with its added values at another distance from their nulls, if replays of
    /// whole logs then leave far less.
    ///
    /// They must leave less than half of what they leave at the present values and at the null. A
    /// derivative at the null gives the direction, and only replays show how far it holds: a
    /// threefold rebound of a contact does not do three times as much. The set stays as it is if
    /// the base leaves no more than another program's version of the same machine would.
    pub(super) fn further(&self, set: &Set) -> Result<Option<Set>> {
        let excess = |set: &Set| (self.open_loop.excess)(set);
        let stands = excess(self.base)?;
        if stands < NEGLIGIBLE * NEGLIGIBLE {
            return Ok(None);
        }
        let mut least = MOST * excess(set)?.min(stands);
        let mut best = None;
        for part in PARTS {
            if self.progress.is_stopped() {
                return Ok(None);
            }
            let other = self.at(set, part);
            let left = excess(&other)?;
            if left < least {
                (least, best) = (left, Some(other));
            }
        }
        Ok(best)
    }

    /// An enlarged set with the added values at a fraction (`part`) of their distance from their
    /// nulls, within their bounds.
    pub(super) fn at(&self, set: &Set, part: f64) -> Set {
        let own = self.base.fitted.theta.len()..;
        let mut other = set.clone();
        let values = &mut other.fitted.theta[own.clone()];
        let unknowns = &set.fitted.hypothesis.unknowns[own];
        for (value, u) in values.iter_mut().zip(unknowns) {
            let moved = u.center + part * (*value - u.center);
            *value = moved.clamp(u.bounds[0], u.bounds[1]);
        }
        other
    }

    /// A set whose segments first find initial states that fit its values; otherwise the values
    /// would adapt to the initial states.
    pub(super) fn with_starts(&self, mut set: Set) -> Result<Set> {
        let free = set.fitted.hypothesis.free();
        let hold = |set: &mut Set, free_too: bool| {
            let unknowns = &mut set.fitted.hypothesis.unknowns;
            free.iter().for_each(|&i| unknowns[i].free = free_too);
        };
        hold(&mut set, false);
        set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
        hold(&mut set, true);
        Ok(set)
    }
}

/// Coefficients of a screened set, one for each column of its screening.
fn changes(look: &Look, screened: &Screened) -> Vec<f64> {
    let columns = &look.columns;
    let mut changes = vec![0.0; columns.center.len()];
    changes[..screened.base.len()].copy_from_slice(&screened.base);
    for (&f, coefficients) in screened.forms.iter().zip(&screened.coefficients) {
        let own = columns.forms[f].columns();
        changes[own].copy_from_slice(coefficients);
    }
    changes
}
