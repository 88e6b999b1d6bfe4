//! A path of a search: names taken one upon the other, from a set that stands.

use asid_core::Result;

use crate::latent_force::fit::Fitted;

use super::open_loop::{MOST, OpenLoopGap};
use super::prior::worth;
use super::round::{Round, Upon};
use super::set::{Set, free_what_is_given};
use super::{
    FURTHER, GIVEN, Search, Untried, first_that_counts, fit_from, has_tolerances, is_cut_short,
    open_upon, upon_tolerances,
};

/// How far a path has come.
pub(super) struct Path {
    /// The rounds.
    pub(super) rounds: Vec<Round>,
    /// The set that stands.
    pub(super) best: Set,
    /// What was left out because the work was stopped.
    pub(super) untried: Vec<Untried>,
}

impl Path {
    /// One that begins with a set.
    pub(super) fn from(best: Set) -> Self {
        Self {
            rounds: Vec::new(),
            best,
            untried: Vec::new(),
        }
    }

    /// This path or another one, which began where this one's first round did: that whose end is worth more. The rounds of both are kept, those
    /// of the better one last.
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
    /// The second of the sets that the first round of a path has fitted to the end, where it is as likely as the one that was taken but for
    /// what a name must earn, and something was missing beside that one.
    pub(super) fn second(&self, path: &Path) -> Option<Set> {
        let [first, _further, ..] = &path.rounds[..] else {
            return None;
        };
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        let taken = &path.rounds[1].base;
        let of_taken = first.confirmed.iter().find(|s| s.candidates == *taken)?;
        let near = |s: &&Set| {
            s.candidates != *taken
                && !has_tolerances(self.candidates, s)
                && worth(s) > worth(of_taken) - self.threshold
        };
        let others = first.confirmed.iter().filter(near);
        let best = others.max_by(|a, b| worth(a).total_cmp(&worth(b)));
        best.cloned()
    }

    /// Names one candidate upon the other for as long as they earn it. `none` is the model without effects, fitted, which becomes a better fit
    /// of it where one is found.
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
        // The set that stands with what no search tries, such as an offset of its friction: a rival of every further effect, which
        // needs no further name.
        let mut freed: Option<Set> = None;
        let mut depth = breadth.depth.saturating_sub(path.best.names);
        let mut gap = OpenLoopGap::by(self.open_loop);
        while path.rounds.len() < depth {
            let no_force = left(&path.best) < breadth.shrinks;
            if no_force && !gap.is_left(context, (none, &path.best), how)? {
                break;
            }
            // The first screening is the least that an answer rests on.
            if !path.rounds.is_empty() && progress.is_stopped() {
                path.untried.push(Untried::upon(&path.best, FURTHER));
                break;
            }
            let (round, confirmed) = self.round(&mut path)?;
            path.rounds.push(round);
            let stopped = progress.is_stopped();
            let further = (confirmed.first(), threshold);
            fit_from(context, further, (&mut path.best, none), how)?;
            let best = &path.best;
            if is_cut_short(context, best, progress) {
                path.untried.push(Untried::upon(best, FURTHER));
                break;
            }
            // A first fit that was cut short has not told yet how much of the force it makes up for.
            let cut_short = stopped && best.candidates.is_empty();
            let makes_up_for_most = |set: &Set| {
                let [before, after] = [best, set].map(|s| &s.fitted.estimate);
                before.is_made_up_for_by(after, context, 1.0 - MOST)
            };
            let counts = |set: &Set| match no_force {
                _ if cut_short || left(best) - left(set) > breadth.shrinks => Ok(true),
                _ if makes_up_for_most(set) => Ok(true),
                true => gap.is_closed_by(set, breadth),
                false => self.open_loop.is_mostly_closed(context, (best, set)),
            };
            let next = first_that_counts(confirmed, (best, threshold), counts)?;
            let is_ahead = |own: &Set| !own.is_passed(next.as_ref(), threshold);
            if let Some(own) = freed.take().filter(is_ahead) {
                path.best = own;
                continue;
            }
            let last = path.rounds.last_mut();
            let Some(next) =
                upon_tolerances(context, candidates, (best, next, at_first), last, how)?
            else {
                break;
            };
            if has_tolerances(candidates, &next) && !has_tolerances(candidates, best) {
                // They are no name.
                depth += 1;
            }
            if let Some(smaller) = self.given_back(&next, best)? {
                let last = path.rounds.last_mut();
                last.into_iter()
                    .for_each(|round| round.confirmed.push(smaller.clone()));
                path.best = smaller;
            } else {
                path.best = next;
            }
            if stopped {
                path.untried.push(Untried::upon(&path.best, GIVEN));
                break;
            }
            let what = (breadth, threshold);
            freed = free_what_is_given(context, candidates, &path.best, what, progress)?;
        }
        if let Some(freed) = freed {
            path.best = freed;
        }
        Ok(path)
    }

    /// A round upon the set that stands, and the sets that it has fitted to the end.
    fn round(&self, path: &mut Path) -> Result<(Round, Vec<Set>)> {
        let upon = Upon {
            context: self.context,
            base: &path.best,
            at_first: self.at_first,
            candidates: self.candidates,
            open: &open_upon(self.candidates, self.known, &path.best),
            breadth: self.breadth,
            open_loop: self.open_loop,
            progress: self.progress,
        };
        let round = upon.round(&mut path.untried)?;
        let confirmed = round.confirmed.clone();
        Ok((round, confirmed))
    }
}
