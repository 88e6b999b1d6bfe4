//! Tests each name of the final set once more against all other candidates (sequential replacement:
//! Miller 2002).
//!
//! Forward selection takes the first name when nothing else makes up for what is missing. That name
//! may have replaced one that shows only beside the second. For example, viscous friction may stand
//! in for a softer servo while a sagging supply is not named. About the trajectory of the whole set
//! and beside its other names, all candidates show as well as the one that was taken.

use std::collections::BTreeSet;

use asid_core::Result;

use crate::latent_force::fit::{Slopes, rise};
use crate::latent_force::screen::Pairs;

use super::path::Path;
use super::prior::{log_prior, worth};
use super::round::Upon;
use super::second_look::members;
use super::set::{Set, without};
use super::{Search, open_upon};

/// Most sets that are tried in place of one name.
const TRIED: usize = 2;

impl Search<'_> {
    /// Exchanges names of the best set of a path if that raises its worth by more than a
    /// significant rise.
    ///
    /// The sets that were tried are added to the path's last round.
    pub(super) fn exchange(&self, mut path: Path) -> Result<Path> {
        let worth = |set: &Set| worth(self.context, self.candidates, set);
        let laws = |set: &Set| -> BTreeSet<String> {
            let named = set.candidates.iter().map(|&c| &self.candidates[c]);
            let named = named.filter(|c| !c.is_tolerance);
            named.map(|c| c.spec.name.clone()).collect()
        };
        for law in laws(&path.best) {
            if path.best.names.count() < 2 || self.progress.is_stopped() {
                break;
            }
            let is_out = |c: &usize| {
                let candidate = &self.candidates[*c];
                !candidate.is_tolerance && candidate.spec.name == law
            };
            let out: Vec<usize> = path
                .best
                .candidates
                .iter()
                .copied()
                .filter(is_out)
                .collect();
            if out.is_empty() {
                continue;
            }
            let known: Vec<BTreeSet<usize>> = path
                .rounds
                .iter()
                .flat_map(|r| &r.confirmed)
                .map(members)
                .collect();
            let rivals = self.in_place_of(&path, &out, known)?;
            for rival in rivals {
                let is_better = worth(&rival) > worth(&path.best) + rise(self.context);
                if let Some(last) = path.rounds.last_mut() {
                    last.confirmed.push(rival.clone());
                }
                if is_better {
                    path.best = rival;
                }
            }
        }
        Ok(path)
    }

    /// Sets with other names in place of some candidates of the best set of a path, fitted to the
    /// end; those `known` are left out.
    ///
    /// To first order they are about as likely as the candidates that they replace.
    fn in_place_of(
        &self,
        path: &Path,
        out: &[usize],
        mut known: Vec<BTreeSet<usize>>,
    ) -> Result<Vec<Set>> {
        let (set, rest) = (&path.best, out.iter());
        let mut base = rest.fold(set.clone(), |s, &c| without(&s, self.candidates, c));
        base.fitted.slopes = Slopes::default();
        let open = open_upon(self.candidates, self.known, &base);
        // The estimate of the whole set lacks little of what the candidates are to make up for. A
        // fit of the base lacks all of it, and so does the model without effects.
        let mut fits = path.rounds.iter().flat_map(|r| &r.confirmed);
        let fit_of_base = fits.find(|s| members(s) == members(&base));
        let upon = Upon {
            priors: fit_of_base.map_or(self.without, |s| &s.fitted.estimate),
            ..self.upon(&base, &open)
        };
        let look = upon.look(Pairs::BeyondTheBetter)?;
        let price = upon.price();
        let ranked = &look.ranked;
        let rows = ranked.iter().map(|s| (upon.named(&look, s), s.gain));
        let what = super::name_of(self.candidates, out);
        self.progress
            .ranking(&format!("in place of {what}"), &rows.collect::<Vec<_>>());
        let places = out.iter().map(|c| open.iter().position(|o| o == c));
        let places: Option<Vec<usize>> = places.collect();
        let own = places.and_then(|places| look.evidence_of(&places));
        let prior = log_prior(self.context.plant(), self.candidates, out);
        let least = own.map_or(f64::INFINITY, |gain| gain + prior - self.breadth.near);
        let mut sets = Vec::new();
        for s in ranked
            .iter()
            .filter(|s| s.names == 1 && s.worth(price) >= least)
        {
            if sets.len() == TRIED || self.progress.is_stopped() {
                break;
            }
            let mut other = upon.enlarged(&look, s);
            if known.contains(&members(&other)) || members(&other) == members(set) {
                continue;
            }
            known.push(members(&other));
            self.progress
                .note(&format!("trying {}", upon.named(&look, s)));
            other.fit(self.context, (self.breadth.rounds[0], self.progress))?;
            sets.push(other);
        }
        Ok(upon.finish(sets, set.fitted.evidence)?.sets)
    }
}
