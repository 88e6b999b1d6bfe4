//! Faults of some logs alone: a column that means something else there than in the other logs.
//!
//! One log may come from another day, another driver or another script. Wiring that all logs share
//! is corrected; a fault of a few logs is reported, and they are left out. Each hypothesis is
//! evaluated on the windows of all logs: it must make sense of some logs and nonsense of the others.

use asid_core::Result;

use super::{Search, Settings};
use crate::wiring::hypotheses::{self, Fault, Hypothesis};
use crate::wiring::view::View;
use crate::wiring::windows::Misses;

/// A fault of some logs.
#[derive(Clone, Debug)]
pub struct Apart {
    /// Kind.
    pub fault: Fault,
    /// Indices of the quantities concerned.
    pub quantities: Vec<usize>,
    /// Indices of the logs.
    pub logs: Vec<usize>,
    /// Probability, of the log where it is least.
    pub probability: f64,
}

impl Search<'_> {
    /// Returns the fault that fewer than half of the logs have and the others contradict, if there
    /// is one.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn apart(&mut self, view: &View) -> Result<Option<Apart>> {
        let given = self.of_logs(view)?;
        let nonsense = self.settings.nonsense;
        let in_question = |of: &Misses| self.suspects(of, nonsense);
        let suspects: Vec<Vec<bool>> = given.iter().map(in_question).collect();
        let odd: Vec<usize> = (0..given.len())
            .filter(|&log| suspects[log].contains(&true))
            .collect();
        if odd.is_empty() || 2 * odd.len() >= given.len() {
            return Ok(None);
        }
        let of_any = |q: usize| odd.iter().any(|&log| suspects[log][q]);
        let of_any: Vec<bool> = (0..self.quantities.len()).map(of_any).collect();
        let mut best: Option<(f64, Apart)> = None;
        for hypothesis in hypotheses::of_columns(self.quantities, view, &of_any) {
            let there = self.of_logs(&hypothesis.view)?;
            let Some((shrinkage, apart)) = self.held_by(view, &hypothesis, &odd, (&given, &there))
            else {
                continue;
            };
            if best.as_ref().is_none_or(|(most, _)| shrinkage > *most) {
                best = Some((shrinkage, apart));
            }
        }
        Ok(best.map(|(_, apart)| apart))
    }

    /// Returns the logs among the `odd` ones that hold a hypothesis, with the sum of their
    /// shrinkage; `None` if there are none, or if the other logs do not contradict it.
    fn held_by(
        &self,
        view: &View,
        hypothesis: &Hypothesis,
        odd: &[usize],
        (given, there): (&[Misses], &[Misses]),
    ) -> Option<(f64, Apart)> {
        let settings: &Settings = self.settings;
        let command = hypothesis.quantities.iter();
        let command = command.clone().any(|&q| self.quantities[q].command);
        let more = if command || hypothesis.rare || hypothesis.compound {
            settings.rare
        } else {
            0.0
        };
        let tells = |log: usize| settings.shrinkage(&given[log], &there[log]);
        let probability = |log: usize| settings.probability(tells(log), more);
        let holds = |log: &usize| {
            probability(*log) >= settings.certain
                && !self.is_nonsense(view, hypothesis, &there[*log])
        };
        let logs: Vec<usize> = odd.iter().copied().filter(holds).collect();
        let others = (0..given.len()).filter(|log| !logs.contains(log));
        let others: Vec<f64> = others.map(tells).collect();
        let against = others.iter().filter(|t| **t < -settings.even).count();
        let shrinkage: f64 = logs.iter().map(|&log| tells(log)).sum();
        let least = logs.iter().map(|&log| probability(log));
        let least = least.fold(1.0, f64::min);
        (!logs.is_empty() && 2 * against > others.len()).then(|| {
            let apart = Apart {
                fault: hypothesis.fault,
                quantities: hypothesis.quantities.clone(),
                logs,
                probability: least,
            };
            (shrinkage, apart)
        })
    }

    /// Returns the misses under a view, log by log.
    fn of_logs(&mut self, view: &View) -> Result<Vec<Misses>> {
        let all = self.all.misses(view)?;
        let logs = 0..self.record.len();
        Ok(logs.map(|log| self.all.of_log(&all, log)).collect())
    }
}
