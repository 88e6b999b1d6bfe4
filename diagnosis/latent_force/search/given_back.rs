//! Removal of earlier names that a later name makes unnecessary.
//!
//! Forward selection cannot take back a name. A spring in series does a part of what a long delay
//! does, and beside it the delay is fitted to the rest. Without the spring the same delay is a
//! little longer, and makes up for everything.

use std::collections::BTreeSet;

use asid_core::Result;

use crate::latent_force::fit::{Extent, Slopes};

use super::Search;
use super::set::{Set, name_of, without};

impl Search<'_> {
    /// A set without those laws of the set `before` that its last name makes unnecessary, if there
    /// are any.
    ///
    /// A law is unnecessary if a fit without it costs no more evidence than a name must earn.
    /// Segments do not use this rule, because each of their fits costs as much as a round.
    pub(super) fn given_back(&self, set: &Set, before: &Set) -> Result<Option<Set>> {
        let (breadth, progress) = (self.breadth, self.progress);
        let named = |c: &&usize| !self.candidates[**c].is_tolerance;
        let law = |c: &usize| &*self.candidates[*c].spec.name;
        let laws: BTreeSet<&str> = before.candidates.iter().filter(named).map(law).collect();
        let mut fewer: Option<Set> = None;
        for earlier in laws {
            if self.context.has_segments() || progress.is_stopped() {
                break;
            }
            let out = before.candidates.iter().filter(named);
            let out: Vec<usize> = out.filter(|c| law(c) == earlier).copied().collect();
            let set = fewer.as_ref().unwrap_or(set);
            let mut smaller = out
                .into_iter()
                .fold(set.clone(), |set, c| without(&set, self.candidates, c));
            if !smaller.candidates.iter().any(|c| named(&c)) {
                continue;
            }
            let name = name_of(self.candidates, &smaller.candidates);
            progress.note(&format!("fitting {name} alone"));
            smaller.fitted.slopes = Slopes::default();
            let whole = Extent::from((breadth.rounds[1], progress));
            let rival = Some(set.fitted.evidence - self.threshold);
            smaller.fit(self.context, Extent { rival, ..whole })?;
            if !set.rises_above(&smaller, self.threshold) {
                fewer = Some(smaller);
            }
        }
        Ok(fewer)
    }
}
