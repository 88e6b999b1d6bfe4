//! Expected information of a motion, valid where bodies make contact too.
//!
//! A contact that comes a time step earlier or later changes the readings by a jump, however short
//! the difference step in the unknown is. Divided by that step the jump looks like information: the
//! shorter the step, the more. No identification finds this information, since beyond the jump the
//! readings do not tell where it is.
//!
//! Derivatives are therefore taken twice: over a fixed step, and over about the standard deviation
//! that follows from it, which is the expected error of an estimate. Where readings are smooth both
//! agree. A jump lies within only one of the steps, or is divided by two different ones. A reading
//! therefore counts only where its two derivatives agree, and then by the smaller of them.

use asid_core::Parameter;
use asid_core::error::Result;

use crate::play::{Played, Player};
use crate::tells::{Told, derivatives, differences, differences_over};

/// Shortest half step, in prior standard deviations: above the rounding of an engine.
const SHORTEST: f64 = 1e-6;

/// Longest half step, in prior standard deviations: most machines are nearly linear over it.
const LONGEST: f64 = 0.25;

/// Ratio of two derivatives up to which they agree: smooth readings curve less over these steps.
const AGREE: f64 = 2.0;

/// Expected information of a motion.
#[derive(Clone, Debug)]
pub struct Expected {
    /// Information on which both steps agree.
    pub told: Told,
    /// Information by the slopes over the fixed step alone.
    pub by_slopes: Told,
    /// The play at the middle.
    pub played: Option<Played>,
}

impl Expected {
    /// Simulates commands about `values` of the parameters, of which the first `sought` are
    /// unknowns.
    ///
    /// Commands are `frames x nu`, with frames of `substeps` physics steps.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        player: &mut Player<'_>,
        (commands, substeps): (&[f64], usize),
        (parameters, values): (&[Parameter], &[f64]),
        sought: usize,
    ) -> Result<Self> {
        let mut play = |(points, widths): (Vec<Vec<f64>>, Vec<f64>)| -> Result<_> {
            let jobs: Vec<(&[f64], &[f64])> = points.iter().map(|p| (commands, &p[..])).collect();
            let plays = player.play(&jobs, substeps)?;
            let slopes = derivatives(player, &plays, &widths);
            Ok((slopes, plays.into_iter().next()))
        };
        let (slopes, played) = play(differences(parameters, values))?;
        let by_slopes = Told::of(slopes.as_deref(), (sought, parameters.len()));
        let deviations = by_slopes.all_deviations();
        let steps: Vec<f64> = deviations
            .iter()
            .map(|d| d.clamp(SHORTEST, LONGEST))
            .collect();
        let (again, _) = play(differences_over(parameters, values, &steps))?;
        let both = slopes.zip(again).map(|(a, b)| agreed(&a, &b));
        let told = Told::of(both.as_deref(), (sought, parameters.len()));
        Ok(Self {
            told: told.no_more_than(&by_slopes),
            by_slopes,
            played,
        })
    }
}

/// The smaller of two derivatives of each reading; zero where they disagree.
fn agreed(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let smaller = |(&x, &y): (&f64, &f64)| {
        if !(x.is_finite() && y.is_finite()) {
            return f64::NAN;
        }
        let (small, large) = if x.abs() < y.abs() { (x, y) } else { (y, x) };
        if small * large > 0.0 && large / small <= AGREE {
            small
        } else {
            0.0
        }
    };
    let columns = a.iter().zip(b);
    columns
        .map(|(a, b)| a.iter().zip(b).map(smaller).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Difference quotient of a reading with a slope of 3 and a jump of 1 between `-7e-3` and
    /// `7e-3`.
    fn derivative(step: f64) -> f64 {
        let jump = if step > 7e-3 { 1.0 } else { 0.0 };
        (2.0 * step * 3.0 + jump) / (2.0 * step)
    }

    #[test]
    fn a_jump_is_no_information_and_a_slope_is() {
        let column = |step: f64| vec![vec![derivative(step), 3.0]];
        // One step spans the jump, the other does not.
        let both = agreed(&column(0.02), &column(1e-3));
        assert_eq!(both[0], [0.0, 3.0]);
        // Both span it: a jump divided by different steps is no slope.
        assert_eq!(agreed(&column(0.25), &column(0.01))[0], [0.0, 3.0]);
        // Both see a smooth reading.
        assert!((agreed(&column(1e-3), &column(1e-4))[0][0] - 3.0).abs() < 1e-9);
    }

    #[test]
    fn what_both_agree_on_is_never_more_than_either() {
        let (a, b) = (
            vec![vec![2.0, -1.0, 4.0]],
            vec![vec![3.0, -1.0e-3, f64::NAN]],
        );
        let both = agreed(&a, &b);
        assert_eq!(both[0][..2], [2.0, 0.0]);
        assert!(both[0][2].is_nan());
    }
}
