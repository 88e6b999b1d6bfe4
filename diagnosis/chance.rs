//! Threshold of evidence that chance alone does not reach.
//!
//! Where an effect does not act, the evidence for its one column is `z² g / (1 + g) / 2 - ln(1 + g)
//! / 2`, with `z` standard normal and `g` the column's information. How often it exceeds a
//! threshold depends on `g`. The threshold here holds for the `g` at which this happens most often.

/// Number of steps of the bisections, each by a half, and of the search for the worst `g`, each by
/// a third.
const STEPS: usize = 80;

/// Returns an upper bound of the probability that a standard normal is further from zero than `z`:
/// Mills' ratio (Gordon 1941).
fn tail(z: f64) -> f64 {
    2.0 * (-0.5 * z * z).exp() / (z * std::f64::consts::TAU.sqrt())
}

/// Returns the square of the smallest `z` whose evidence exceeds `threshold`, at the worst
/// information.
fn least_square(threshold: f64) -> f64 {
    let square = |log: f64| {
        let g = log.exp();
        (2.0 * threshold + g.ln_1p()) * (1.0 + g) / g
    };
    // The function has one minimum. The interval reaches from nearly no information to more than
    // any log has.
    let (mut low, mut high) = (-5.0, 40.0);
    for _ in 0..STEPS {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if square(a) < square(b) {
            high = b;
        } else {
            low = a;
        }
    }
    square(0.5 * (low + high))
}

/// Returns the evidence, a natural logarithm, that the best of `n` candidates exceeds with at most
/// probability `rate` if none acts.
#[must_use]
pub fn threshold(n: usize, rate: f64) -> f64 {
    let each = rate / n.max(1) as f64;
    // The odds themselves exceed 1 / p with at most probability p (Markov's inequality), which
    // bounds the answer from above.
    let (mut low, mut high) = (0.0, -each.ln());
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if tail(least_square(middle).sqrt()) > each {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_threshold_the_worst_column_is_passed_as_often_as_stated() {
        for (n, rate) in [(1, 0.05), (18, 0.01), (400, 0.01)] {
            let t = threshold(n, rate);
            for log in -50..400 {
                let g = (0.1 * f64::from(log)).exp();
                let z = ((2.0 * t + g.ln_1p()) * (1.0 + g) / g).sqrt();
                assert!(tail(z) <= rate / n as f64 * (1.0 + 1e-9), "{n} {rate} {g}");
            }
        }
    }

    #[test]
    fn it_grows_with_the_candidates_and_is_below_that_of_markov() {
        let t = [18, 200, 1000].map(|n| threshold(n, 0.01));
        assert!(t[0] < t[1] && t[1] < t[2], "{t:?}");
        assert!(t[1] < (200.0_f64 / 0.01).ln());
        assert!(threshold(200, 0.05) < t[1]);
    }
}
