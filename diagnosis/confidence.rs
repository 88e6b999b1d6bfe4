//! How far a verdict is to be trusted: probabilities that hold on worlds whose cause is known.
//!
//! Evidence compares explanations under one noise model, and no machine has just that noise: differences of hundreds mean less
//! than they say. What a verdict's probability is was counted instead, on training worlds: a logistic regression of whether what is named is
//! among the true causes. It says by how much a verdict is less sure where a search was cut short, and where a gap is left beside what is named.

mod refit;

use crate::judgement::{Claim, Hypothesis, Judgement};

pub use refit::{Refitted, refit};

/// What a verdict's probability goes with. The first five are the most probable given the 72 named verdicts of 140 training worlds of all kinds, 50 of them
/// right (seeds 1129501, 1129701 and 1131001; docs/diagnosis-method.md), upon the numbers that 127 others gave ([`refit`]); left out one by one, they have a
/// mean log score of -0.36, the numbers before -0.38, a constant -0.62.
#[derive(Clone, Debug)]
pub struct Confidence {
    /// Log odds of a verdict that is as probable as its rivals and closes nothing.
    pub named: f64,
    /// By how much the log odds of the verdict among the hypotheses count.
    pub evidence: f64,
    /// Log odds that it loses where the search was cut short.
    pub stopped: f64,
    /// Log odds that it loses by the logarithm of the share of the gap that it leaves.
    pub gap_left: f64,
    /// Log odds that it loses by each law that it names beside the first: all of them have to be true.
    pub more_laws: f64,
    /// Most that `none` may be where small things of everything make up for a gap: six of eight such answers were right in training worlds of all
    /// kinds (seeds 9101 and 9808), and a cause that stands out by less than tolerances was behind the others.
    pub ordinary: f64,
    /// Most that `unknown` may be: of 16 training worlds in which nothing was named although a gap was there, 8 had a cause that
    /// the catalogue has not.
    pub unknown: f64,
    /// Share of what the verdict leaves that goes to `unknown`: a cause of no catalogue was behind 3 of 17 wrong names.
    pub beside: f64,
    /// Deviation of the logarithm of a fitted evidence about the screened one, by which sets that were screened only
    /// have their share: half as much again, or less, is usual.
    pub screening: f64,
}

impl Default for Confidence {
    fn default() -> Self {
        Self {
            named: -2.01,
            evidence: 0.42,
            stopped: 1.42,
            gap_left: 0.40,
            more_laws: 1.64,
            ordinary: 0.7,
            unknown: 0.55,
            beside: 0.2,
            screening: 0.5,
        }
    }
}

/// What is known of a verdict beside its evidence.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// Share of the power of the gap, of the logs held out and without the engine's own error, that its replays leave.
    pub left: f64,
    /// Whether the search was cut short.
    pub stopped: bool,
    /// Laws that it names, each at one site or at several.
    pub laws: usize,
    /// Whether it names none because tolerances make up for a gap.
    pub within_tolerances: bool,
}

/// Probabilities beyond which evidence says no more.
const CLIP: [f64; 2] = [0.02, 0.98];
/// Most that `unknown` may be beside one law that a search names which came to its end, relative to it: of 15 such names that left a gap, of the
/// training worlds above, 12 were right.
const LESS: f64 = 0.9;
/// Share of a gap's power below which what is left tells no more: that of the noise beside a gap of thirty.
const CLOSED: f64 = 1e-3;
/// Most sets that were screened only and are listed.
const LISTED: usize = 8;

/// A set that was screened and not fitted.
pub struct Untried {
    /// Its effects, sorted.
    pub labels: Vec<String>,
    /// Its weight, relative to the best set.
    pub weight: f64,
}

