//! Explanations with their probabilities, and which of them is the verdict.

/// A set of effects with its probability.
#[derive(Clone, Debug, Default)]
pub struct Hypothesis {
    /// Index in the findings of the fitted set; `None` for no effect, and for a set that was only
    /// screened.
    pub found: Option<usize>,
    /// Labels of its effects, sorted.
    pub labels: Vec<String>,
    /// Probability.
    pub probability: f64,
}

/// Inputs to the probability of a named verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// Log odds, by evidence alone, of the verdict and the sets that the logs do not distinguish
    /// from it.
    pub odds: f64,
    /// Whether the search was cut short: 0 or 1.
    pub stopped: f64,
    /// Logarithm of the share of the gap that the verdict leaves.
    pub left: f64,
    /// Number of laws that it names after the first.
    pub more: f64,
}

/// The kind of answer, with its probability.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// All sets, the most probable first.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability that nothing in the catalogue explains the gap.
    pub unknown: f64,
    /// Whether nothing in the catalogue explains the gap.
    pub is_unknown: bool,
    /// Index in `hypotheses` of the best explanation, whether or not it is the verdict.
    pub best: usize,
    /// Indices of hypotheses that these data do not distinguish from the best.
    pub ambiguous: Vec<usize>,
    /// Share of the excess that the best explanation leaves.
    pub rest: f64,
    /// Inputs to the verdict's probability, once it is calibrated, and if it names something.
    pub claim: Option<Claim>,
}

impl Judgement {
    /// Makes a judgement of weighted hypotheses, which share what `unknown` leaves; `ambiguous`
    /// ones are not distinguished from the best.
    pub(crate) fn of(
        mut hypotheses: Vec<Hypothesis>,
        (best, ambiguous): (usize, Vec<usize>),
        (unknown, rest): (f64, f64),
    ) -> Self {
        let sum: f64 = hypotheses.iter().map(|h| h.probability).sum();
        for h in &mut hypotheses {
            h.probability *= (1.0 - unknown) / sum;
        }
        // The verdict is decided here.
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

    /// Sorts the hypotheses, the most probable first.
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

    /// Returns the best explanation, whether or not it is the verdict, which may be `unknown`.
    #[must_use]
    pub fn best_explanation(&self) -> &Hypothesis {
        &self.hypotheses[self.best]
    }

    /// Returns the probability that some effects are all among the true ones: the sum over all sets
    /// that contain them.
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
