//! Readings on another clock: all are late by the time that shrinks misses most, and no drive is
//! late.

use asid_core::Result;

use super::{Search, Tried};
use crate::wiring::hypotheses::{self, Fault, Hypothesis, view_of};
use crate::wiring::size::{self, Fit};
use crate::wiring::view::View;
use crate::wiring::windows::Misses;

/// Finite-difference step of a delay, s.
const DELAY_PROBE: f64 = 2e-3;
/// Largest step of a delay, s: that of the first scan.
const DELAY_STEP: f64 = 0.02;

impl Search<'_> {
    /// Delay of all readings that shrinks misses most; `None` if it is small.
    pub(super) fn clock(&mut self, view: &View, given: &Misses) -> Result<Option<Tried>> {
        let at = |delay: f64| hypotheses::delayed(view, delay);
        let mut best = (0.0, 0.0);
        let latest = self.few.latest();
        for delay in hypotheses::delays().into_iter().filter(|d| *d <= latest) {
            let misses = self.few.misses(&at(delay))?;
            let shrinkage = self.settings.shrinkage(given, &misses);
            if shrinkage > best.1 {
                best = (delay, shrinkage);
            }
        }
        if best.1 <= 0.0 {
            return Ok(None);
        }
        let (delay, misses) = size::fit(&mut self.few, &at, delay_fit(best.0, false))?;
        if !self.is_a_clocks(delay) {
            return Ok(None);
        }
        let readings = self.quantities.iter().enumerate();
        let hypothesis = Hypothesis {
            fault: Fault::Clock,
            quantities: readings
                .filter(|(_, q)| !q.command)
                .map(|(i, _)| i)
                .collect(),
            rare: false,
            compound: false,
            view: at(delay),
        };
        Ok(Some(self.judged(hypothesis, given, &misses)))
    }

    /// Whether a clock may have this delay. Behind the last reading of a log every delay fits.
    fn is_a_clocks(&self, delay: f64) -> bool {
        let within = (hypotheses::EARLIEST..=self.few.latest()).contains(&delay);
        within && delay.abs() >= self.settings.delay
    }

    /// Fits the delay of a clock, and the study's parameters with it, to all windows.
    ///
    /// The clock becomes improbable if a delay of all commands shrinks misses as much: the drives
    /// themselves are then late. With one drive, only an initial state in motion separates the two.
    /// With several, all drives are seldom late alike. It also becomes improbable if friction
    /// shrinks misses as much: a position servo of gain `kp` lags behind its command by
    /// `damping / kp`.
    pub(super) fn clock_or_drive(
        &mut self,
        view: &View,
        found: Tried,
        given: &Misses,
    ) -> Result<Tried> {
        let quantity = &self.quantities[found.hypothesis.quantities[0]];
        let start = view_of(&found.hypothesis.view, quantity).delay - view_of(view, quantity).delay;
        let nominal = self.all.theta().to_vec();
        let late_readings = |delay: f64| hypotheses::delayed(view, delay);
        let late_commands = |delay: f64| hypotheses::commanded_later(view, delay);
        let (delay, clock) = size::fit(&mut self.all, &late_readings, delay_fit(start, true))?;
        self.all.set_theta(&nominal);
        let (_, drive) = size::fit(&mut self.all, &late_commands, delay_fit(start, true))?;
        self.all.set_theta(&nominal);
        let handicap = self.settings.drive[usize::from(view.commands.len() > 1)];
        let beats = self.settings.shrinkage(&drive, &clock);
        let hypothesis = Hypothesis {
            view: late_readings(delay),
            ..found.hypothesis
        };
        let mut judged = self.judged(hypothesis, given, &clock);
        let beats_friction = match &mut self.damped {
            Some(damped) => {
                let as_they_are = |_: f64| view.clone();
                let (_, friction) = size::fit(damped, &as_they_are, delay_fit(0.0, true))?;
                self.settings.shrinkage(&friction, &clock) > 0.0
            }
            None => true,
        };
        if beats < handicap || !beats_friction {
            judged.probability = judged.probability.min(self.settings.named / 2.0);
        }
        Ok(judged)
    }
}

/// Settings of the fit of a delay.
fn delay_fit(start: f64, parameters: bool) -> Fit {
    Fit {
        start,
        probe: DELAY_PROBE,
        longest: DELAY_STEP,
        parameters,
    }
}
