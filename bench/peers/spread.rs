//! A few measurements as short text: the median, the minimum and the maximum.

/// The median; for an even number of values the mean of the middle two.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// The median, with minimum and maximum in brackets, each formatted by `show`.
pub fn spread(values: &[f64], show: impl Fn(f64) -> String) -> String {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match values {
        [] => String::new(),
        [one] => show(*one),
        _ => format!(
            "{} ({} to {})",
            show(median(values)),
            show(least),
            show(most)
        ),
    }
}

/// `top` divided by `bottom`, entry by entry.
pub fn ratios(top: &[f64], bottom: &[f64]) -> Vec<f64> {
    top.iter().zip(bottom).map(|(a, b)| a / b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_the_middle_and_both_ends() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        let show = |x| format!("{x:.1}");
        assert_eq!(spread(&[3.0, 1.0, 2.0], show), "2.0 (1.0 to 3.0)");
        assert_eq!(spread(&[2.0], show), "2.0");
        assert_eq!(spread(&[], show), "");
    }
}
