//! Screening of effects on readings alone, about open-loop replays of the model.
//!
//! A sensor that is far off shifts the smoothed states with it. Force is then missing wherever the
//! machine was not. Drives saturate there, contacts open, and no derivative points to the sensor.
//! About a replay the state is where the model puts it, and the error of the readings shows as it
//! is.

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

/// Most sets that are fitted.
const TRIED: usize = 3;
/// Most sets that are replayed: each takes five or more replays of all logs.
const REPLAYED: usize = 8;

impl Upon<'_> {
    /// Adds to the sets that were `fitted` to the end the sets of effects on readings that lead
    /// about replays of the base; best first.
    ///
    /// This is done only upon the model without effects, if the best set leaves a gap of replays.
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

    /// Whether further sets are tried by replays: along rows, upon the model without effects, if
    /// the best of the sets that were `fitted` leaves a gap of replays.
    ///
    /// The sets come in descending order of evidence.
    pub(super) fn asks_replays(&self, fitted: &[Set]) -> Result<bool> {
        let is_due = self.base.candidates.is_empty() && !self.context.has_segments();
        Ok(is_due && !self.progress.is_stopped() && !self.is_closed_by(fitted.first())?)
    }

    /// Fits rivals that replays have found, and adds them to the sets that were `fitted` to the
    /// end; best first.
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

    /// Sets of a screening about replays that are worth a fit.
    ///
    /// First come sets whose replays leave less than half of what replays of the base leave, in
    /// ascending order. Then come sets that promise the evidence that a name must earn. Values
    /// continue along their derivatives as long as replays leave far less. If a joint hits its
    /// stop, a derivative holds for a part of the way only.
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

    /// Whether a set exceeds the base by the threshold and its replays leave no gap.
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
