//! A round of a search: all open candidates are screened upon a set, and the leading ones are
//! fitted.

use asid_core::{Progress, Result};
use nalgebra::DMatrix;

use crate::candidate::{Candidate, threshold};
use crate::latent_force::context::Context;
use crate::latent_force::estimate::{Estimate, Missing};
use crate::latent_force::fit::Fitted;
use crate::latent_force::screen::Screened;
use crate::settings::Breadth;

use super::Untried;
use super::open_loop::OpenLoop;
use super::screening::{Look, Screening, Sight};
use super::set::{Set, TOLERANCES, name_of, refined, refined_by, with};
use super::tolerances::Tolerances;

/// What was screened and fitted upon a base in a round.
#[derive(Clone, Debug)]
pub struct Round {
    /// Candidates of the base.
    pub base: Vec<usize>,
    /// Screened sets, best first.
    pub screened: Vec<Seen>,
    /// The leading candidates of the screening, and the cosines of the smallest principal angle
    /// between each two.
    pub alike: (Vec<usize>, DMatrix<f64>),
    /// What the screening could have shown upon the base.
    pub sight: Sight,
    /// Candidates of the sets that were fitted briefly.
    pub raced: Vec<Vec<usize>>,
    /// Sets fitted to the end, best first.
    pub confirmed: Vec<Set>,
    /// Tolerances, if they earn their place to first order.
    pub tolerances: Option<Tolerances>,
}

/// Candidates that were screened together.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The candidates.
    pub set: Vec<usize>,
    /// Number of names; a group counts once.
    pub names: usize,
    /// Evidence upon the base, prior odds included.
    pub gain: f64,
}

/// Input of a round.
#[derive(Clone, Copy)]
pub(super) struct Upon<'r> {
    pub(super) context: &'r Context<'r>,
    /// The set that stands.
    pub(super) base: &'r Set,
    /// The estimate whose missing force gives the widths of the candidates' priors: that of a model
    /// without what the candidates are to make up for.
    pub(super) priors: &'r Estimate,
    /// What is missing without effects.
    pub(super) at_first: Missing,
    /// All candidates, and the indices of those that are open.
    pub(super) candidates: &'r [Candidate],
    pub(super) open: &'r [usize],
    pub(super) breadth: Breadth,
    /// Open-loop replays of a set.
    pub(super) open_loop: OpenLoop<'r>,
    pub(super) progress: &'r dyn Progress,
}

impl Screening {
    /// Converts a screening that is over into a round, with the sets that were `screened`, raced
    /// and confirmed, and tolerances that earn their place.
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
    /// Screens the open candidates and fits the leading ones.
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
        if !screening.look.columns.complete {
            untried.push(Untried {
                stage: "screening of some of the effects that need the engine",
                sets: Vec::new(),
            });
        }
        let seen = |s: &Screened| Seen {
            set: self.members(&screening.look, s),
            names: s.names,
            gain: s.gain,
        };
        let screened: Vec<Seen> = screening.look.ranked.iter().map(seen).collect();
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
        // One name with as much evidence as many small errors is the more likely.
        let least = screening.of_names + threshold;
        let leading = tolerances.as_ref().filter(|t| t.gain > least);
        if let Some(leading) = leading {
            progress.note("fitting tolerances");
            let mut set = leading.beside(self.base, self.candidates);
            set.fit(self.context, (self.breadth.rounds[1], progress))?;
            if progress.is_stopped() || self.earns_its_place(&set)? {
                if progress.is_stopped() {
                    untried.push(Untried {
                        stage: "confirmation of what leads in screening",
                        sets: Vec::new(),
                    });
                }
                progress.end();
                return Ok(screening.round(self, screened, (Vec::new(), vec![set]), tolerances));
            }
        }
        // Tolerances that led the screening and have failed do not take part.
        let rivals = tolerances.as_ref().filter(|_| leading.is_none());
        let mut raced = self.race(&screening.look, rivals)?;
        let beside = self.beside_tolerances(tolerances.as_ref(), &raced.sets)?;
        raced.sets.extend(beside);
        let of_race = raced.sets.iter().map(|s| s.candidates.clone()).collect();
        let finished = self.finish(raced.sets, self.base.fitted.evidence)?;
        progress.end();
        let cut = [
            ("confirmation of what leads in screening", raced.left_out),
            ("fit to the end", finished.left_out),
        ];
        let cut = cut.into_iter().filter(|(_, sets)| !sets.is_empty());
        untried.extend(cut.map(|(stage, sets)| Untried { stage, sets }));
        let beside = (&screening.look, screening.tolerances.as_ref());
        let confirmed = self.with_laws_by_replays(self.in_order(finished.sets), beside)?;
        let confirmed = self.with_a_second_look(confirmed, beside)?;
        let confirmed = self.with_a_look_about_replays(confirmed)?;
        let confirmed = self.with_what_is_mistaken(confirmed, &screening.look)?;
        let gain = |s: &Set| s.fitted.evidence - self.base.fitted.evidence;
        let rows = confirmed.iter().map(|s| (name(&s.candidates), gain(s)));
        progress.ranking(&format!("fits{upon}"), &rows.collect::<Vec<_>>());
        Ok(screening.round(self, screened, (of_race, confirmed), tolerances))
    }

    /// Whether a fitted set exceeds the base by the threshold and makes up for as much as a further
    /// name must.
    fn earns_its_place(&self, set: &Set) -> Result<bool> {
        let (sets, threshold) = ((self.base, set), self.threshold());
        Ok(self.open_loop.rises(self.context, sets, threshold)? && self.counts(self.base, set)?)
    }

    /// Name of a screened set, as users see it.
    pub(super) fn named(&self, look: &Look, screened: &Screened) -> String {
        name_of(self.candidates, &self.members(look, screened))
    }

    /// Evidence by which a name must exceed the base.
    pub(super) fn threshold(&self) -> f64 {
        let replayed = self.context.has_segments();
        threshold(self.candidates, replayed, self.breadth.false_alarms)
    }

    /// Candidates of a screened set.
    pub(super) fn members(&self, look: &Look, set: &Screened) -> Vec<usize> {
        let candidate = |&f: &usize| self.open[look.columns.forms[f].candidate];
        set.forms.iter().map(candidate).collect()
    }

    /// The base with the candidates of a screened set; a finer law replaces the simpler one.
    pub(super) fn enlarged(&self, look: &Look, screened: &Screened) -> Set {
        let Look { some, columns, .. } = look;
        let base = self.base;
        let (hypothesis, theta, added) = with(&base.fitted, columns, some, screened);
        let added: Vec<usize> = added.into_iter().map(|c| self.open[c]).collect();
        let (mut candidates, mut names) = (base.candidates.clone(), base.names.clone());
        candidates.extend(&added);
        // A group is one name, and so is each of a pair.
        let size = added.len() / screened.names.max(1);
        let each = added.chunks(size.max(1));
        each.for_each(|name| names.add(name.to_vec()));
        let mut set = Set {
            candidates,
            fitted: Fitted {
                hypothesis,
                theta,
                ..base.fitted.clone()
            },
            names,
        };
        for c in added {
            if let Some(simpler) = refined_by(self.candidates, c) {
                set = refined(&set, self.candidates, [c, simpler]);
            }
        }
        set
    }
}
