//! The confidence in a verdict, fitted to stored answers whose cause is known: a logistic regression of whether what is named is true.
//!
//! The numbers that stand come from earlier worlds, and are the prior: a few worlds more move them a little.

use nalgebra::{SMatrix, SVector};

use crate::judgement::Claim;

use super::{Confidence, sigmoid};

/// Numbers that are fitted.
const N: usize = 5;
/// Deviations of the prior about the numbers that stand: about what the answers that they were fitted to leave open of each.
const PRIOR: [f64; N] = [0.4, 0.15, 0.5, 0.1, 0.6];
/// Steps of Newton's method; a concave function of five numbers needs fewer.
const STEPS: usize = 50;
/// Step that changes nothing.
const SMALLEST: f64 = 1e-9;

/// A confidence that was fitted anew.
#[derive(Clone, Copy, Debug)]
pub struct Refitted {
    /// Verdicts that name something.
    pub verdicts: usize,
    /// How many of them are true, or one is that the logs do not tell from them.
    pub holds: usize,
    /// Mean logarithm of the probability of what was so, by the numbers that stand.
    pub log_score_before: f64,
    /// The same by these.
    pub log_score: f64,
    /// `confidence.named`, `.evidence`, `.stopped`, `.gap_left`, `.more_laws`.
    pub numbers: [f64; N],
}

/// What each number is multiplied by.
fn factors(claim: &Claim) -> SVector<f64, N> {
    SVector::from([1.0, claim.odds, -claim.stopped, -claim.left, -claim.more])
}

/// Probability that a claim holds.
fn probability(numbers: &SVector<f64, N>, claim: &Claim) -> f64 {
    sigmoid(numbers.dot(&factors(claim)))
}

/// Mean logarithm of the probability of what was so.
fn log_score(numbers: &SVector<f64, N>, claims: &[(Claim, bool)]) -> f64 {
    let each = claims.iter().map(|(claim, holds)| {
        let p = probability(numbers, claim);
        if *holds { p.ln() } else { (1.0 - p).ln() }
    });
    each.sum::<f64>() / claims.len() as f64
}

/// The most probable numbers, given some claims and whether they hold; `None` without any.
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
        // A whole step may go too far where all is improbable.
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
        // Of pairs four in five hold, of what names one law nine in ten.
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
