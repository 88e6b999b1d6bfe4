//! Which faults of wiring make the log's columns sense to the model.

use asid_core::Result;

use super::evidence::Settings;
use super::hypotheses::{self, Fault, Hypothesis, Quantity, view_of, with};
use super::record::Recorded;
use super::size;
use super::view::View;
use super::windows::{Misses, Windows};

/// Faults that are looked for one after the other: beyond so many a log is better looked at by its owner.
const MOST: usize = 4;
/// Share of a column's deviation that the slope in its offset is taken over.
const OFFSET_PROBE: f64 = 0.05;
/// Longest step of an offset, in the column's deviation.
const OFFSET_STEP: f64 = 1.0;
/// Time that the slope in a delay is taken over, s.
const DELAY_PROBE: f64 = 2e-3;
/// Longest step of a delay, s: that of the first scan.
const DELAY_STEP: f64 = 0.02;

/// A fault that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Kind.
    pub fault: Fault,
    /// Quantities concerned, as indices.
    pub quantities: Vec<usize>,
    /// Logarithm of the factor by which misses shrink.
    pub shrinkage: f64,
    /// Probability.
    pub probability: f64,
}

/// One hypothesis, evaluated.
struct Tried {
    hypothesis: Hypothesis,
    misses: Misses,
    shrinkage: f64,
    probability: f64,
}

/// Looks for faults one after the other, each the best of its round; with the view that they make together.
///
/// # Errors
/// When the engine fails.
pub fn search(
    windows: &mut Windows<'_>,
    record: &[Recorded],
    quantities: &[Quantity],
    settings: &Settings,
    commands: usize,
) -> Result<(Vec<Found>, View)> {
    let readings = quantities.len() - commands;
    let mut view = View::as_given(readings, commands);
    let mut misses = windows.misses(&view)?;
    let mut found: Vec<Found> = Vec::new();
    while found.len() < MOST {
        let round = Round {
            record,
            quantities,
            settings,
            view: &view,
            misses: &misses,
        };
        let Some(best) = round.best(windows)? else {
            break;
        };
        if best.probability < settings.named {
            break;
        }
        found.push(Found {
            fault: best.hypothesis.fault,
            quantities: best.hypothesis.quantities,
            shrinkage: best.shrinkage,
            probability: best.probability,
        });
        (view, misses) = (best.hypothesis.view, best.misses);
    }
    Ok((found, view))
}

/// A round of the search: what is taken for right so far.
struct Round<'a> {
    record: &'a [Recorded],
    quantities: &'a [Quantity],
    settings: &'a Settings,
    view: &'a View,
    misses: &'a Misses,
}

impl Round<'_> {
    /// The hypothesis that shrinks misses most.
    fn best(&self, windows: &mut Windows<'_>) -> Result<Option<Tried>> {
        let suspects = self.suspects();
        let mut best: Option<Tried> = None;
        let mut take = |tried: Tried| {
            if best.as_ref().is_none_or(|b| tried.probability > b.probability) {
                best = Some(tried);
            }
        };
        for hypothesis in hypotheses::of_columns(self.quantities, self.view, &suspects) {
            if hypothesis.fault == Fault::Offset {
                if let Some(tried) = self.offset(windows, hypothesis.quantities[0])? {
                    take(tried);
                }
                continue;
            }
            let misses = windows.misses(&hypothesis.view)?;
            take(self.judged(hypothesis, misses));
        }
        if !self.view.commands.is_empty() && suspects.iter().any(|s| *s)
            && let Some(tried) = self.clock(windows)?
        {
            take(tried);
        }
        Ok(best)
    }

    /// Quantities whose wiring is in question: columns that are missed, and all commands where one is.
    fn suspects(&self) -> Vec<bool> {
        let missed = self.settings.suspects(self.misses);
        let any = missed.iter().any(|m| *m);
        let of = |q: &Quantity| if q.command { any } else { missed[q.place] };
        self.quantities.iter().map(of).collect()
    }

    fn judged(&self, hypothesis: Hypothesis, misses: Misses) -> Tried {
        let shrinkage = self.settings.shrinkage(self.misses, &misses);
        let command = hypothesis.quantities.iter().any(|&q| self.quantities[q].command);
        let more = match hypothesis.fault {
            Fault::Clock => self.settings.clock,
            _ if command => self.settings.command,
            _ => 0.0,
        };
        Tried {
            probability: self.settings.probability(shrinkage, more),
            hypothesis,
            misses,
            shrinkage,
        }
    }

    /// Another zero of a column, of the size that shrinks misses most; `None` where it is small.
    fn offset(&self, windows: &mut Windows<'_>, index: usize) -> Result<Option<Tried>> {
        let quantity = &self.quantities[index];
        if quantity.command {
            return Ok(None);
        }
        let own = view_of(self.view, quantity);
        let spreads = self.record.iter().map(|r| r.readings[own.from].spread());
        let spread = own.factor.abs() * spreads.sum::<f64>() / self.record.len() as f64;
        let at = |size: f64| {
            let mut shifted = own;
            shifted.offset += size;
            with(self.view, quantity, shifted)
        };
        let steps = (OFFSET_PROBE * spread, OFFSET_STEP * spread);
        let (size, misses) = size::fit(windows, &at, 0.0, steps)?;
        if size.abs() < self.settings.offset * spread {
            return Ok(None);
        }
        let hypothesis = Hypothesis {
            fault: Fault::Offset,
            quantities: vec![index],
            view: at(size),
        };
        Ok(Some(self.judged(hypothesis, misses)))
    }

    /// Readings that are all late by the time that shrinks misses most; `None` where it is small.
    fn clock(&self, windows: &mut Windows<'_>) -> Result<Option<Tried>> {
        let at = |delay: f64| hypotheses::delayed(self.view, delay);
        let mut best = (0.0, 0.0);
        for delay in hypotheses::delays() {
            let misses = windows.misses(&at(delay))?;
            let shrinkage = self.settings.shrinkage(self.misses, &misses);
            if shrinkage > best.1 {
                best = (delay, shrinkage);
            }
        }
        if best.1 <= 0.0 {
            return Ok(None);
        }
        let (delay, misses) = size::fit(windows, &at, best.0, (DELAY_PROBE, DELAY_STEP))?;
        if delay.abs() < self.settings.delay {
            return Ok(None);
        }
        let readings = self.quantities.iter().enumerate();
        let hypothesis = Hypothesis {
            fault: Fault::Clock,
            quantities: readings.filter(|(_, q)| !q.command).map(|(i, _)| i).collect(),
            view: at(delay),
        };
        Ok(Some(self.judged(hypothesis, misses)))
    }
}
