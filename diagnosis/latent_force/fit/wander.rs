//! Scatter of the evidence with the point at which replays of segments are linearised.

use crate::noise::median;

/// Fewest linearisations without a rise that show a scatter: with one or two, either may be a step
/// that went far astray.
const FEWEST: usize = 3;

/// Returns the median difference between a linearisation's evidence and the best before, over those
/// without a rise.
///
/// Zero if there are too few of them. A step that went far astray is one, and so is each return to
/// the same plateau.
pub(super) fn wander(evidence: &[f64], rise: f64) -> f64 {
    let mut apart = Vec::new();
    let mut best = f64::NEG_INFINITY;
    for here in evidence {
        if *here <= best + rise {
            apart.push((best - here).abs());
        }
        best = best.max(*here);
    }
    if apart.len() < FEWEST {
        return 0.0;
    }
    median(&mut apart).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_went_far_astray_is_not_what_evidence_scatters_by() {
        // Two steps about contacts lost 2000 and 21,000, and then the plateau was found again.
        let rounds = [
            52771.6, 50557.4, 31621.3, 52785.0, 52900.1, 52900.4, 52900.9, 52901.1,
        ];
        assert!((wander(&rounds, 1.2) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn rises_that_count_are_no_scatter() {
        assert_eq!(wander(&[10.0, 40.0, 60.0], 0.5), 0.0);
        assert_eq!(wander(&[10.0, 7.0, 5.0, 6.0], 0.5), 4.0);
    }

    #[test]
    fn one_step_astray_at_the_end_of_a_fit_that_was_cut_short_is_no_scatter() {
        assert_eq!(wander(&[52_898.3, 50_008.9], 1.2), 0.0);
    }
}
