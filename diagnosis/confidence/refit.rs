//! Refit of the confidence in a verdict to stored answers whose cause is known.
//!
//! It is a logistic regression of whether what is named is true. The present coefficients come from
//! earlier worlds and are the prior: a few more worlds change them a little.

use nalgebra::{SMatrix, SVector};

use crate::judgement::Claim;

use super::{Confidence, sigmoid};

/// Number of fitted coefficients.
const N: usize = 5;
/// Standard deviations of the prior about the present coefficients: about what the answers to which
/// they were fitted leave open.
const PRIOR: [f64; N] = [0.4, 0.15, 0.5, 0.1, 0.6];
/// Maximum number of Newton steps; a concave function of five numbers needs fewer.
const STEPS: usize = 50;
/// Norm of a step that changes nothing.
const SMALLEST: f64 = 1e-9;

/// Result of a refit.
#[derive(Clone, Copy, Debug)]
pub struct Refitted {
    /// Number of verdicts that name something.
    pub verdicts: usize,
    /// Number of them that are true, or that the logs do not distinguish from a true one.
    pub holds: usize,
    /// Mean log score of the present coefficients: the logarithm of the probability of what was
    /// true.
    pub log_score_before: f64,
    /// Mean log score of the new coefficients.
    pub log_score: f64,
    /// `confidence.named`, `.evidence`, `.stopped`, `.gap_left`, `.more_laws`.
    pub numbers: [f64; N],
}

/// Returns the factors of the coefficients in the log odds.
fn factors(claim: &Claim) -> SVector<f64, N> {
    SVector::from([1.0, claim.odds, -claim.stopped, -claim.left, -claim.more])
}

/// Returns the probability that a claim holds.
fn probability(numbers: &SVector<f64, N>, claim: &Claim) -> f64 {
    sigmoid(numbers.dot(&factors(claim)))
}

/// Returns the mean logarithm of the probability of what was true.
fn log_score(numbers: &SVector<f64, N>, claims: &[(Claim, bool)]) -> f64 {
    let each = claims.iter().map(|(claim, holds)| {
        let p = probability(numbers, claim);
        if *holds { p.ln() } else { (1.0 - p).ln() }
    });
    each.sum::<f64>() / claims.len() as f64
}

/// Returns the most probable coefficients, given some claims and whether they hold; `None` without
/// claims.
#[must_use]
pub fn refit(standing: &Confidence, claims: &[(Claim, bool)]) -> Option<Refitted> {
    if claims.is_empty() {
        return None;
    }
    let c = standing;
    let prior = SVector::from([c.named, c.evidence, c.stopped, c.gap_left, c.more_laws]);
    let precision = SMatrix::<f64, N, N>::from_diagonal(&SVector::from(PRIOR.map(|d| d.powi(-2))));
    let likelihood = |numbers: &SVector<f64, N>| {
        let off = numbers - prior;
        log_score(numbers, claims) * claims.len() as f64 - 0.5 * off.dot(&(precision * off))
    };
    let mut numbers = prior;
    for _ in 0..STEPS {
        let mut slope = precision * (prior - numbers);
        let mut curvature = precision;
        for (claim, holds) in claims {
            let (x, p) = (factors(claim), probability(&numbers, claim));
            slope += x * (f64::from(u8::from(*holds)) - p);
            curvature += x * x.transpose() * (p * (1.0 - p));
        }
        // A whole step may overshoot where everything is improbable.
        let mut step = curvature.cholesky()?.solve(&slope);
        while likelihood(&(numbers + step)) < likelihood(&numbers) && step.norm() > SMALLEST {
            step *= 0.5;
        }
        numbers += step;
    }
    Some(Refitted {
        verdicts: claims.len(),
        holds: claims.iter().filter(|c| c.1).count(),
        log_score_before: log_score(&prior, claims),
        log_score: log_score(&numbers, claims),
        numbers: numbers.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLAIM: Claim = Claim {
        odds: 0.0,
        stopped: 0.0,
        left: 0.0,
        more: 0.0,
    };

    #[test]
    fn without_a_claim_there_is_nothing_to_fit() {
        assert!(refit(&Confidence::default(), &[]).is_none());
    }

    #[test]
    fn many_answers_outweigh_the_numbers_that_stand() {
        // Four in five pairs hold, and nine in ten of the verdicts that name one law.
        let of = |more: f64, n: usize, holds: usize| {
            (0..n).map(move |i| (Claim { more, ..CLAIM }, i < holds))
        };
        let claims: Vec<_> = of(0.0, 10_000, 9_000)
            .chain(of(1.0, 10_000, 8_000))
            .collect();
        let found = refit(&Confidence::default(), &claims).unwrap();
        let [named, .., more_laws] = found.numbers;
        assert!((named - 9.0_f64.ln()).abs() < 0.05, "{named}");
        assert!(
            (named - more_laws - 4.0_f64.ln()).abs() < 0.05,
            "{more_laws}"
        );
        assert!(found.log_score > found.log_score_before);
    }

    #[test]
    fn a_single_answer_hardly_moves_them() {
        let standing = Confidence::default();
        let found = refit(&standing, &[(CLAIM, true)]).unwrap();
        assert!((found.numbers[0] - standing.named).abs() < 0.2);
    }
}
