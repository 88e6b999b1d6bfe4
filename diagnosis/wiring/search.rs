//! Which faults of wiring make the log's columns sense to the model.
//!
//! Hypotheses are looked at with few windows first, and those that lead with all.

use asid_core::Result;

use super::evidence::Settings;
use super::hypotheses::{self, Fault, Hypothesis, Quantity, view_of, with};
use super::record::{Recorded, Series};
use super::size::{self, Fit};
use super::view::View;
use super::windows::{Misses, Windows};

/// Faults that are looked for one after the other: beyond so many a log is better looked at by its owner.
const MOST: usize = 4;
/// Hypotheses of a round that are evaluated with all windows.
const LEADING: usize = 3;
/// Share of a column's deviation that the slope in its offset is taken over.
const OFFSET_PROBE: f64 = 0.05;
/// Longest step of an offset, in the column's deviation.
const OFFSET_STEP: f64 = 1.0;
/// Time that the slope in a delay is taken over, s.
const DELAY_PROBE: f64 = 2e-3;
/// Longest step of a delay, s: that of the first scan.
const DELAY_STEP: f64 = 0.02;

/// A fault, with what speaks for it.
#[derive(Clone, Debug)]
pub struct Found {
    /// Kind.
    pub fault: Fault,
    /// Quantities concerned, as indices.
    pub quantities: Vec<usize>,
    /// Logarithm of the factor by which misses shrink, summed over columns.
    pub shrinkage: f64,
    /// Probability.
    pub probability: f64,
}

/// What a search found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Faults, in the order in which they were found.
    pub found: Vec<Found>,
    /// How the columns are read with all of them mended.
    pub view: View,
    /// The nearest fault that is not named.
    pub next: Option<Found>,
}

/// One hypothesis, evaluated.
struct Tried {
    hypothesis: Hypothesis,
    shrinkage: f64,
    probability: f64,
}

impl Tried {
    fn found(&self) -> Found {
        Found {
            fault: self.hypothesis.fault,
            quantities: self.hypothesis.quantities.clone(),
            shrinkage: self.shrinkage,
            probability: self.probability,
        }
    }
}

/// Logs and what is looked for in them.
pub struct Search<'a> {
    /// Few windows.
    pub few: Windows<'a>,
    /// All windows.
    pub all: Windows<'a>,
    /// The logs.
    pub record: &'a [Recorded],
    /// Their columns.
    pub quantities: &'a [Quantity],
    /// When a fault is named.
    pub settings: &'a Settings,
}

