//! Threshold of evidence that chance alone does not reach.
//!
//! A form is one way to take a candidate, with one column for each of its values. Where the effect
//! does not act, the evidence of a form is the sum over its columns of `z² g / (1 + g) / 2 - ln(1 +
//! g) / 2`, with `z` standard normal and `g` the information along a direction of the columns. How
//! often it exceeds a threshold depends on `g`. The threshold here holds for the `g` at which this
//! happens most often, which is alike in all directions (by simulation for two and three columns).

/// Number of steps of the bisections, each by a half, and of the search for the worst `g`, each by
/// a third.
const STEPS: usize = 80;

/// Returns an upper bound of the probability that the sum of squares of some standard normals
/// exceeds `square`.
///
/// For one it is Mills' ratio (Gordon 1941). Two more add a term each time (Abramowitz and Stegun
/// 1964, equations 26.4.4 and 26.4.5).
fn tail(normals: usize, square: f64) -> f64 {
    use std::f64::consts::{FRAC_2_PI, TAU};
    let half = 0.5 * square;
    let odd = !normals.is_multiple_of(2);
    // The probability for one or two normals, and the term of two more.
    let (mut sum, mut term, mut degrees) = if odd {
        let mills = 2.0 * (-half).exp() / (square * TAU).sqrt();
        (mills, (square * FRAC_2_PI).sqrt() * (-half).exp(), 1.0)
    } else {
        ((-half).exp(), half * (-half).exp(), 2.0)
    };
    while degrees + 0.5 < normals as f64 {
        sum += term;
        degrees += 2.0;
        term *= square / degrees;
    }
    sum
}

/// Returns the smallest sum of squares of the `z` of some columns whose evidence exceeds
/// `threshold`, at the worst information.
fn least_square(columns: usize, threshold: f64) -> f64 {
    let square = |log: f64| {
        let g = log.exp();
        (2.0 * threshold + columns as f64 * g.ln_1p()) * (1.0 + g) / g
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

/// Returns the evidence, a natural logarithm, that the best of some forms exceeds with at most
/// probability `rate` if no effect acts.
///
/// `columns` holds the number of columns of each form. The sum of the forms' probabilities bounds
/// that of the best (Bonferroni), however alike some forms are.
#[must_use]
pub fn threshold(columns: &[usize], rate: f64) -> f64 {
    let mut columns = columns.to_vec();
    columns.sort_unstable();
    let groups: Vec<&[usize]> = columns.chunk_by(|a, b| a == b).collect();
    let reached = |threshold: f64| -> f64 {
        let of = |group: &&[usize]| {
            let own = group[0].max(1);
            group.len() as f64 * tail(own, least_square(own, threshold))
        };
        groups.iter().map(of).sum()
    };
    // The odds themselves exceed 1 / p with at most probability p (Markov's inequality), which
    // bounds the answer from above.
    let (mut low, mut high) = (0.0, (columns.len().max(1) as f64 / rate).ln());
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if reached(middle) > rate {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use asid_core::Streams;
    use rand::Rng as _;
    use rand_distr::StandardNormal;

    use super::*;

    #[test]
    fn tails_are_those_of_the_chi_square_distribution() {
        // Percentage points of a table; Mills' bound is right to 1 / z² above.
        for (normals, square, p) in [
            (1, 10.828, 1e-3),
            (2, 13.816, 1e-3),
            (3, 16.266, 1e-3),
            (4, 18.467, 1e-3),
            (7, 24.322, 1e-3),
        ] {
            let found = tail(normals, square);
            assert!((0.999 * p..1.1 * p).contains(&found), "{normals}: {found}");
        }
    }

    #[test]
    fn at_the_threshold_the_worst_column_is_passed_as_often_as_stated() {
        for (n, rate) in [(1, 0.05), (18, 0.01), (400, 0.01)] {
            let t = threshold(&vec![1; n], rate);
            for log in -50..400 {
                let g = (0.1 * f64::from(log)).exp();
                let square = (2.0 * t + g.ln_1p()) * (1.0 + g) / g;
                let p = tail(1, square);
                assert!(p <= rate / n as f64 * (1.0 + 1e-9), "{n} {rate} {g}");
            }
        }
    }

    #[test]
    fn it_grows_with_the_forms_and_is_below_that_of_markov() {
        let t = [18, 200, 1000].map(|n| threshold(&vec![1; n], 0.01));
        assert!(t[0] < t[1] && t[1] < t[2], "{t:?}");
        assert!(t[1] < (200.0_f64 / 0.01).ln());
        assert!(threshold(&[1; 200], 0.05) < t[1]);
        assert!(threshold(&[3; 200], 0.01) > t[1]);
    }

    /// Symptom: more false names than `--false-alarms` states. Cause: a candidate with several
    /// start values, or with a value for each axis, counted as one column.
    #[test]
    fn on_noise_alone_false_names_are_as_frequent_as_stated() {
        // Candidates that are tried at four start values each, and three of a value for each axis,
        // all of the information at which chance reaches most.
        let (trials, rate, g) = (4000, 0.05, 6.0_f64);
        let columns = [vec![1; 24], vec![3; 3]].concat();
        let least = threshold(&columns, rate);
        let by_candidates = threshold(&[1; 9], rate);
        let mut random = Streams::new(1).stream("noise");
        let mut best = || -> f64 {
            let forms = columns.iter().map(|&n| {
                let squares = (0..n).map(|_| random.sample::<f64, _>(StandardNormal).powi(2));
                0.5 * squares.sum::<f64>() * g / (1.0 + g) - 0.5 * n as f64 * g.ln_1p()
            });
            forms.fold(f64::NEG_INFINITY, f64::max)
        };
        let all: Vec<f64> = (0..trials).map(|_| best()).collect();
        let share = |t: f64| all.iter().filter(|e| **e > t).count() as f64 / f64::from(trials);
        // Three standard errors of a share of 0.05.
        assert!(share(least) < rate + 0.01, "{}", share(least));
        // The bound is nearly reached: the forms are independent, and `g` is nearly the worst.
        assert!(share(least) > 0.5 * rate, "{}", share(least));
        assert!(
            share(by_candidates) > 1.5 * rate,
            "{}",
            share(by_candidates)
        );
    }
}
