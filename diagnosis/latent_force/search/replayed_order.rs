//! What a race begins with where bodies touch: what replays of whole logs say.
//!
//! A slope at the null tells little of a law that is large: a friction that stops a foot is many times the friction that its slope was
//! taken over, and by slopes it comes far behind other laws. A replay with it lands on the log. So the sets that lead by
//! slopes are replayed once at the values that these promise, the best of them further and less far too, and those that leave least are
//! fitted before all others. Evidence decides as ever; but where time is short it has been asked of what closes the gap.

use asid_core::Result;

use crate::findings::NEGLIGIBLE;
use crate::latent_force::screen::Screened;

use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Physics steps that such replays take, at most: a third of what a screening of a machine with contacts takes.
const STEPS: usize = 300_000;
/// Of so many sets that are replayed at the values that slopes promise, one is also replayed at others.
const EVERY: usize = 4;
/// These others, in units of what slopes promise.
const PARTS: [f64; 2] = [0.25, 4.0];
/// Excess power, relative to the least, up to which a set is one that a race begins with: a gap of 1.4 times the least.
const LEVEL: f64 = 2.0;

impl Upon<'_> {
    /// Places among those ranked of the sets that a race begins with: of those that close most of the gap that the base leaves, and whose replays leave
    /// about the least, the one of fewest values first. None where there are no segments, or hardly a gap.
    pub(super) fn closing(&self, look: &Look) -> Result<Vec<usize>> {
        if !self.context.has_segments() {
            return Ok(Vec::new());
        }
        let excess = |set: &Set| (self.open_loop.excess)(set);
        let stands = excess(self.base)?;
        if !(stands.is_finite() && stands > NEGLIGIBLE * NEGLIGIBLE) {
            return Ok(Vec::new());
        }
        let names = look.ranked.iter().enumerate();
        let single = |(_, s): &(usize, &Screened)| s.names == 1 && s.gain > self.breadth.least;
        let most = STEPS / self.open_loop.steps.max(1);
        let mut replayed: Vec<(f64, usize)> = Vec::new();
        for (place, screened) in names.filter(single).take(most) {
            if self.progress.is_stopped() {
                break;
            }
            replayed.push((excess(&self.enlarged(look, screened))?, place));
        }
        replayed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let few = replayed.len().div_ceil(EVERY);
        for (left, place) in replayed.iter_mut().take(few) {
            let set = self.enlarged(look, &look.ranked[*place]);
            for part in PARTS {
                if self.progress.is_stopped() {
                    break;
                }
                *left = left.min(excess(&self.at(&set, part))?);
            }
        }
        replayed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least = replayed.first().map_or(f64::INFINITY, |r| r.0);
        let leads = |left: f64| left <= LEVEL * least && left < MOST * stands;
        let leading = replayed.into_iter().take_while(|r| leads(r.0));
        let mut leading: Vec<usize> = leading.map(|r| r.1).collect();
        leading.truncate(self.breadth.raced.div_ceil(2));
        leading.sort_by_key(|&place| {
            look.ranked[place]
                .coefficients
                .iter()
                .map(Vec::len)
                .sum::<usize>()
        });
        Ok(leading)
    }
}
