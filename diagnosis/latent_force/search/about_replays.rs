//! A look at what acts on readings alone, about open-loop replays of the model.
//!
//! A sensor that is far off takes the smoothed states along: a force is then missing wherever the machine was not, drives are saturated
//! there and contacts open, and no slope tells of the sensor. About a replay the machine is where the model has it, and what readings alone lack is seen as
//! it is.

use asid_core::Result;
use asid_effects::Reach;

use crate::findings::LEAST_GAP;
use crate::latent_force::fit::Slopes;
use crate::latent_force::screen::{Pairs, Screened};

use super::round::Upon;
use super::second_look::joined;
use super::set::{Set, name_of};

/// Sets that are fitted, at most.
const TRIED: usize = 3;

impl Upon<'_> {
    /// Sets that were `fitted` to the end, best first, and those of readings alone that promise more than the best of them about replays of what
    /// stands. Upon no effect, where the best leaves a gap of replays.
    pub(super) fn with_a_look_about_replays(&self, fitted: Vec<Set>) -> Result<Vec<Set>> {
        let is_due = self.base.candidates.is_empty() && !self.context.has_segments();
        if !is_due || self.progress.is_stopped() || self.is_closed_by(fitted.first())? {
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
        let least = fitted.first().map_or(0.0, |s| s.fitted.evidence) - self.base.fitted.evidence;
        let least = least.max(self.threshold());
        let promises = |s: &&Screened| s.gain > least;
        let leading: Vec<&Screened> = look.ranked.iter().filter(promises).take(TRIED).collect();
        let mut further = Vec::new();
        for s in leading {
            let mut set = about.enlarged(&look, s);
            let name = name_of(self.candidates, &set.candidates);
            self.progress.note(&format!("trying {name}"));
            set.fit(self.context, (self.breadth.rounds[0], self.progress))?;
            further.push(set);
        }
        let further = self.finish(further, self.base.fitted.evidence)?.sets;
        Ok(self.in_order(joined(fitted, further)))
    }

    /// Whether replays with a set that rises above what stands leave no gap.
    fn is_closed_by(&self, set: Option<&Set>) -> Result<bool> {
        let Some(set) = set.filter(|s| s.rises_above(self.base, self.threshold())) else {
            return Ok(false);
        };
        Ok((self.open_loop.excess)(set)? <= LEAST_GAP * LEAST_GAP - 1.0)
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
