//! A look at all candidates about open-loop replays of the model, where none was found about what the logs show.
//!
//! A sensor that is far off takes the smoothed trajectory along: a force is then missing wherever the machine was not, and drives are
//! saturated there or contacts open, so that no slope tells of the sensor. About a replay the machine is where the model has it, and what
//! readings alone lack is seen as it is.

use asid_core::Result;

use crate::latent_force::fit::Slopes;
use crate::latent_force::screen::Pairs;

use super::round::Upon;
use super::second_look::joined;
use super::set::Set;

impl Upon<'_> {
    /// Sets that were `fitted` to the end and, upon no effect and where none of them rises above what stands, those that lead about its replays.
    pub(super) fn with_a_look_about_replays(&self, fitted: Vec<Set>) -> Result<Vec<Set>> {
        let rises = |set: &Set| set.rises_above(self.base, self.threshold());
        let is_due = self.base.candidates.is_empty() && !self.context.has_segments();
        if !is_due || self.progress.is_stopped() || fitted.iter().any(rises) {
            return Ok(fitted);
        }
        let mut base = self.base.clone();
        base.fitted.estimate.trajectory = (self.open_loop.states)(self.base)?;
        base.fitted.slopes = Slopes::default();
        let states = base.fitted.estimate.trajectory.iter().flatten();
        if states.into_iter().any(|x| !x.is_finite()) {
            return Ok(fitted);
        }
        let about = Upon {
            base: &base,
            ..*self
        };
        let look = about.look(Pairs::BeyondTheSum)?;
        let ranked = look.ranked.iter();
        let rows: Vec<_> = ranked.map(|s| (self.named(&look, s), s.gain)).collect();
        self.progress.ranking("screening about replays", &rows);
        let raced = about.race(&look, None)?.sets;
        let further = about.finish(raced, self.base.fitted.evidence)?.sets;
        self.progress.end();
        Ok(self.in_order(joined(fitted, further)))
    }
}
