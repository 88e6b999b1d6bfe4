//! A round of a search: all open candidates are screened upon a set, and the few that lead are fitted.

use std::collections::BTreeSet;

use asid_core::{Progress, Result};
use nalgebra::DMatrix;

use crate::candidate::{Candidate, nameable};
use crate::chance::threshold;
use crate::latent_force::context::Context;
use crate::latent_force::estimate::Missing;
use crate::latent_force::fit::{Extent, Fitted, Slopes, rise};
use crate::latent_force::screen::Screened;
use crate::settings::Breadth;

use super::open_loop::OpenLoop;
use super::prior::worth;
use super::prune::{earned, pruned, pruned_at_once};
use super::screening::{Screening, Sight};
use super::set::{
    Set, TOLERANCES, from_fit_of, name_of, refined_by, simplest_first, with, without,
};
use super::tolerances::Tolerances;
use super::{Untried, has_tolerances};

/// A round: what was screened and what was fitted upon a base.
#[derive(Clone, Debug)]
pub struct Round {
    /// Candidates of the base.
    pub base: Vec<usize>,
    /// What was screened, best first.
    pub screened: Vec<Seen>,
    /// The leading candidates of screening, and the cosines of the smallest principal angle between each two.
    pub alike: (Vec<usize>, DMatrix<f64>),
    /// What could have been seen upon the base.
    pub sight: Sight,
    /// Candidates of the sets that were fitted a little.
    pub raced: Vec<Vec<usize>>,
    /// Sets that were fitted to the end, best first.
    pub confirmed: Vec<Set>,
    /// What an ordinary machine has of everything, where that earns its place to first order.
    pub tolerances: Option<Tolerances>,
}

/// Candidates that were screened together.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The candidates.
    pub set: Vec<usize>,
    /// How many named things they are.
    pub names: usize,
    /// Evidence upon the base, with the prior odds.
    pub gain: f64,
}

/// What a round is about.
pub(super) struct Upon<'r> {
    pub(super) context: &'r Context<'r>,
    /// The set that stands.
    pub(super) base: &'r Set,
    /// What is missing without effects.
    pub(super) at_first: Missing,
    /// All candidates, and the places of those that are open.
    pub(super) candidates: &'r [Candidate],
    pub(super) open: &'r [usize],
    pub(super) breadth: Breadth,
    /// Open-loop replays of a set.
    pub(super) open_loop: OpenLoop<'r>,
    pub(super) progress: &'r dyn Progress,
}

/// Sets that were fitted, and those that there was no time for.
struct Fits {
    sets: Vec<Set>,
    left_out: Vec<Vec<usize>>,
}

impl Screening {
    /// What a round was, once it is over: what was `screened`, what was raced and confirmed, and tolerances that earn their place.
    fn round(
        self,
        upon: &Upon<'_>,
        screened: Vec<Seen>,
        (raced, confirmed): (Vec<Vec<usize>>, Vec<Set>),
        tolerances: Option<Tolerances>,
    ) -> Round {
        Round {
            base: upon.base.candidates.clone(),
            screened,
            alike: self.alike,
            sight: self.sight,
            raced,
            confirmed,
            tolerances,
        }
    }
}

