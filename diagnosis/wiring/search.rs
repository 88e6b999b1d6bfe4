//! Searches for the wiring faults whose correction makes the columns agree with the model.
//!
//! Hypotheses are evaluated on a few windows first, and the leading ones on all.

mod apart;
mod clock;
mod offset;
mod refusal;

use asid_core::Result;

use super::evidence::Settings;
use super::hypotheses::{self, Fault, Hypothesis, Quantity};
use super::record::Recorded;
use super::view::View;
use super::windows::{Misses, Windows};

pub use apart::Apart;

/// Largest number of faults that are searched for in turn: a log with more needs its owner's
/// attention.
const MOST: usize = 4;
/// Hypotheses of a round that are evaluated with all windows.
const LEADING: usize = 3;

/// A fault, with its evidence.
#[derive(Clone, Debug)]
pub struct Found {
    /// Kind.
    pub fault: Fault,
    /// Indices of the quantities concerned.
    pub quantities: Vec<usize>,
    /// Logarithm of the factor by which misses shrink, summed over columns.
    pub shrinkage: f64,
    /// Probability.
    pub probability: f64,
}

/// Result of a search.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Faults, in the order in which they were found.
    pub found: Vec<Found>,
    /// View of the columns with all of the faults corrected.
    pub view: View,
    /// The most likely fault that is not named.
    pub next: Option<Found>,
}

/// One hypothesis, evaluated.
struct Tried {
    hypothesis: Hypothesis,
    /// See [`Found::shrinkage`].
    shrinkage: f64,
    probability: f64,
}

impl Tried {
    /// Returns the fault as it is reported.
    fn found(&self) -> Found {
        Found {
            fault: self.hypothesis.fault,
            quantities: self.hypothesis.quantities.clone(),
            shrinkage: self.shrinkage,
            probability: self.probability,
        }
    }
}

/// The logs, and the settings of the search.
pub struct Search<'a> {
    /// Few windows.
    pub few: Windows<'a>,
    /// All windows.
    pub all: Windows<'a>,
    /// All windows, with the damping of each joint that a position servo drives among the
    /// parameters.
    ///
    /// `None` if there is no such joint.
    pub damped: Option<Windows<'a>>,
    /// The logs.
    pub record: &'a [Recorded],
    /// Their columns.
    pub quantities: &'a [Quantity],
    /// Thresholds for naming a fault.
    pub settings: &'a Settings,
}

impl Search<'_> {
    /// Searches for faults in turn, each the best of its round.
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

    /// Returns the hypothesis of a round that shrinks misses most.
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
        let order = |a: &Tried, b: &Tried| {
            let by_probability = b.probability.total_cmp(&a.probability);
            // Among certain hypotheses, the one that shrinks misses more comes first.
            by_probability.then(b.shrinkage.total_cmp(&a.shrinkage))
        };
        tried.sort_by(order);
        tried.truncate(LEADING);
        let mut best: Option<Tried> = None;
        for one in tried {
            let misses = self.all.misses(&one.hypothesis.view)?;
            let mut one = self.judged(one.hypothesis, &given, &misses);
            if self.is_refused((view, &one.hypothesis), &given, &misses)? {
                one.probability = one.probability.min(self.settings.named / 2.0);
            }
            let weight = |t: &Tried| self.weight(t);
            if best.as_ref().is_none_or(|b| weight(&one) > weight(b)) {
                best = Some(one);
            }
        }
        // A hypothesis that is not named keeps its first size.
        match best {
            Some(best) if best.probability >= self.settings.named => {
                self.refined(view, best, &given).map(Some)
            }
            other => Ok(other),
        }
    }

    /// Weight by which hypotheses are compared: their shrinkage, less a handicap if they combine
    /// several faults.
    fn weight(&self, tried: &Tried) -> f64 {
        if tried.hypothesis.compound {
            tried.shrinkage - self.settings.rare
        } else {
            tried.shrinkage
        }
    }

    /// Which quantities are in question.
    ///
    /// These are the columns that miss more than a share of the motion, and the commands of the
    /// joints that they read.
    fn suspects(&self, misses: &Misses, share: f64) -> Vec<bool> {
        let missed = Settings::missed(misses, share);
        let any = missed.iter().any(|m| *m);
        let drives = |joint: usize| {
            let readings = self.quantities.iter().filter(|q| !q.command);
            let mut own = readings.filter(|q| q.joint == Some(joint)).peekable();
            // A joint that no sensor reads shows in the readings of others.
            (own.peek().is_none() && any) || own.any(|q| missed[q.place])
        };
        let of = |q: &Quantity| match (q.command, q.joint) {
            (false, _) => missed[q.place],
            (true, Some(joint)) => drives(joint),
            (true, None) => any,
        };
        self.quantities.iter().map(of).collect()
    }

    /// Whether the initial states that logs give contradict a view.
    fn is_refuted(&mut self, given: &Misses, view: &View) -> Result<bool> {
        let misses = self.few.start_misses(view)?;
        let shrinkage = self.settings.logarithm(&given.start_miss, &misses);
        Ok(shrinkage < -self.settings.scale)
    }

    /// Computes the shrinkage of a hypothesis, and its probability.
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

    /// Returns the same fault with its size fitted to all windows.
    fn refined(&mut self, view: &View, found: Tried, given: &Misses) -> Result<Tried> {
        match found.hypothesis.fault {
            Fault::Offset => self.refined_offset(view, found, given),
            Fault::Clock => self.clock_or_drive(view, found, given),
            _ => Ok(found),
        }
    }
}
