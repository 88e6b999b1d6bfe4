//! Twins of the set that stands: sets of other names that no fit has separated from it.
//!
//! A servo's damping and the friction of its joint are equivalent while the drive stays within its
//! force limit. A search continues from one of the two. Whatever is then added to it, tolerances or
//! a further name, would raise it above the other. A twin gets the same additions.

use asid_core::Result;

use crate::candidate::Candidate;
use crate::latent_force::fit::rise;

use super::confused::is_confused;
use super::path::Path;
use super::prior::{log_prior, worth};
use super::set::{Set, without};
use super::{Search, is_within};

/// Most twins that are fitted.
const MOST: usize = 2;

/// The candidates of `best` to remove and those to insert, if `ahead` and `other` are exchanged in
/// it.
///
/// `best` was built from `ahead`. `None` if `best` does not contain all of `ahead` or is no larger.
/// Also `None` if `best` already contains some of what is to be inserted, or if nothing is removed
/// or inserted.
fn exchanged(best: &[usize], ahead: &[usize], other: &[usize]) -> Option<[Vec<usize>; 2]> {
    let not_in = |a: &[usize], b: &[usize]| -> Vec<usize> {
        let own = a.iter().filter(|c| !b.contains(c));
        own.copied().collect()
    };
    let (out, into) = (not_in(ahead, other), not_in(other, ahead));
    let is_part = not_in(ahead, best).is_empty() && ahead.len() < best.len();
    let is_new = not_in(&into, best).len() == into.len();
    (is_part && is_new && !out.is_empty() && !into.is_empty()).then_some([out, into])
}

/// Adds to a set a candidate of another set, with the values that it has there.
fn with_that_of(set: &Set, other: &Set, candidates: &[Candidate], candidate: usize) -> Set {
    let mut set = set.clone();
    let Some(place) = other.candidates.iter().position(|&c| c == candidate) else {
        return set;
    };
    let lengths =
        |c: &[usize]| -> usize { c.iter().map(|&c| candidates[c].parameters().len()).sum() };
    let theirs = &other.fitted;
    let study = theirs.theta.len() - lengths(&other.candidates);
    let first = study + lengths(&other.candidates[..place]);
    let range = first..first + candidates[candidate].parameters().len();
    let fitted = &mut set.fitted;
    fitted.theta.extend(&theirs.theta[range.clone()]);
    let unknowns = theirs.hypothesis.unknowns[range].iter().cloned();
    fitted.hypothesis.unknowns.extend(unknowns);
    let spec = theirs.hypothesis.specs[place].clone();
    fitted.hypothesis.specs.push(spec);
    set.candidates.push(candidate);
    set
}

