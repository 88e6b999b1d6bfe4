//! Where the fit of a set begins.

use asid_core::Result;

use crate::latent_force::fit::taken_along;
use crate::latent_force::screen::Screened;

use super::round::Upon;
use super::screening::Screening;
use super::set::Set;

impl Upon<'_> {
    /// The base with the candidates of a set of a screening, at the values where a fit of it begins. Where bodies touch, starts of segments
    /// move with the values: what a link that is longer by a centimetre touches is then as far away as it was. A law that has no slope
    /// at its null begins at that of its start values whose replays of whole logs leave least: from a null at which a contact sticks no
    /// slope tells how far it is to where it slides, and segments that begin as the null has put them do not either.
    pub(super) fn begun(&self, screening: &Screening, screened: &Screened) -> Result<Set> {
        let mut best = self.enlarged(screening, screened);
        let forms = &screening.columns.forms;
        let is_secant = |f: usize| forms[f].slopes.iter().all(Option::is_none);
        if !self.context.has_segments() {
            return Ok(best);
        }
        if !screened.forms.iter().any(|&f| is_secant(f)) {
            let fitted = &mut best.fitted;
            let model = (&fitted.hypothesis, &fitted.theta[..]);
            let along = (
                &screening.columns.linear[..],
                &changes(screening, screened)[..],
            );
            fitted.estimate = taken_along(self.context, model, along, &fitted.estimate)?;
            return Ok(best);
        }
        let mut from = screened.clone();
        let mut least = (self.open_loop.excess)(&best)?;
        for i in 0..screened.forms.len() {
            let own = screened.forms[i];
            let like = |&f: &usize| is_secant(f) && forms[f].candidate == forms[own].candidate;
            for f in (0..forms.len()).filter(like) {
                if self.progress.is_stopped() {
                    return Ok(best);
                }
                let mut other = from.clone();
                other.forms[i] = f;
                other.coefficients[i] = vec![1.0; forms[f].slopes.len()];
                let set = self.enlarged(screening, &other);
                let left = (self.open_loop.excess)(&set)?;
                if left < least {
                    (least, best, from) = (left, set, other);
                }
            }
        }
        // Segments first find starts that go with those values, which would else go with the starts.
        let free = best.fitted.hypothesis.free();
        let hold = |set: &mut Set, free_too: bool| {
            let unknowns = &mut set.fitted.hypothesis.unknowns;
            free.iter().for_each(|&i| unknowns[i].free = free_too);
        };
        hold(&mut best, false);
        best.fit(self.context, (self.breadth.rounds[0], self.progress))?;
        hold(&mut best, true);
        Ok(best)
    }
}

/// Coefficients of a screened set, one a column of its screening.
fn changes(screening: &Screening, screened: &Screened) -> Vec<f64> {
    let columns = &screening.columns;
    let mut changes = vec![0.0; columns.center.len()];
    changes[..screened.base.len()].copy_from_slice(&screened.base);
    for (&f, coefficients) in screened.forms.iter().zip(&screened.coefficients) {
        let own = columns.forms[f].columns();
        changes[own].copy_from_slice(coefficients);
    }
    changes
}
