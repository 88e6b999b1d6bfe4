//! The sets of effects that a search fitted, and the empty set, weighted against each other.

use asid_results::evidence::Evidence;

use crate::confidence::sigmoid;
use crate::judgement::Hypothesis;

use super::{Rules, closes_a_small_gap, has_skill, is_ordinary, is_small, seen};

/// Least and largest probability of `unknown` where a set is named.
const NAMED: [f64; 2] = [0.001, 0.999];
/// The same where none is named: a cause outside the catalogue may hide behind a closed gap.
const NOT_NAMED: [f64; 2] = [0.02, 0.999];

/// Sets of effects with their scores; the first is the empty set.
pub(super) struct Sets<'e> {
    evidence: &'e Evidence,
    rules: &'e Rules,
    pub(super) all: Vec<Hypothesis>,
    /// Score of each set: its evidence at the [temperature](Rules::temperature), less the price of
    /// its names.
    scores: Vec<f64>,
    /// Logarithm of the prior odds of each set, without the price of its names.
    priors: Vec<f64>,
    /// Index in `all` of each set that was tried.
    places: Vec<usize>,
    /// Index of the tried set that the search found, if it has tolerances and names nothing but
    /// what the logs show without a search.
    pub(super) ordinary: Option<usize>,
    /// Price of a name: the logarithm of the number of candidates.
    price: f64,
}

impl<'e> Sets<'e> {
    pub(super) fn of(evidence: &'e Evidence, rules: &'e Rules) -> Self {
        let price = (evidence.candidates.max(1) as f64).ln();
        let score =
            |evidence: f64, names: usize| evidence / rules.temperature - price * names as f64;
        let ordinary = evidence.found.filter(|&i| {
            let replayed = evidence.tried[i].replayed;
            is_ordinary(evidence, i) && has_skill(evidence, replayed, rules)
        });
        let mut all = vec![Hypothesis::default()];
        let (mut scores, mut priors) = (vec![0.0], vec![0.0]);
        let mut places = vec![0; evidence.tried.len()];
        let named = evidence.tried.iter().enumerate();
        let named = named.filter(|(i, set)| !set.effects.is_empty() && !is_ordinary(evidence, *i));
        for (i, set) in named {
            places[i] = all.len();
            all.push(Hypothesis {
                found: Some(i),
                labels: set.effects.clone(),
                ..Hypothesis::default()
            });
            scores.push(score(set.evidence, set.names));
            priors.push(set.prior);
        }
        for set in &evidence.fitted {
            all.push(Hypothesis {
                labels: set.effects.clone(),
                ..Hypothesis::default()
            });
            scores.push(score(set.evidence, set.names));
            priors.push(set.prior);
        }
        // With tolerances or without them, what the logs show without a search is one answer.
        let least = evidence.known.map_or(0, |i| places[i]);
        for i in (0..places.len()).filter(|&i| is_ordinary(evidence, i)) {
            places[i] = least;
        }
        if let Some(i) = ordinary {
            all[least].found = ordinary;
            scores[least] = score(evidence.tried[i].evidence, evidence.tried[i].names);
            priors[least] = evidence.tried[i].prior;
        }
        Self {
            evidence,
            rules,
            all,
            scores,
            priors,
            places,
            ordinary,
            price,
        }
    }

    /// Returns the set that stands without a search (no effect, or the known ones), and the one
    /// that the search found, if that stands.
    pub(super) fn least_and_best(&self) -> (usize, usize) {
        let (evidence, rules) = (self.evidence, self.rules);
        let least = evidence.known.map_or(0, |i| self.places[i]);
        let stands = evidence.found.filter(|&i| {
            let set = evidence.tried[i].replayed;
            has_skill(evidence, set, rules)
                && (!is_small(evidence.none) || closes_a_small_gap(evidence, set, rules))
        });
        (least, stands.map_or(least, |i| self.places[i]))
    }

    /// Gives each set its likelihood relative to the best; `seen` is the probability that there is
    /// a gap.
    pub(super) fn weigh(&mut self, (least, best): (usize, usize), seen: f64) {
        let names = self.all[best].labels.len();
        for (set, score) in self.all.iter_mut().zip(&self.scores) {
            // A set that parsimony passes over is not more probable than the one that it picks.
            let most = if set.labels.len() > names {
                -self.price
            } else {
                0.0
            };
            set.probability = (score - self.scores[best]).min(most).exp();
        }
        if best != least && self.ordinary.is_none() {
            // By chance the empty set may reach the evidence of the best, but no chance makes a
            // gap.
            self.all[least].probability *= 1.0 - seen;
        }
    }

    /// Returns the probability that nothing in the catalogue explains the gap.
    ///
    /// `seen` is the probability that there is a gap, `rest` the share of it that the best set
    /// leaves.
    pub(super) fn unknown(&self, (least, best): (usize, usize), seen: f64, rest: f64) -> f64 {
        let (evidence, rules) = (self.evidence, self.rules);
        let unexplained = sigmoid((rest / rules.unexplained).ln() / rules.sharpness);
        let unexplained = unexplained.clamp(NAMED[0], NAMED[1]);
        let [lowest, highest] = NOT_NAMED;
        match self.ordinary {
            _ if best != least => unexplained,
            Some(i) => {
                // Effects that there was no time to try may explain what tolerances leave.
                let left = evidence.tried[i].replayed.held_out;
                let is_left = if evidence.stopped {
                    self::seen(left, evidence, rules)
                } else {
                    0.0
                };
                (seen * unexplained).max(is_left).clamp(lowest, highest)
            }
            // Where replays are repeatable, a gap for which no force makes up is one of the
            // readings.
            None if evidence.is_missing || evidence.repeatable && !is_small(evidence.none) => {
                seen.clamp(lowest, highest)
            }
            None => lowest,
        }
    }

    /// Returns the sets, none larger than the best, that these data do not distinguish from it;
    /// prior odds are left out.
    pub(super) fn ambiguous(&self, best: usize) -> Vec<usize> {
        let rules = self.rules;
        let named = &self.all[best].labels;
        let score = |i: usize| self.scores[i] - self.priors[i] / rules.temperature;
        let as_likely = |i: usize| rules.temperature * (score(best) - score(i)) < rules.apart;
        let rival = |i: usize| {
            let labels = &self.all[i].labels;
            let holds_it = named.iter().all(|l| labels.contains(l));
            i != best && !holds_it && labels.len() <= named.len() && as_likely(i)
        };
        let sets = 1..self.all.len();
        sets.filter(|&i| best != 0 && rival(i)).collect()
    }
}
