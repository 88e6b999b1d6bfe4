//! A path of a search: names added one after the other to a set that stands.

use asid_core::Result;

use crate::latent_force::fit::Fitted;

use super::measure::Measure;
use super::open_loop::OpenLoopGap;
use super::prior::worth;
use super::round::{Round, Upon};
use super::set::Set;
use super::{
    FURTHER, GIVEN, Search, Untried, fit_from, has_tolerances, is_cut_short, open_upon,
    upon_tolerances,
};

/// State of a path.
pub(super) struct Path {
    /// The rounds so far.
    pub(super) rounds: Vec<Round>,
    /// The set that stands.
    pub(super) best: Set,
    /// What was left out because the search was stopped.
    pub(super) untried: Vec<Untried>,
}

impl Path {
    /// A path that begins with a set.
    pub(super) fn from(best: Set) -> Self {
        Self {
            rounds: Vec::new(),
            best,
            untried: Vec::new(),
        }
    }

    /// Adds a set to the fits of the last round, if no round has it.
    ///
    /// A set that was reduced to the names it needs may have been fitted in none.
    fn remember(&mut self, set: &Set) {
        let mut fitted = self.rounds.iter().flat_map(|r| &r.confirmed);
        let is_known = fitted.any(|s| s.candidates == set.candidates);
        if let Some(last) = self.rounds.last_mut().filter(|_| !is_known) {
            last.confirmed.push(set.clone());
        }
    }

    /// Joins this path with one that began from another set of its first round; the end that is
    /// worth more stands.
    ///
    /// The rounds of both are kept, those of the better path last.
    pub(super) fn or(mut self, mut other: Self, worth: impl Fn(&Set) -> f64) -> Self {
        self.untried.append(&mut other.untried);
        let own = self.rounds.split_off(self.rounds.len().min(1));
        let [before, after] = if worth(&other.best) > worth(&self.best) {
            self.best = other.best;
            [own, other.rounds]
        } else {
            [other.rounds, own]
        };
        self.rounds.extend(before);
        self.rounds.extend(after);
        self
    }
}