impl Search<'_> {
    /// Tolerances of a set that belong to the same effects at the same sites as some candidates.
    fn within_tolerance(&self, set: &Set, some: &[usize]) -> Vec<usize> {
        let candidates = self.candidates;
        let labels: Vec<String> = some.iter().map(|&c| candidates[c].label()).collect();
        let own = set.candidates.iter().copied();
        own.filter(|&c| candidates[c].is_tolerance && labels.contains(&candidates[c].label()))
            .collect()
    }

    /// The best set of a path with one candidate replaced by one that is easily mistaken for it;
    /// refitted.
    ///
    /// The new candidate is that of a set which the path has fitted and found behind the best one.
    /// The fit of that set may have been given up, or have ended, far from the values at which the
    /// two are equivalent. Of a tilt and a force of any direction, the force also absorbs a part of
    /// what a further name explains later.
    fn mistaken(&self, path: &Path) -> Result<Vec<Set>> {
        let (context, best) = (self.context, &path.best);
        let mut again: Vec<Set> = Vec::new();
        for other in path.rounds.iter().flat_map(|r| &r.confirmed) {
            let not_in = |a: &Set, b: &Set| -> Vec<usize> {
                let own = a.candidates.iter().filter(|c| !b.candidates.contains(c));
                own.copied().collect()
            };
            let (out, into) = (not_in(best, other), not_in(other, best));
            let [into] = &into[..] else {
                continue;
            };
            let is_name = |c: usize| !self.candidates[c].is_tolerance;
            let confused =
                |&&c: &&usize| is_name(c) && is_confused(context, self.candidates, (c, *into));
            let Some(out) = out.iter().find(confused) else {
                continue;
            };
            if !is_name(*into) || is_within(self.candidates, best, *into) {
                continue;
            }
            let is_behind = !other.is_level_with(best, rise(context));
            let known = again.iter().any(|s| s.candidates.contains(into));
            if known || !is_behind || self.progress.is_stopped() {
                continue;
            }
            let rest = without(best, self.candidates, *out);
            let mut set = with_that_of(&rest, other, self.candidates, *into);
            set.names.extend(other.names.among(&[*into]));
            // In segments only a long fit shows the scatter of its evidence.
            let [little, whole] = self.breadth.rounds;
            let rounds = if context.has_segments() {
                whole
            } else {
                little
            };
            set.fit(context, (rounds, self.progress))?;
            again.push(set);
            if again.len() == MOST {
                break;
            }
        }
        Ok(again)
    }

    /// Adds the twins of the best set of a path to the fits of its last round.
    ///
    /// A twin that is worth more, because its name is more likely, replaces the best set. So does a
    /// twin with fewer values that the evidence does not separate from it. Twins of the new best
    /// set become its rivals.
    pub(super) fn with_twins(&self, path: &mut Path) -> Result<()> {
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        for _ in 0..MOST {
            let mut twins = self.twins(path)?;
            let best = &mut path.best;
            let simpler = twins.iter_mut().find(|twin| self.is_simpler(twin, best));
            if let Some(twin) = simpler {
                // Both scatter about the same evidence: the simpler one is worth no less, and the
                // other is its rival.
                let most = twin.fitted.evidence.max(best.fitted.evidence);
                twin.fitted.evidence = most;
                best.fitted.evidence = most;
                let twin = twin.clone();
                twins.push(std::mem::replace(best, twin));
            }
            let likelier = twins.iter().max_by(|a, b| worth(a).total_cmp(&worth(b)));
            let likelier = likelier
                .filter(|twin| worth(twin) > worth(&path.best))
                .cloned();
            if let Some(last) = path.rounds.last_mut() {
                last.confirmed.extend(twins);
            }
            let Some(twin) = likelier else { break };
            path.best = twin;
        }
        Ok(())
    }

    /// Whether a twin has fewer values than the set that stands, is at least as likely a priori,
    /// and is not separated from it by the evidence.
    fn is_simpler(&self, twin: &Set, best: &Set) -> bool {
        let prior = |s: &Set| log_prior(self.context.plant(), self.candidates, &s.candidates);
        twin.values() < best.values()
            && prior(twin) >= prior(best)
            && twin.is_level_with(best, rise(self.context))
    }

    /// Twins of the best set of a path, each fitted briefly.
    fn twins(&self, path: &Path) -> Result<Vec<Set>> {
        let (context, best) = (self.context, &path.best);
        let rise = rise(context);
        let mut twins = self.mistaken(path)?;
        for round in &path.rounds {
            let is_part = |s: &&Set| s.candidates.iter().all(|c| best.candidates.contains(c));
            let parts = round.confirmed.iter().filter(is_part);
            let Some(ahead) = parts.max_by_key(|s| s.candidates.len()) else {
                continue;
            };
            let is_level = |s: &&Set| {
                s.names.count() == ahead.names.count()
                    && s.is_level_with(ahead, rise)
                    && ahead.is_level_with(s, rise)
            };
            for other in round.confirmed.iter().filter(is_level) {
                let sets = (&best.candidates, &ahead.candidates, &other.candidates);
                let Some([out, into]) = exchanged(sets.0, sets.1, sets.2) else {
                    continue;
                };
                let mut twin = best.clone();
                for c in out.into_iter().chain(self.within_tolerance(best, &into)) {
                    twin = without(&twin, self.candidates, c);
                }
                twin.names.extend(other.names.among(&into));
                for c in into {
                    twin = with_that_of(&twin, other, self.candidates, c);
                }
                twin.fit(context, (self.breadth.rounds[0], self.progress))?;
                twins.push(twin);
                if twins.len() >= MOST {
                    return Ok(twins);
                }
            }
        }
        Ok(twins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_level_changes_places_beside_what_came_later() {
        // Friction (1, 2) and friction with a servo's damping (1, 3) were equal; tolerances (8, 9)
        // came later.
        let swap = |best: &[usize]| exchanged(best, &[1, 2], &[1, 3]);
        assert_eq!(swap(&[1, 2, 8, 9]), Some([vec![2], vec![3]]));
        assert_eq!(swap(&[1, 2]), None, "it is a rival as it is");
        assert_eq!(swap(&[1, 8, 9]), None, "it is not made of the two");
        assert_eq!(swap(&[1, 2, 3]), None, "it holds both");
        assert_eq!(
            exchanged(&[1, 2, 8], &[1, 2], &[1]),
            None,
            "nothing comes in"
        );
    }
}