impl Search<'_> {
    /// Looks for faults one after the other, each the best of its round.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn run(mut self) -> Result<Outcome> {
        let commands = self.quantities.iter().filter(|q| q.command).count();
        let view = View::as_given(self.quantities.len() - commands, commands);
        let mut outcome = Outcome {
            found: Vec::new(),
            view,
            next: None,
        };
        while outcome.found.len() < MOST {
            let Some(best) = self.best(&outcome)? else {
                break;
            };
            if best.probability < self.settings.named {
                outcome.next = Some(best.found());
                break;
            }
            outcome.found.push(best.found());
            outcome.view = best.hypothesis.view;
        }
        Ok(outcome)
    }

    /// The hypothesis of a round that shrinks misses most.
    fn best(&mut self, so_far: &Outcome) -> Result<Option<Tried>> {
        let view = &so_far.view;
        let given = self.all.misses(view)?;
        let suspects = self.suspects(&given, self.settings.suspect);
        if !suspects.iter().any(|s| *s) {
            return Ok(None);
        }
        let few = self.few.misses(view)?;
        let mut tried: Vec<Tried> = Vec::new();
        let nonsense = self.suspects(&given, self.settings.nonsense);
        for hypothesis in hypotheses::of_columns(self.quantities, view, &nonsense) {
            if self.is_refuted(&few, &hypothesis.view)? {
                continue;
            }
            let misses = self.few.misses(&hypothesis.view)?;
            tried.push(self.judged(hypothesis, &few, &misses));
        }
        for index in (0..self.quantities.len()).filter(|&i| suspects[i]) {
            tried.extend(self.offset(view, index, &few)?);
        }
        let is_clock = |f: &Found| f.fault == Fault::Clock;
        if !view.commands.is_empty() && !so_far.found.iter().any(is_clock) {
            tried.extend(self.clock(view, &few)?);
        }
        tried.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        tried.truncate(LEADING);
        let mut best: Option<Tried> = None;
        for one in tried {
            let misses = self.all.misses(&one.hypothesis.view)?;
            let mut one = self.judged(one.hypothesis, &given, &misses);
            if self.is_nonsense(view, &one.hypothesis, &misses) {
                one.probability = one.probability.min(self.settings.named / 2.0);
            }
            if best.as_ref().is_none_or(|b| one.shrinkage > b.shrinkage) {
                best = Some(one);
            }
        }
        // What is not named keeps its first size.
        match best {
            Some(best) if best.probability >= self.settings.named => {
                self.refined(view, best, &given).map(Some)
            }
            other => Ok(other),
        }
    }

    /// Quantities whose wiring is in question: columns that miss more than a share of the motion, and commands of the joints
    /// that they read.
    fn suspects(&self, misses: &Misses, share: f64) -> Vec<bool> {
        let missed = Settings::missed(misses, share);
        let any = missed.iter().any(|m| *m);
        let drives = |joint: usize| {
            let readings = self.quantities.iter().filter(|q| !q.command);
            let mut own = readings.filter(|q| q.joint == Some(joint)).peekable();
            // A joint that nothing reads shows in what others do.
            (own.peek().is_none() && any) || own.any(|q| missed[q.place])
        };
        let of = |q: &Quantity| match (q.command, q.joint) {
            (false, _) => missed[q.place],
            (true, Some(joint)) => drives(joint),
            (true, None) => any,
        };
        self.quantities.iter().map(of).collect()
    }

    /// Whether a unit makes a column larger that would then be in question again. With a unit that is far too large everything flies
    /// on, so that the column says nothing against the model, and nothing for it.
    fn is_nonsense(&self, view: &View, hypothesis: &Hypothesis, misses: &Misses) -> bool {
        let missed = Settings::missed(misses, self.settings.nonsense);
        let quantities = hypothesis.quantities.iter().map(|&q| &self.quantities[q]);
        let size = |view: &View, q: &Quantity| view_of(view, q).factor.abs();
        let larger = |q: &&Quantity| size(&hypothesis.view, q) > size(view, q);
        let mut readings = quantities.filter(|q| !q.command).filter(larger);
        hypothesis.fault == Fault::Unit && readings.any(|q| missed[q.place])
    }

    /// Whether the starts that logs give speak against a view.
    fn is_refuted(&mut self, given: &Misses, view: &View) -> Result<bool> {
        let misses = self.few.start_misses(view)?;
        let shrinkage = self.settings.logarithm(&given.start_miss, &misses);
        Ok(shrinkage < -self.settings.scale)
    }

    fn judged(&self, hypothesis: Hypothesis, given: &Misses, misses: &Misses) -> Tried {
        let shrinkage = self.settings.shrinkage(given, misses);
        let command = hypothesis
            .quantities
            .iter()
            .any(|&q| self.quantities[q].command);
        let more = match hypothesis.fault {
            Fault::Clock if hypothesis.view.readings.iter().any(|v| v.delay < 0.0) => {
                self.settings.early
            }
            Fault::Clock => self.settings.clock,
            _ if command || hypothesis.rare => self.settings.rare,
            _ => 0.0,
        };
        Tried {
            probability: self.settings.probability(shrinkage, more),
            hypothesis,
            shrinkage,
        }
    }

    /// Deviation of a column over all logs, in the quantity's unit.
    fn spread(&self, view: &View, quantity: &Quantity) -> f64 {
        let own = view_of(view, quantity);
        let all = self.record.iter().map(|r| &r.readings[own.from]);
        own.factor.abs() * Series::joined(all).spread()
    }

    /// Another zero of a column, of the size that shrinks misses most; `None` where it is small.
    fn offset(&mut self, view: &View, index: usize, given: &Misses) -> Result<Option<Tried>> {
        let quantity = &self.quantities[index];
        // The zero of a frame in space is no column's, and where bodies touch any shift of it changes what they do.
        if quantity.command || quantity.name != quantity.whole {
            return Ok(None);
        }
        let spread = self.spread(view, quantity);
        let at = |size: f64| shifted(view, quantity, size);
        // A start that the log gives tells it at once, and without the model's own faults.
        let told = self.few.start_shift(view, quantity.place)?;
        let size = match told {
            Some(size) => size,
            None => size::fit(&mut self.few, &at, offset_fit(spread, 0.0))?.0,
        };
        if size.abs() < self.settings.offset * spread {
            return Ok(None);
        }
        let misses = self.few.misses(&at(size))?;
        let hypothesis = Hypothesis {
            fault: Fault::Offset,
            quantities: vec![index],
            rare: false,
            view: at(size),
        };
        Ok(Some(self.judged(hypothesis, given, &misses)))
    }

    /// Readings that are all late by the time that shrinks misses most; `None` where it is small.
    fn clock(&mut self, view: &View, given: &Misses) -> Result<Option<Tried>> {
        let at = |delay: f64| hypotheses::delayed(view, delay);
        let mut best = (0.0, 0.0);
        for delay in hypotheses::delays() {
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
            view: at(delay),
        };
        Ok(Some(self.judged(hypothesis, given, &misses)))
    }

    fn is_a_clocks(&self, delay: f64) -> bool {
        let within = (hypotheses::EARLIEST..=hypotheses::LATEST).contains(&delay);
        within && delay.abs() >= self.settings.delay
    }

    /// A clock with its delay fitted to all windows, and the study's parameters beside it; improbable where a delay of all
    /// commands says as much: then it is the drives' own. Of a machine with one drive nothing but a start in motion can tell
    /// the two apart; of one with several, all drives are seldom late alike.
    fn clock_or_drive(&mut self, view: &View, found: Tried, given: &Misses) -> Result<Tried> {
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
        if beats < handicap {
            judged.probability = judged.probability.min(self.settings.named / 2.0);
        }
        Ok(judged)
    }

    /// The same fault with its size fitted to all windows.
    fn refined(&mut self, view: &View, found: Tried, given: &Misses) -> Result<Tried> {
        let hypothesis = found.hypothesis.clone();
        let index = hypothesis.quantities[0];
        let quantity = &self.quantities[index];
        let (view, misses) = match hypothesis.fault {
            // Given starts have told it.
            Fault::Offset if self.all.start_shift(view, quantity.place)?.is_some() => {
                return Ok(found);
            }
            Fault::Offset => {
                let spread = self.spread(view, quantity);
                let start =
                    view_of(&hypothesis.view, quantity).offset - view_of(view, quantity).offset;
                let at = |size: f64| shifted(view, quantity, size);
                let (size, misses) = size::fit(&mut self.all, &at, offset_fit(spread, start))?;
                (at(size), misses)
            }
            Fault::Clock => return self.clock_or_drive(view, found, given),
            _ => return Ok(found),
        };
        Ok(self.judged(Hypothesis { view, ..hypothesis }, given, &misses))
    }
}

/// How an offset is fitted to a column with some deviation.
fn offset_fit(spread: f64, start: f64) -> Fit {
    Fit {
        start,
        probe: OFFSET_PROBE * spread,
        longest: OFFSET_STEP * spread,
        parameters: false,
    }
}

/// How a delay is fitted.
fn delay_fit(start: f64, parameters: bool) -> Fit {
    Fit {
        start,
        probe: DELAY_PROBE,
        longest: DELAY_STEP,
        parameters,
    }
}

/// A view with the zero of one quantity moved.
fn shifted(view: &View, quantity: &Quantity, by: f64) -> View {
    let mut own = view_of(view, quantity);
    own.offset += by;
    with(view, quantity, own)
}