impl Search<'_> {
    /// The set of the first round from which a second path begins, if something was missing beside
    /// the set that was taken.
    ///
    /// The set must be nearly as likely as the one taken: the difference is below the threshold of
    /// a name. Any distance is allowed if the rounds of the path are used up although a further name
    /// earns its evidence, since the set that was taken may have left that evidence. A name that earns
    /// its evidence and makes up for too little is no reason: small errors of a machine do too.
    pub(super) fn second(&self, path: &Path) -> Option<Set> {
        let [first, further, ..] = &path.rounds[..] else {
            return None;
        };
        let taken = &further.base;
        if path.best.candidates.is_empty() {
            return None;
        }
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        let of_taken = first.confirmed.iter().find(|s| s.candidates == *taken)?;
        let last = path.rounds.last()?;
        let names = path.best.names.count();
        let earns = |s: &Set| s.names.count() > names && s.rises_above(&path.best, self.threshold);
        let is_left = last.base == path.best.candidates && last.confirmed.iter().any(earns);
        let near = |s: &&Set| {
            s.candidates != *taken
                && !has_tolerances(self.candidates, s)
                && (is_left || worth(s) > worth(of_taken) - self.threshold)
        };
        let others = first.confirmed.iter().filter(near);
        let best = others.max_by(|a, b| worth(a).total_cmp(&worth(b)));
        best.cloned()
    }

    /// Adds names one after the other as long as they earn it.
    ///
    /// `none` is the fitted model without effects; a better fit of it replaces it when one is
    /// found.
    ///
    /// If no set counts, a name that earns its evidence and makes up for too little to count is
    /// used once as a trial base. For example, neither a late drive nor a drifting sensor closes
    /// much of the gap alone, and both together close all of it. The result stands if it counts as
    /// a whole and each part is needed.
    pub(super) fn follow(&self, mut path: Path, none: &mut Fitted) -> Result<Path> {
        let Search {
            context,
            candidates,
            breadth,
            progress,
            at_first,
            threshold,
            ..
        } = *self;
        let how = (breadth, progress);
        let left = |s: &Set| s.fitted.estimate.missing(context).relative_to(at_first);
        // Trial base that does not count by itself.
        let mut tentative: Option<Set> = None;
        let mut depth = breadth.depth.saturating_sub(path.best.names.count());
        let mut gap = OpenLoopGap::by(self.open_loop);
        while path.rounds.len() < depth {
            let no_force = left(&path.best) < breadth.shrinks;
            if no_force && !gap.is_left(context, (none, &path.best), how)? {
                break;
            }
            // The first screening always runs: it is the least that an answer rests on.
            if !path.rounds.is_empty() && progress.is_stopped() {
                path.untried.push(Untried::upon(&path.best, FURTHER));
                break;
            }
            let base = tentative.clone().unwrap_or_else(|| path.best.clone());
            let (round, confirmed) = self.round(&base, &mut path.untried)?;
            path.rounds.push(round);
            let stopped = progress.is_stopped();
            let further = (confirmed.first(), threshold);
            if tentative.is_none() {
                fit_from(context, further, (&mut path.best, none), how)?;
            }
            let best = &path.best;
            if is_cut_short(context, best, progress) {
                path.untried.push(Untried::upon(best, FURTHER));
                break;
            }
            let measure = Measure {
                search: self,
                stands: best,
                no_force,
                gap: &gap,
                cut_short: stopped && best.candidates.is_empty(),
            };
            let next = measure.first(&confirmed, tentative.as_ref())?;
            let was_tried = tentative.take().is_some();
            let last = path.rounds.last_mut().filter(|_| !was_tried);
            let Some(next) =
                upon_tolerances(context, candidates, (best, next, at_first), last, how)?
            else {
                let names = best.names.count();
                let is_name = |s: &&Set| s.names.count() > names && s.rises_above(best, threshold);
                let leads = confirmed.iter().find(is_name);
                tentative = leads.filter(|_| !was_tried && !stopped).cloned();
                if tentative.is_none() {
                    break;
                }
                continue;
            };
            if has_tolerances(candidates, &next) && !has_tolerances(candidates, best) {
                // Tolerances are no name.
                depth += 1;
            }
            let smaller = match self.freed_instead(&next)? {
                None => self.given_back(&next, best)?,
                freed => freed,
            };
            if let Some(smaller) = smaller {
                let last = path.rounds.last_mut();
                last.into_iter()
                    .for_each(|round| round.confirmed.push(smaller.clone()));
                path.best = smaller;
            } else {
                path.remember(&next);
                path.best = next;
            }
            if stopped {
                path.untried.push(Untried::upon(&path.best, GIVEN));
                break;
            }
            if let Some(freed) = self.freed(&path.best)? {
                path.best = freed;
            }
        }
        Ok(path)
    }

    /// Runs a round upon a set, and returns it with the sets that it has fitted to the end.
    fn round(&self, base: &Set, untried: &mut Vec<Untried>) -> Result<(Round, Vec<Set>)> {
        let open = open_upon(self.candidates, self.known, base);
        let round = self.upon(base, &open).round(untried)?;
        let confirmed = round.confirmed.clone();
        Ok((round, confirmed))
    }

    /// The input of a round upon a set, with its `open` candidates.
    pub(super) fn upon<'u>(&'u self, base: &'u Set, open: &'u [usize]) -> Upon<'u> {
        Upon {
            context: self.context,
            base,
            priors: &base.fitted.estimate,
            at_first: self.at_first,
            candidates: self.candidates,
            open,
            breadth: self.breadth,
            open_loop: self.open_loop,
            progress: self.progress,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latent_force::search::by_hand;

    #[test]
    fn a_set_that_no_round_has_fitted_is_one_of_the_last() {
        let labels = ["coulomb-friction@a", "actuator-delay@m"];
        let candidates = labels.map(by_hand::candidate);
        let set = |names: &[&[usize]]| by_hand::set(&candidates, (names, &[]), 9.0);
        let [dry, both, late] = [set(&[&[0]]), set(&[&[0], &[1]]), set(&[&[1]])];
        let mut path = Path::from(dry.clone());
        path.rounds = vec![
            by_hand::round(&[], &[], (&[], vec![dry.clone()])),
            by_hand::round(&[0], &[], (&[], vec![both])),
        ];
        // The delay makes the friction unnecessary that it was added to.
        for set in [&late, &dry, &late] {
            path.remember(set);
        }
        let fits: Vec<usize> = path.rounds.iter().map(|r| r.confirmed.len()).collect();
        assert_eq!(fits, [1, 2]);
        assert_eq!(path.rounds[1].confirmed[1].candidates, [1]);
    }
}
