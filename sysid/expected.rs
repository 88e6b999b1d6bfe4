//! What a motion is expected to tell, where bodies touch too.
//!
//! A contact that comes a time step earlier or later changes the readings about it by a jump, however short the step in the unknown
//! is. Divided by that step the jump looks like information: the shorter the step, the more. No identification finds it, since
//! beyond the jump the readings say nothing of where it is. So derivatives are taken twice, over a fixed step and over about the deviation
//! that follows from it, which is how far an estimate is expected to be off. Where readings are smooth both are the same; a jump lies
//! within one of the steps, or is divided by two different ones. So a reading counts only where its two derivatives agree, and then
//! by the smaller of them.

use asid_core::Parameter;
use asid_core::error::Result;

use crate::play::{Played, Player};
use crate::tells::{Told, derivatives, differences, differences_over};

/// Shortest half step, in prior deviations: above the rounding of an engine.
const SHORTEST: f64 = 1e-6;

/// Longest half step, in prior deviations, over which most machines are about straight.
const LONGEST: f64 = 0.25;

/// Ratio of two derivatives up to which they agree: what is smooth bends less over these steps.
const AGREE: f64 = 2.0;

/// What a motion is expected to tell.
#[derive(Clone, Debug)]
pub struct Expected {
    /// What both steps agree on.
    pub told: Told,
    /// What the slopes over the fixed step alone say.
    pub by_slopes: Told,
    /// The play at the middle.
    pub played: Option<Played>,
}

impl Expected {
    /// From plays of commands (`frames x nu`, frames of `substeps` physics steps) about `values` of the parameters, of which the first
    /// `sought` are unknowns.
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
        Ok(Self {
            told: Told::of(both.as_deref(), (sought, parameters.len())),
            by_slopes,
            played,
        })
    }
}

/// Of two derivatives of each reading the smaller; zero where they disagree.
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

    /// A reading with a slope of 3, and a jump of 1 between `-7e-3` and `7e-3`.
    fn derivative(step: f64) -> f64 {
        let jump = if step > 7e-3 { 1.0 } else { 0.0 };
        (2.0 * step * 3.0 + jump) / (2.0 * step)
    }

    #[test]
    fn a_jump_is_no_information_and_a_slope_is() {
        let column = |step: f64| vec![vec![derivative(step), 3.0]];
        // One step goes over the jump, the other does not.
        let both = agreed(&column(0.02), &column(1e-3));
        assert_eq!(both[0], [0.0, 3.0]);
        // Both go over it: what is divided by other steps is no slope.
        assert_eq!(agreed(&column(0.25), &column(0.01))[0], [0.0, 3.0]);
        // What is smooth is seen by both.
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
