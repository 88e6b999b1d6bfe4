//! A second look at all candidates, about the trajectory of what leads.
//!
//! The first screening is about the trajectory of the model without effects. Its speeds are as rough as the missing force lets them be, and
//! what depends on them is seen badly: dry friction turns round with each error of a speed's sign. What a first set makes up for, whether it is the
//! right one or not, leaves a trajectory that is nearly the machine's. About that one each candidate is asked what it would do in the
//! place of the set.

use std::collections::BTreeSet;

use asid_core::Result;

use crate::latent_force::fit::{Slopes, rise};
use crate::latent_force::screen::{Pairs, Screened};

use super::prior::worth;
use super::prune::change_without;
use super::round::Upon;
use super::screening::Look;
use super::set::{Set, name_of, shared_values, simplest_first, without};
use super::tolerances::Tolerances;

/// Sets that a second look tries, at most: as many as a round fits to the end.
const TRIED: usize = 3;
/// Share of the leader's evidence that a set needs to be tried.
const SHARE: f64 = 0.5;

/// Candidates of a set, in whatever order they were added.
pub(super) fn members(set: &Set) -> BTreeSet<usize> {
    set.candidates.iter().copied().collect()
}

/// Some sets and further ones; of those with the same members the one with more evidence.
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
    /// Sets that were `fitted` to the end and, upon no effect, what a second look finds in their place, best first. None is taken where the set that
    /// led the `first` look leads the fits too, with no less evidence than it had shown: that look has seen well. Where a pair leads that was named
    /// at once, the better of the two with what an ordinary machine has of everything beside it is a rival, as it would be of a name that
    /// comes after it.
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
        let several = sets.first().filter(|s| s.names > self.base.names + 1);
        if let (Some(several), Some(tolerances)) = (several, tolerances) {
            let reached = several.fitted.evidence;
            let beside = self.fewer_with(tolerances, several)?;
            let beside = self.finish(beside.into_iter().collect(), reached)?.sets;
            sets = self.in_order(joined(sets, beside));
        }
        Ok(sets)
    }

    /// A set of several names without the one that is missed least, tolerances beside it, fitted a little.
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

    /// Whether the candidates of a set are those that some look has ranked together.
    fn are_members(&self, look: &Look, ranked: &Screened, set: &Set) -> bool {
        let own: BTreeSet<usize> = self.members(look, ranked).into_iter().collect();
        own == members(set)
    }

    /// The sets, best first.
    pub(super) fn in_order(&self, mut sets: Vec<Set>) -> Vec<Set> {
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        sets.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        simplest_first(&mut sets, rise(self.context));
        sets
    }

    /// What a screening about the trajectory of the `best` of some sets finds in its place, fitted to the end, without those that were `fitted`.
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
        // About its own trajectory the best one is seen as well as any other.
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
