//! Replacement of a simple law of the final set by a finer one that refines it.
//!
//! A path ends when too little is left for a further name. Friction that falls with the speed may
//! make up for less than that beyond dry friction that does not. It is no further name, since the
//! simpler law is a part of it.

use asid_core::Result;

use crate::latent_force::screen::Pairs;

use super::Search;
use super::path::Path;
use super::round::Upon;
use super::set::refined_by;

/// Most finer laws that are tried.
const TRIED: usize = 2;

impl Search<'_> {
    /// Replaces a simple law of the best set of a path by a finer one.
    ///
    /// The finer law must earn its evidence and close most of what whole replays leave. The sets
    /// that were tried are added to the path's last round.
    pub(super) fn refine(&self, mut path: Path) -> Result<Path> {
        let base = path.best.clone();
        let refines = |&c: &usize| {
            let simpler = refined_by(self.candidates, c);
            let stands = simpler.is_some_and(|s| base.candidates.contains(&s));
            stands && !self.candidates[c].is_tolerance && !self.known.contains(&c)
        };
        let finer: Vec<usize> = (0..self.candidates.len()).filter(refines).collect();
        if finer.is_empty() || self.context.has_segments() || self.progress.is_stopped() {
            return Ok(path);
        }
        let upon: Upon<'_> = self.upon(&base, &finer);
        let look = upon.look(Pairs::BeyondTheSum)?;
        let mut sets = Vec::new();
        let single = look.ranked.iter().filter(|s| s.names == 1);
        for screened in single.take(TRIED) {
            self.progress
                .note(&format!("trying {}", upon.named(&look, screened)));
            let mut set = upon.enlarged(&look, screened);
            set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
            sets.push(set);
        }
        let sets = upon.finish(sets, base.fitted.evidence)?.sets;
        let rows = sets.iter().map(|s| {
            let name = super::name_of(self.candidates, &s.candidates);
            (name, s.fitted.evidence - base.fitted.evidence)
        });
        self.progress
            .ranking("with finer laws", &rows.collect::<Vec<_>>());
        for set in sets {
            let between = (&path.best, &set);
            let earns = set.rises_above(&path.best, self.threshold)
                && self.open_loop.is_mostly_closed(self.context, between)?;
            if let Some(last) = path.rounds.last_mut() {
                last.confirmed.push(set.clone());
            }
            if earns {
                path.best = set;
            }
        }
        Ok(path)
    }
}
