//! Rejects faults that shrink misses for another reason than the one they state.

use asid_core::Result;

use super::Search;
use crate::wiring::evidence::Settings;
use crate::wiring::hypotheses::{Fault, Hypothesis, Quantity, view_of, with};
use crate::wiring::view::View;
use crate::wiring::windows::Misses;

/// Share of the mean shrinkage of all columns that driven joints must have under another clock.
///
/// Clocks of the training half that are right have 0.6 and more, a wrong one 0.05.
const DRIVEN: f64 = 0.5;

impl Search<'_> {
    /// Whether a fault is rejected because of the way in which it shrinks the misses `given` of a
    /// view.
    pub(super) fn is_refused(
        &mut self,
        (view, hypothesis): (&View, &Hypothesis),
        given: &Misses,
        misses: &Misses,
    ) -> Result<bool> {
        Ok(self.is_nonsense(view, hypothesis, misses)
            || self.is_of_others(hypothesis, given, misses)
            || self.is_of_undriven(hypothesis, given, misses)
            || self.is_of_some_logs(hypothesis, given, misses)
            || self.is_silence(view, hypothesis, misses)?
            || self.is_drift((view, hypothesis), (given, misses))?)
    }

    /// Whether a unit enlarges a column that would then still be in question.
    ///
    /// With a unit that is far too large everything moves straight on, so the column says nothing
    /// against the model, and nothing for it.
    pub(super) fn is_nonsense(
        &self,
        view: &View,
        hypothesis: &Hypothesis,
        misses: &Misses,
    ) -> bool {
        let missed = Settings::missed(misses, self.settings.nonsense);
        let quantities = hypothesis.quantities.iter().map(|&q| &self.quantities[q]);
        let size = |view: &View, q: &Quantity| view_of(view, q).factor.abs();
        let larger = |q: &&Quantity| size(&hypothesis.view, q) > size(view, q);
        let mut readings = quantities.filter(|q| !q.command).filter(larger);
        hypothesis.fault == Fault::Unit && readings.any(|q| missed[q.place])
    }

    /// Whether another view of a column improves other columns only.
    ///
    /// Its own column then still misses more than it moves, and nearly as much as before. A column
    /// that drifts takes along the state from which the others are predicted. In a larger unit it
    /// would be still, and the others would make sense.
    fn is_of_others(&self, hypothesis: &Hypothesis, given: &Misses, misses: &Misses) -> bool {
        let missed = Settings::missed(misses, 1.0);
        let of = |place: usize| {
            let pairs = [
                (given.miss[place], misses.miss[place]),
                (given.start_miss[place], misses.start_miss[place]),
            ];
            let [from, to]: [Vec<f64>; 2] = pairs.into_iter().unzip().into();
            self.settings.logarithm(&from, &to)
        };
        let quantities = hypothesis.quantities.iter().map(|&q| &self.quantities[q]);
        let mut own = quantities.filter(|q| !q.command).map(|q| q.place);
        hypothesis.fault != Fault::Clock
            && own.any(|place| missed[place] && of(place) < self.settings.even)
    }

    /// Whether a fault increases the misses of some log by as much as it must shrink those of all
    /// for even odds.
    ///
    /// Wiring is the same in every log. A joint that begins at another position in each log, or
    /// further off from one log to the next, is no wiring fault. Clocks are exempt: one drive that
    /// sticks for a whole log hides them there.
    fn is_of_some_logs(&self, hypothesis: &Hypothesis, given: &Misses, misses: &Misses) -> bool {
        let tells = |log: usize| {
            let [from, to] = [given, misses].map(|m| self.all.of_log(m, log));
            self.settings.shrinkage(&from, &to)
        };
        hypothesis.fault != Fault::Clock
            && (0..self.record.len()).any(|log| tells(log) < -self.settings.even)
    }

    /// Whether a clock improves what no drive moves, and hardly the joints that commands move.
    ///
    /// Those joints respond late under a late clock. A frame that hangs in the air, or lies still,
    /// says nothing about commands.
    fn is_of_undriven(&self, hypothesis: &Hypothesis, given: &Misses, misses: &Misses) -> bool {
        let commands = self.quantities.iter().filter(|q| q.command);
        let driven: Vec<usize> = commands.filter_map(|q| q.joint).collect();
        let readings = || self.quantities.iter().filter(|q| !q.command);
        let is_driven = |q: &&Quantity| q.joint.is_some_and(|j| driven.contains(&j));
        let of_each = |columns: Vec<usize>| {
            let of = |m: &Misses| -> [Vec<f64>; 2] {
                [&m.miss, &m.start_miss].map(|all| columns.iter().map(|&c| all[c]).collect())
            };
            let pairs = of(given).into_iter().zip(of(misses));
            let all: f64 = pairs.map(|(a, b)| self.settings.logarithm(&a, &b)).sum();
            all / columns.len() as f64
        };
        let own: Vec<usize> = readings().filter(is_driven).map(|q| q.place).collect();
        let all = readings().map(|q| q.place).collect();
        hypothesis.fault == Fault::Clock && !own.is_empty() && of_each(own) <= DRIVEN * of_each(all)
    }

    /// Whether a unit makes a command smaller and is no better than no command at all.
    ///
    /// Where a drive responds late, a prediction without any response misses less of the motion
    /// than one that responds too early. That says nothing about the unit.
    fn is_silence(
        &mut self,
        view: &View,
        hypothesis: &Hypothesis,
        misses: &Misses,
    ) -> Result<bool> {
        let size = |view: &View, q: &Quantity| view_of(view, q).factor.abs();
        let mut quantities = hypothesis.quantities.iter().map(|&q| &self.quantities[q]);
        let smaller = |q: &&Quantity| q.command && size(&hypothesis.view, q) < size(view, q);
        let Some(command) = quantities.find(smaller) else {
            return Ok(false);
        };
        if hypothesis.fault != Fault::Unit {
            return Ok(false);
        }
        let silent = with(view, command, view_of(view, command).times(0.0));
        let of_silence = self.all.misses(&silent)?;
        let tells = self.settings.shrinkage(&of_silence, misses);
        Ok(self.settings.probability(tells, 0.0) < self.settings.named)
    }
}
