//! Second screening of all candidates, about the trajectory of the leading set.
//!
//! The first screening uses the trajectory of the model without effects. Its speeds are as rough as
//! the missing force allows, and effects that depend on them show badly: dry friction changes sign
//! with each error of a speed's sign. The first set, whether right or not, makes up for a part of
//! the force. So its trajectory is nearly that of the machine. About it each candidate is screened
//! in place of the set.

use std::collections::BTreeSet;

use asid_core::Result;

use crate::latent_force::fit::{Slopes, rise};
use crate::latent_force::screen::{Pairs, Screened};

use super::prior::{log_prior, worth};
use super::round::Upon;
use super::savage_dickey::change_without;
use super::screening::Look;
use super::set::{Set, name_of, shared_values, simplest_first, without};
use super::tolerances::Tolerances;

/// Most sets that a second look tries: as many as a round fits to the end.
const TRIED: usize = 3;
/// Share of the leader's evidence that a set needs to be tried.
const SHARE: f64 = 0.5;

/// Candidates of a set, regardless of the order in which they were added.
pub(super) fn members(set: &Set) -> BTreeSet<usize> {
    set.candidates.iter().copied().collect()
}

/// Joins two lists of sets; of two sets with the same members the one with more evidence is kept.
pub(super) fn joined(mut sets: Vec<Set>, further: Vec<Set>) -> Vec<Set> {
    for set in further {
        match sets.iter_mut().find(|s| members(s) == members(&set)) {
            Some(like) if like.fitted.evidence >= set.fitted.evidence => {}
            Some(like) => *like = set,
            None => sets.push(set),
        }
    }
    sets
}

impl Upon<'_> {
    /// Adds to the sets that were `fitted` to the end those that a second look finds, best first.
    ///
    /// The second look is only for the model without effects. It is skipped if the leader of the
    /// `first` look leads the fits too, with no less evidence than it showed there. A pair that was
    /// named at once may then lead. In that case the better of its two names is a rival with
    /// tolerances, as it would be of a name added after it.
    pub(super) fn with_a_second_look(
        &self,
        fitted: Vec<Set>,
        (first, tolerances): (&Look, Option<&Tolerances>),
    ) -> Result<Vec<Set>> {
        let mut sets = self.in_order(fitted);
        let seen_well = |best: &Set| {
            let gain = best.fitted.evidence - self.base.fitted.evidence;
            let leader = first.ranked.first().filter(|s| gain >= s.gain);
            leader.is_some_and(|s| self.are_members(first, s, best))
        };
        let is_due = self.base.candidates.is_empty() && !self.context.has_segments();
        let best = sets
            .first()
            .filter(|_| is_due && !self.progress.is_stopped());
        let best = best.filter(|s| s.rises_above(self.base, self.threshold()) && !seen_well(s));
        let Some(best) = best else {
            return Ok(sets);
        };
        let further = self.in_place_of(best, &sets)?;
        sets = self.in_order(joined(sets, further));
        let names = self.base.names.count();
        let several = sets.first().filter(|s| s.names.count() > names + 1);
        if let (Some(several), Some(tolerances)) = (several, tolerances) {
            let reached = several.fitted.evidence;
            let beside = self.fewer_with(tolerances, several)?;
            let beside = self.finish(beside.into_iter().collect(), reached)?.sets;
            sets = self.in_order(joined(sets, beside));
        }
        Ok(sets)
    }

    /// A set of several names without the one whose removal costs least, with tolerances added,
    /// fitted briefly.
    fn fewer_with(&self, tolerances: &Tolerances, several: &Set) -> Result<Option<Set>> {
        let law = |c: usize| &*self.candidates[c].spec.name;
        let is_added =
            |c: &usize| !self.base.candidates.contains(c) && !self.candidates[*c].is_tolerance;
        let added: Vec<usize> = several
            .candidates
            .iter()
            .copied()
            .filter(is_added)
            .collect();
        let of_law = |name: &str| added.iter().copied().filter(|&c| law(c) == name).collect();
        let laws: BTreeSet<&str> = added.iter().map(|&c| law(c)).collect();
        let sites = laws.into_iter().map(of_law);
        let change = |out: &Vec<usize>| {
            change_without(self.candidates, several, out).unwrap_or(f64::NEG_INFINITY)
        };
        let out = sites.max_by(|a, b| change(a).total_cmp(&change(b)));
        let Some(out) = out.filter(|out| out.len() < added.len() && !self.progress.is_stopped())
        else {
            return Ok(None);
        };
        let fewer = out
            .into_iter()
            .fold(several.clone(), |set, c| without(&set, self.candidates, c));
        let mut set = tolerances.beside(&fewer, self.candidates);
        let name = name_of(self.candidates, &set.candidates);
        self.progress.note(&format!("trying {name}"));
        set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
        Ok(Some(set))
    }

    /// Whether the candidates of a set are those of a ranked set of a screening.
    fn are_members(&self, look: &Look, ranked: &Screened, set: &Set) -> bool {
        let own: BTreeSet<usize> = self.members(look, ranked).into_iter().collect();
        own == members(set)
    }

    /// The sets, best first.
    pub(super) fn in_order(&self, mut sets: Vec<Set>) -> Vec<Set> {
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        sets.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        let prior = |set: &Set| log_prior(self.context.plant(), self.candidates, &set.candidates);
        simplest_first(&mut sets, rise(self.context), &prior);
        sets
    }

    /// Fits to the end what a screening about the trajectory of the `best` set finds in its place,
    /// without the sets that were `fitted`.
    fn in_place_of(&self, best: &Set, fitted: &[Set]) -> Result<Vec<Set>> {
        let mut base = self.base.clone();
        base.fitted.estimate = best.fitted.estimate.clone();
        base.fitted.slopes = Slopes::default();
        shared_values(&mut base.fitted, &best.fitted);
        let about = Upon {
            base: &base,
            ..*self
        };
        let look = about.look(Pairs::BeyondTheBetter)?;
        let ranked = &look.ranked;
        let rows = ranked.iter().map(|s| (self.named(&look, s), s.gain));
        let rows: Vec<_> = rows.collect();
        self.progress.ranking("second look", &rows);
        let price = self.price();
        let lead = ranked.first().map_or(0.0, |s| s.worth(price));
        // About its own trajectory the best set shows as well as any other.
        let own = ranked.iter().find(|s| about.are_members(&look, s, best));
        let own = own.map_or(0.0, |s| s.worth(price) - self.breadth.near);
        let least = own.max(SHARE * lead);
        let mut known: Vec<BTreeSet<usize>> = fitted.iter().map(members).collect();
        let mut sets = Vec::new();
        for s in ranked.iter().filter(|s| s.worth(price) >= least) {
            if sets.len() == TRIED || self.progress.is_stopped() {
                break;
            }
            let mut set = about.enlarged(&look, s);
            if known.contains(&members(&set)) {
                continue;
            }
            known.push(members(&set));
            let name = self.named(&look, s);
            self.progress.note(&format!("trying {name}"));
            set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
            sets.push(set);
        }
        Ok(self.finish(sets, best.fitted.evidence)?.sets)
    }
}
