//! A look at what acts on readings alone, about open-loop replays of the model.
//!
//! A sensor that is far off takes the smoothed states along: a force is then missing wherever the machine was not, drives are saturated
//! there and contacts open, and no slope tells of the sensor. About a replay the machine is where the model has it, and what readings alone lack is seen as
//! it is.

use asid_core::Result;
use asid_effects::Reach;

use crate::findings::LEAST_GAP;
use crate::latent_force::fit::{Extent, Slopes};
use crate::latent_force::screen::Pairs;

use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::second_look::joined;
use super::set::{Set, name_of};

/// Sets that are fitted, at most.
const TRIED: usize = 3;
/// Sets that are replayed, at most: each takes five replays of all logs or more.
const REPLAYED: usize = 8;

impl Upon<'_> {
    /// Sets that were `fitted` to the end, best first, and those of readings alone that lead about replays of what
    /// stands. Upon no effect, where the best leaves a gap of replays.
    pub(super) fn with_a_look_about_replays(&self, fitted: Vec<Set>) -> Result<Vec<Set>> {
        if !self.asks_replays(&fitted)? {
            return Ok(fitted);
        }
        let mut base = self.base.clone();
        base.fitted.estimate.trajectory = (self.open_loop.states)(self.base)?;
        base.fitted.slopes = Slopes::default();
        let mut states = base.fitted.estimate.trajectory.iter().flatten();
        let open = self.of_readings();
        if open.is_empty() || states.any(|x| !x.is_finite()) {
            return Ok(fitted);
        }
        let about = Upon {
            base: &base,
            open: &open,
            ..*self
        };
        let look = about.look(Pairs::BeyondTheSum)?;
        let rivals = about.leading(&look)?;
        self.with_rivals(fitted, rivals)
    }

    /// Whether replays are asked beside the sets that were `fitted`, best first: upon no effect, along rows, where the best leaves a gap of replays.
    pub(super) fn asks_replays(&self, fitted: &[Set]) -> Result<bool> {
        let is_due = self.base.candidates.is_empty() && !self.context.has_segments();
        Ok(is_due && !self.progress.is_stopped() && !self.is_closed_by(fitted.first())?)
    }

    /// Sets that were `fitted` to the end and rivals that replays have found, these fitted too; best first.
    pub(super) fn with_rivals(&self, fitted: Vec<Set>, mut rivals: Vec<Set>) -> Result<Vec<Set>> {
        for set in &mut rivals {
            let name = name_of(self.candidates, &set.candidates);
            self.progress.note(&format!("trying {name}"));
            let brief = Extent::from((self.breadth.rounds[0], self.progress));
            set.fit(
                self.context,
                Extent {
                    settles: true,
                    ..brief
                },
            )?;
        }
        let further = self.finish(rivals, self.base.fitted.evidence)?.sets;
        Ok(self.in_order(joined(fitted, further)))
    }

    /// Sets of a look about replays that are worth a fit: those with which replays leave less than half of what stands leaves, the least first, and
    /// those that promise what a name must. A value goes on along its slope for as long as replays leave far less: where a joint hits its stop,
    /// a slope holds for a part of the way.
    fn leading(&self, look: &Look) -> Result<Vec<Set>> {
        let excess = |set: &Set| (self.open_loop.excess)(set);
        let stands = excess(self.base)?;
        let (mut closing, mut promising) = (Vec::new(), Vec::new());
        for screened in look.ranked.iter().take(REPLAYED) {
            if self.progress.is_stopped() {
                break;
            }
            let mut set = self.enlarged(look, screened);
            let mut left = excess(&set)?;
            while let Some(further) = self.further(&set)? {
                set = further;
                left = excess(&set)?;
            }
            if left < MOST * stands {
                closing.push((left, set));
            } else if screened.gain > self.threshold() {
                promising.push(set);
            }
        }
        closing.sort_by(|a, b| a.0.total_cmp(&b.0));
        let closing = closing.into_iter().map(|(_, set)| set);
        Ok(closing.chain(promising).take(TRIED).collect())
    }

    /// Whether replays with a set that rises above what stands leave no gap.
    pub(super) fn is_closed_by(&self, set: Option<&Set>) -> Result<bool> {
        let Some(set) = set else {
            return Ok(false);
        };
        let (sets, threshold) = ((self.base, set), self.threshold());
        Ok(self.open_loop.rises(self.context, sets, threshold)?
            && (self.open_loop.excess)(set)? <= LEAST_GAP * LEAST_GAP - 1.0)
    }

    /// The open candidates that act on readings alone.
    fn of_readings(&self) -> Vec<usize> {
        let plant = self.context.plant();
        let reads = |c: &usize| {
            let candidate = &self.candidates[*c];
            let reach = candidate.effect.reach(plant, &candidate.spec.site);
            matches!(reach, Reach::Sensor(_))
        };
        self.open.iter().copied().filter(reads).collect()
    }
}
