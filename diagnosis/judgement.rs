//! Explanations with their probabilities, and which of them is the verdict.

/// A set of effects with its probability.
#[derive(Clone, Debug, Default)]
pub struct Hypothesis {
    /// Place in the findings of what was fitted; `None` for no effect, and for a set that was screened only.
    pub found: Option<usize>,
    /// Labels, sorted.
    pub labels: Vec<String>,
    /// Probability.
    pub probability: f64,
}

/// What the probability of a named verdict goes with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// Log odds of the verdict, and of what the logs do not tell from it, among the hypotheses, by evidence alone.
    pub odds: f64,
    /// Whether the search was cut short: 0 or 1.
    pub stopped: f64,
    /// Logarithm of the share of the gap that the verdict leaves.
    pub left: f64,
    /// Laws that it names beside the first.
    pub more: f64,
}

/// What kind of answer, with its probability.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// All sets, most probable first.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability that nothing in the catalogue explains the gap.
    pub unknown: f64,
    /// Whether nothing in the catalogue explains the gap.
    pub is_unknown: bool,
    /// Index in `hypotheses` of the best explanation, whether or not it is the verdict.
    pub best: usize,
    /// Indices of hypotheses that these data cannot tell from it.
    pub ambiguous: Vec<usize>,
    /// Share of the excess that the best leaves.
    pub rest: f64,
    /// What the probability of the verdict goes with, once it is calibrated and where it names something.
    pub claim: Option<Claim>,
}

impl Judgement {
    /// Of hypotheses by their weights, which share what `unknown` leaves; `ambiguous` cannot be told from the best.
    pub(crate) fn of(
        mut hypotheses: Vec<Hypothesis>,
        (best, ambiguous): (usize, Vec<usize>),
        (unknown, rest): (f64, f64),
    ) -> Self {
        let sum: f64 = hypotheses.iter().map(|h| h.probability).sum();
        for h in &mut hypotheses {
            h.probability *= (1.0 - unknown) / sum;
        }
        // Here it is decided.
        let is_unknown = unknown > hypotheses[best].probability;
        let mut judgement = Self {
            is_unknown,
            hypotheses,
            unknown,
            best,
            ambiguous,
            rest,
            claim: None,
        };
        judgement.sort();
        judgement
    }

    /// Most probable first.
    pub(crate) fn sort(&mut self) {
        let mut order: Vec<usize> = (0..self.hypotheses.len()).collect();
        let p = |i: usize| self.hypotheses[i].probability;
        order.sort_by(|&a, &b| p(b).total_cmp(&p(a)));
        let place = |old: usize| order.iter().position(|&o| o == old).unwrap_or(0);
        let (best, ambiguous) = (place(self.best), self.ambiguous.iter().map(|&i| place(i)));
        let mut ambiguous: Vec<usize> = ambiguous.collect();
        ambiguous.sort_unstable();
        self.hypotheses = order.iter().map(|&i| self.hypotheses[i].clone()).collect();
        self.best = best;
        self.ambiguous = ambiguous;
    }

    /// The best explanation, whether or not it is the verdict: that may be `unknown`.
    #[must_use]
    pub fn best_explanation(&self) -> &Hypothesis {
        &self.hypotheses[self.best]
    }

    /// Probability that some effects are all among the true ones: of all sets that hold them.
    #[must_use]
    pub fn marginal(&self, labels: &[String]) -> f64 {
        let holds = |h: &&Hypothesis| labels.iter().all(|l| h.labels.contains(l));
        self.hypotheses
            .iter()
            .filter(holds)
            .map(|h| h.probability)
            .sum()
    }
}