/// The logistic function: from log odds to a probability.
pub(crate) fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Distribution function of the standard normal, to 1e-7 (Abramowitz and Stegun 1964, 26.2.17).
fn normal(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let series = [
        0.319_381_530,
        -0.356_563_782,
        1.781_477_937,
        -1.821_255_978,
        1.330_274_429,
    ];
    let tail = series.iter().rev().fold(0.0, |sum, c| t * (c + sum));
    let upper = (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt() * tail;
    if x > 0.0 { 1.0 - upper } else { upper }
}

/// What is claimed by a verdict of which, and of what the logs do not tell from it, evidence says the probability `raw`.
fn claim(raw: f64, shown: Shown) -> Claim {
    let p = raw.clamp(CLIP[0], CLIP[1]);
    Claim {
        odds: (p / (1.0 - p)).ln(),
        stopped: f64::from(u8::from(shown.stopped)),
        left: shown.left.clamp(CLOSED, 1.0).ln(),
        more: shown.laws.saturating_sub(1) as f64,
    }
}

impl Confidence {
    /// Log odds that a claim holds: that all effects of a verdict, or of a set that the logs do not tell from it, are among the true ones.
    #[must_use]
    pub fn log_odds(&self, claim: &Claim) -> f64 {
        self.named + self.evidence * claim.odds
            - self.stopped * claim.stopped
            - self.gap_left * claim.left
            - self.more_laws * claim.more
    }

    /// Probability that a set would pass the best one if it were fitted, of which a screening has the evidence `relative` to that of the best.
    #[must_use]
    pub fn passes(&self, relative: f64) -> f64 {
        normal(relative.max(f64::MIN_POSITIVE).ln() / self.screening)
    }

    /// Probabilities of a verdict with what the logs do not tell from it, of all its rivals, and of `unknown`. `p` is the calibrated probability of
    /// the first, `rivals` what the likelihoods of the others, relative to its own, come to. What neither takes is `unknown`. It stays `less`
    /// probable than one law that a whole search names; a search that was cut short names what closes most, and is mostly wrong.
    fn shares(&self, (p, less): (f64, bool), rivals: f64) -> [f64; 3] {
        let rest = 1.0 - p;
        let most = (1.0 - self.beside) * rest;
        if rivals >= most {
            return [p, most, rest - most];
        }
        let unknown = rest - rivals;
        let unknown = if less { unknown.min(LESS * p) } else { unknown };
        let sum = p + rivals + unknown;
        [p / sum, rivals / sum, unknown / sum]
    }

    /// Gives the hypotheses of a judgement the probabilities that hold; the verdict stays what it is.
    pub fn settle(&self, judgement: &mut Judgement, shown: Shown, untried: &[Untried]) {
        let best = judgement.best_explanation().clone();
        let is_none = best.labels.is_empty() && !judgement.is_unknown;
        let is_named = !is_none && !judgement.is_unknown;
        if is_none && !shown.within_tolerances {
            return;
        }
        let holds = |h: &Hypothesis| match is_none {
            true => h.labels.is_empty(),
            false => best.labels.iter().all(|l| h.labels.contains(l)),
        };
        // Of what is given to hypotheses: those that hold the verdict's effects, the others, and those that were not fitted.
        let weight =
            |h: &Hypothesis| (h.probability / best.probability.max(f64::MIN_POSITIVE)).min(1.0);
        let listed = untried.iter().take(LISTED);
        judgement.hypotheses.extend(listed.map(|u| Hypothesis {
            labels: u.labels.clone(),
            probability: best.probability * u.weight,
            ..Hypothesis::default()
        }));
        let is_alike: Vec<bool> = (0..judgement.hypotheses.len())
            .map(|i| judgement.ambiguous.contains(&i))
            .collect();
        let all = || judgement.hypotheses.iter().zip(&is_alike);
        let weights = |side: [bool; 2]| -> f64 {
            let own = all().filter(|&(h, alike)| [holds(h), *alike && !holds(h)] == side);
            own.map(|(h, _)| weight(h)).sum()
        };
        let (with, alike, others) = (
            weights([true, false]),
            weights([false, true]),
            weights([false, false]),
        );
        // Which of sets that the logs do not tell apart is right is another question than whether one of them is.
        let of_alike = all().filter(|&(h, alike)| *alike && !holds(h));
        let of_alike: f64 = of_alike.map(|(h, _)| h.probability).sum();
        let marginal = judgement.marginal(&best.labels) + of_alike;
        // What is left of the gap counts by itself.
        let raw = marginal / (1.0 - judgement.unknown).max(f64::MIN_POSITIVE);
        let first = with + alike;
        let [p, rivals, unknown] = if is_named || is_none {
            let (p, less) = if is_named {
                let claim = claim(raw, shown);
                judgement.claim = Some(claim);
                let p = sigmoid(self.log_odds(&claim));
                (p, !shown.stopped && shown.laws < 2)
            } else {
                (self.ordinary.min(best.probability), true)
            };
            self.shares((p, less), p * with / first * others)
        } else {
            let unknown = judgement.unknown.min(self.unknown);
            let each = (1.0 - unknown) / (first + others);
            [each * first, each * others, unknown]
        };
        for (h, alike) in judgement.hypotheses.iter_mut().zip(is_alike) {
            let share = if alike || holds(h) {
                p / first
            } else {
                rivals / others.max(f64::MIN_POSITIVE)
            };
            h.probability = share * weight(h);
        }
        judgement.unknown = unknown;
        judgement.sort();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judgement(sets: &[(&[&str], f64)], best: usize, unknown: f64) -> Judgement {
        let hypothesis = |(i, (labels, probability)): (usize, &(&[&str], f64))| Hypothesis {
            found: (!labels.is_empty()).then_some(i),
            labels: labels.iter().map(|&l| l.to_owned()).collect(),
            probability: *probability,
        };
        Judgement {
            hypotheses: sets.iter().enumerate().map(hypothesis).collect(),
            unknown,
            is_unknown: unknown > sets[best].1,
            best,
            ambiguous: Vec::new(),
            rest: 0.0,
            claim: None,
        }
    }

    fn shown(left: f64, stopped: bool) -> Shown {
        Shown {
            left,
            stopped,
            laws: 1,
            within_tolerances: false,
        }
    }

    fn sum(j: &Judgement) -> f64 {
        j.unknown + j.hypotheses.iter().map(|h| h.probability).sum::<f64>()
    }

    #[test]
    fn the_normal_distribution_is_that_of_the_tables() {
        for (x, p) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746),
            (-1.96, 0.024_997_895),
            (3.0, 0.998_650_102),
        ] {
            assert!((normal(x) - p).abs() < 2e-7, "{x}: {}", normal(x));
        }
    }

    #[test]
    fn a_whole_search_that_closes_the_gap_is_trusted_and_one_cut_short_less() {
        let sets: &[(&[&str], f64)] = &[
            (&[], 0.0),
            (&["a"], 0.97),
            (&["a", "b"], 0.01),
            (&["c"], 0.019),
        ];
        let stated = |left, stopped| {
            let mut j = judgement(sets, 1, 0.001);
            Confidence::default().settle(&mut j, shown(left, stopped), &[]);
            assert!((sum(&j) - 1.0).abs() < 1e-12);
            assert_eq!(j.best_explanation().labels, ["a"]);
            j.marginal(&["a".to_owned()])
        };
        assert!(stated(0.0, false) > 0.8);
        assert!(stated(0.3, false) < stated(0.01, false));
        assert!(stated(0.0, true) < stated(0.0, false));
        // Where no rival is near, `unknown` takes the rest, and may be more probable than the verdict.
        let mut j = judgement(sets, 1, 0.001);
        Confidence::default().settle(&mut j, shown(0.3, true), &[]);
        assert!(j.unknown > 0.5 && !j.is_unknown, "{}", j.unknown);
    }

    #[test]
    fn of_several_laws_all_have_to_be_true() {
        let sets: &[(&[&str], f64)] = &[(&[], 0.0), (&["a", "b"], 0.98)];
        let of = |laws: usize| {
            let mut j = judgement(sets, 1, 0.001);
            let shown = Shown {
                laws,
                ..shown(0.0, false)
            };
            Confidence::default().settle(&mut j, shown, &[]);
            j.best_explanation().probability
        };
        assert!(of(1) > 0.8, "a group of sites is one law");
        assert!(of(1) > of(2) && of(2) > of(3));
    }

    #[test]
    fn what_was_screened_only_has_a_share_by_its_evidence() {
        let sets: &[(&[&str], f64)] = &[(&[], 0.0), (&["a"], 0.999)];
        let mut j = judgement(sets, 1, 0.001);
        let confidence = Confidence::default();
        let untried = [("b", 0.9), ("c", 0.1)].map(|(label, relative)| Untried {
            labels: vec![label.to_owned()],
            weight: confidence.passes(relative),
        });
        confidence.settle(&mut j, shown(0.3, true), &untried);
        assert!((sum(&j) - 1.0).abs() < 1e-12);
        let p = |label: &str| j.marginal(&[label.to_owned()]);
        // Of the verdict's own, as likely as they would pass it.
        let [b, c] = ["b", "c"].map(|label| p(label) / p("a"));
        assert!(b > 0.3 && c < 0.03, "{b} {c}");
    }

    #[test]
    fn none_stays_as_it_is_and_unknown_is_never_certain() {
        let mut j = judgement(&[(&[], 0.97), (&["a"], 0.01)], 0, 0.02);
        Confidence::default().settle(&mut j, shown(0.0, false), &[]);
        assert_eq!(j.best_explanation().probability, 0.97);
        // Small things of everything may hide one that is larger.
        let mut j = judgement(&[(&[], 0.97), (&["a"], 0.01)], 0, 0.02);
        let within_tolerances = Shown {
            within_tolerances: true,
            ..shown(0.0, false)
        };
        Confidence::default().settle(&mut j, within_tolerances, &[]);
        let none = j.best_explanation();
        assert!(none.labels.is_empty() && none.probability < 0.8 && !j.is_unknown);
        assert!((sum(&j) - 1.0).abs() < 1e-12);
        let mut j = judgement(&[(&[], 0.0), (&["a"], 0.001)], 1, 0.999);
        Confidence::default().settle(&mut j, shown(0.8, true), &[]);
        assert_eq!(j.unknown, 0.55);
        assert!((sum(&j) - 1.0).abs() < 1e-12);
    }
}