impl Upon<'_> {
    /// Screens the open candidates and fits the few that lead.
    ///
    /// # Errors
    /// When the engine fails.
    pub(super) fn round(&self, untried: &mut Vec<Untried>) -> Result<Round> {
        let progress = self.progress;
        let name = |set: &[usize]| name_of(self.candidates, set);
        let upon = match &self.base.candidates[..] {
            [] => String::new(),
            set => format!(" upon {}", name(set)),
        };
        let screening = self.screen()?;
        if !screening.columns.complete {
            untried.push(Untried {
                stage: "screening of some of the effects that need the engine",
                sets: Vec::new(),
            });
        }
        let seen = |s: &Screened| Seen {
            set: self.members(&screening, s),
            names: s.names,
            gain: s.gain,
        };
        let screened: Vec<Seen> = screening.ranked.iter().map(seen).collect();
        let rows = screened.iter().map(|s| (name(&s.set), s.gain));
        let all = screening
            .tolerances
            .iter()
            .map(|t| (TOLERANCES.to_owned(), t.gain));
        let mut rows: Vec<_> = rows.chain(all).collect();
        rows.sort_by(|a, b| b.1.total_cmp(&a.1));
        progress.ranking(&format!("screening{upon}"), &rows);
        if !self.open_loop.is_gap {
            return Ok(screening.round(self, screened, (Vec::new(), Vec::new()), None));
        }
        let threshold = self.threshold();
        let tolerances = screening.tolerances.as_ref();
        let tolerances = tolerances.filter(|t| t.gain > threshold).cloned();
        // One name that tells as much as many small things is the likelier.
        let least = screening.of_names + threshold;
        if let Some(leading) = tolerances.as_ref().filter(|t| t.gain > least) {
            progress.note("fitting tolerances");
            let mut set = leading.beside(self.base, self.candidates);
            set.fit(self.context, (self.breadth.rounds[1], progress))?;
            progress.end();
            return Ok(screening.round(self, screened, (Vec::new(), vec![set]), tolerances));
        }
        let mut raced = self.race(&screening, tolerances.as_ref())?;
        let beside = self.beside_tolerances(tolerances.as_ref(), &raced.sets)?;
        raced.sets.extend(beside);
        let of_race = raced.sets.iter().map(|s| s.candidates.clone()).collect();
        let finished = self.finish(raced.sets)?;
        progress.end();
        let cut = [
            ("confirmation of what leads in screening", raced.left_out),
            ("fit to the end", finished.left_out),
        ];
        let cut = cut.into_iter().filter(|(_, sets)| !sets.is_empty());
        untried.extend(cut.map(|(stage, sets)| Untried { stage, sets }));
        let mut confirmed = finished.sets;
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        confirmed.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        simplest_first(&mut confirmed, rise(self.context));
        let gain = |s: &Set| s.fitted.evidence - self.base.fitted.evidence;
        let rows = confirmed.iter().map(|s| (name(&s.candidates), gain(s)));
        progress.ranking(&format!("fits{upon}"), &rows.collect::<Vec<_>>());
        Ok(screening.round(self, screened, (of_race, confirmed), tolerances))
    }

    /// Evidence by which a name must rise above what stands.
    fn threshold(&self) -> f64 {
        threshold(nameable(self.candidates), self.breadth.false_alarms)
    }

    /// Candidates of a set of a screening.
    fn members(&self, screening: &Screening, set: &Screened) -> Vec<usize> {
        let candidate = |&f: &usize| self.open[screening.columns.forms[f].candidate];
        set.forms.iter().map(candidate).collect()
    }

    /// Fits what leads in a screening a little; tolerances too where they are not far behind.
    fn race(&self, screening: &Screening, tolerances: Option<&Tolerances>) -> Result<Fits> {
        let (breadth, progress) = (self.breadth, self.progress);
        let ranked = &screening.ranked;
        let price = self.price();
        let lead = ranked.first().map_or(0.0, |s| s.worth(price));
        let wander = self.base.fitted.wander;
        let least = (breadth.share * lead).max(breadth.least).max(wander);
        let due = ranked.iter().take(breadth.raced);
        let due = due.filter(|s| s.worth(price) > least);
        let due: Vec<&Screened> = due.collect();
        progress.begin("confirming", due.len() as u64);
        let mut sets = Vec::new();
        let mut left_out = Vec::new();
        let not_far = lead - (breadth.behind * lead).max(breadth.near);
        let mut near = tolerances.filter(|t| t.gain > not_far);
        for (place, s) in due.into_iter().enumerate() {
            let members = self.members(screening, s);
            // What leads comes first: where time is out, an answer rests on it.
            if place > 0 && progress.is_stopped() {
                left_out.push(members);
                continue;
            }
            progress.note(&format!("trying {}", name_of(self.candidates, &members)));
            let mut set = self.begun(screening, s)?;
            set.fit(self.context, (breadth.rounds[0], progress))?;
            sets.push(set);
            progress.advance(1);
            sets.extend(self.tried(near.take())?);
        }
        sets.extend(self.tried(near)?);
        Ok(Fits { sets, left_out })
    }

    /// Tolerances beside the base, fitted a little, where there are any.
    fn tried(&self, tolerances: Option<&Tolerances>) -> Result<Option<Set>> {
        let Some(tolerances) = tolerances else {
            return Ok(None);
        };
        self.progress.note("trying tolerances");
        let mut set = tolerances.beside(self.base, self.candidates);
        set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
        Ok(Some(set))
    }

    /// Where a group leads those that were `raced`, the best of its members by itself with tolerances beside it, fitted a little: one law at all
    /// places makes up for many small things as they do, and is not there where it is strong at one place and small things are the rest. With
    /// the group beside tolerances too where it falls behind that.
    fn beside_tolerances(
        &self,
        tolerances: Option<&Tolerances>,
        raced: &[Set],
    ) -> Result<Vec<Set>> {
        let before = self.base.candidates.len();
        let added = |s: &Set| s.candidates[before.min(s.candidates.len())..].to_vec();
        let by_evidence = |a: &&Set, b: &&Set| a.fitted.evidence.total_cmp(&b.fitted.evidence);
        let named = raced.iter().filter(|s| !has_tolerances(self.candidates, s));
        let leads = named.clone().max_by(by_evidence);
        let (Some(tolerances), Some(group)) = (tolerances, leads) else {
            return Ok(Vec::new());
        };
        let members = added(group);
        let is_member = |s: &&Set| matches!(added(s)[..], [one] if members.contains(&one));
        let Some(member) = named.filter(is_member).max_by(by_evidence) else {
            return Ok(Vec::new());
        };
        let mut fitted = Vec::new();
        for set in [member, group] {
            let is_behind = fitted
                .last()
                .is_none_or(|alone: &Set| alone.fitted.evidence > group.fitted.evidence);
            if members.len() < 2 || self.progress.is_stopped() || !is_behind {
                break;
            }
            let name = name_of(self.candidates, &set.candidates);
            self.progress
                .note(&format!("trying {name} with tolerances"));
            let mut set = tolerances.beside(set, self.candidates);
            set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
            fitted.push(set);
        }
        Ok(fitted)
    }

    /// The base with the candidates of a set of a screening; a finer law takes the place of the simpler one.
    pub(super) fn enlarged(&self, screening: &Screening, screened: &Screened) -> Set {
        let Screening { some, columns, .. } = screening;
        let base = self.base;
        let (hypothesis, theta, added) = with(&base.fitted, columns, some, screened);
        let mut candidates = base.candidates.clone();
        candidates.extend(added.iter().map(|&c| self.open[c]));
        let mut set = Set {
            candidates,
            fitted: Fitted {
                hypothesis,
                theta,
                ..base.fitted.clone()
            },
            names: base.names + screened.names,
        };
        for &c in &added {
            if let Some(simpler) = refined_by(self.candidates, self.open[c]) {
                set = without(&set, self.candidates, simpler);
            }
        }
        set
    }

    /// Fits those that are not far behind to the end, and takes out of each what does nothing in it.
    fn finish(&self, raced: Vec<Set>) -> Result<Fits> {
        let (context, breadth, progress) = (self.context, self.breadth, self.progress);
        let base = self.base.fitted.evidence;
        // What a set promises counts for it, but only what one has reached counts against the others.
        let hoped = |s: &Set| s.fitted.evidence + s.fitted.promised;
        let mut raced = raced;
        raced.sort_by(|a, b| hoped(b).total_cmp(&hoped(a)));
        // After as many rounds for each: one that was fitted to the end would be ahead by its rounds alone.
        let best = raced.iter().map(|s| s.fitted.evidence).fold(base, f64::max);
        let least = best - (breadth.behind * (best - base)).max(breadth.near);
        let mut best_to_the_end = base;
        let mut fits = Fits {
            sets: Vec::new(),
            left_out: Vec::new(),
        };
        for mut set in raced.into_iter().take(breadth.finished) {
            if hoped(&set) < least {
                continue;
            }
            if !progress.is_stopped() {
                progress.note(&format!(
                    "fitting {}",
                    name_of(self.candidates, &set.candidates)
                ));
                // To the end by slopes of its own.
                set.fitted.slopes = Slopes::default();
                let whole = Extent::from((breadth.rounds[1], progress));
                let rival = (!context.has_segments()).then_some(best_to_the_end - breadth.near);
                set.fit(context, Extent { rival, ..whole })?;
            }
            best_to_the_end = best_to_the_end.max(set.fitted.evidence);
            let at_once = pruned_at_once(self.candidates, set.clone());
            // Fewer members do not bring back one that is far behind.
            let is_far = hoped(&at_once) < best_to_the_end - breadth.near;
            set = if progress.is_stopped() {
                fits.left_out.push(set.candidates);
                at_once
            } else if is_far && !context.has_segments() {
                at_once
            } else {
                let least = (breadth, self.at_first);
                pruned(context, self.candidates, set, least, progress)?
            };
            fits.sets.push(set);
        }
        let others = fits.sets.clone();
        let least = (breadth, self.threshold(), self.at_first);
        for set in &mut fits.sets {
            let own = (set.clone(), self.base, &others[..]);
            *set = earned(context, self.candidates, own, least, progress)?;
        }
        let mut seen = BTreeSet::new();
        let members = |s: &Set| s.candidates.iter().copied().collect::<BTreeSet<usize>>();
        fits.sets.retain(|s| seen.insert(members(s)));
        if context.has_segments() {
            self.level(&mut fits.sets)?;
        }
        Ok(fits)
    }

    /// Fits those behind the best once more from where that one has put the starts of segments.
    fn level(&self, sets: &mut [Set]) -> Result<()> {
        sets.sort_by(|a, b| b.fitted.evidence.total_cmp(&a.fitted.evidence));
        let Some((best, others)) = sets.split_first_mut() else {
            return Ok(());
        };
        for set in others {
            if self.progress.is_stopped() {
                break;
            }
            let again = from_fit_of(self.context, (set, best), self.breadth, self.progress)?;
            if again.fitted.evidence > set.fitted.evidence {
                *set = again;
            }
        }
        Ok(())
    }
}
