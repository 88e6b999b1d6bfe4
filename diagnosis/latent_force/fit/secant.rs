//! Broyden updates (Broyden 1965) of the derivatives of a segment's replay with respect to its
//! initial state.
//!
//! These derivatives cost one replay per coordinate of the initial state. A step from one initial
//! state to the next is replayed anyway. The update is the smallest change of the derivatives that
//! reproduces what the step did.

/// A replay of a segment: its residuals, the columns of its model's values, and its initial state.
#[derive(Clone, Debug, Default)]
pub(super) struct Replayed {
    /// `reading - prediction`, one per reading; NaN where a reading is missing.
    pub(super) residual: Vec<f64>,
    /// Change of each reading per standard deviation of each value, `readings x m`.
    pub(super) columns: Vec<f64>,
    /// Initial state.
    pub(super) start: Vec<f64>,
    /// Values, in standard deviations of their priors, `m`.
    pub(super) values: Vec<f64>,
}

/// Updates the derivatives `h` (`readings x nx`) of a replay to predict the next replay, whose
/// initial state differs by `change`.
///
/// Coordinates are in units of `steps`. Nothing happens if the initial state has moved by less than
/// one step, because noise would dominate the update.
pub(super) fn mend(
    h: &mut [f64],
    (before, after): (&Replayed, &Replayed),
    change: &[f64],
    steps: &[f64],
) {
    let weight: Vec<f64> = change.iter().zip(steps).map(|(c, s)| c / (s * s)).collect();
    let size: f64 = change.iter().zip(&weight).map(|(c, w)| c * w).sum();
    if size < 1.0 || before.values.len() != after.values.len() {
        return;
    }
    let (nx, m) = (change.len(), before.values.len());
    let values = after.values.iter().zip(&before.values);
    let moves: Vec<f64> = values.map(|(a, b)| a - b).collect();
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    for (i, h) in h.chunks_exact_mut(nx).enumerate() {
        let did = before.residual[i] - after.residual[i];
        let by_values = dot(&before.columns[i * m..(i + 1) * m], &moves);
        let missed = did - by_values - dot(h, change);
        if missed.is_finite() {
            let by = missed / size;
            h.iter_mut().zip(&weight).for_each(|(h, w)| *h += by * w);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn replayed(reading: &[f64], value: f64) -> Replayed {
        Replayed {
            residual: reading.iter().map(|y| 10.0 - y).collect(),
            columns: vec![0.5; reading.len()],
            start: Vec::new(),
            values: vec![value],
        }
    }

    #[test]
    fn mended_slopes_foretell_the_step_that_was_made_and_stand_across_it() {
        let steps = [0.1, 0.2];
        let change = [0.3, -0.4];
        // The second reading is missing after the step.
        let (before, mut after) = (replayed(&[1.0, 2.0], 0.0), replayed(&[1.7, 2.0], 0.2));
        after.residual[1] = f64::NAN;
        let mut h = vec![1.0, 2.0, 3.0, 4.0];
        mend(&mut h, (&before, &after), &change, &steps);
        // The reading changed by 0.7, of which 0.5 * 0.2 is due to the value.
        assert!(
            (h[0] * change[0] + h[1] * change[1] - 0.6).abs() < 1e-12,
            "{h:?}"
        );
        // Orthogonal to the step, in units of the steps, nothing is learnt: (3, -2) in those units
        // is the step, and (2, 3) is orthogonal to it.
        let across = [2.0 * steps[0], 3.0 * steps[1]];
        let told = |h: &[f64]| h[0] * across[0] + h[1] * across[1];
        assert!((told(&h[..2]) - told(&[1.0, 2.0])).abs() < 1e-12);
        assert_eq!(h[2..], [3.0, 4.0]);
    }

    #[test]
    fn a_step_within_the_noise_of_slopes_mends_nothing() {
        let mut h = vec![1.0];
        let pair = (&replayed(&[1.0], 0.0), &replayed(&[5.0], 0.0));
        mend(&mut h, pair, &[0.05], &[0.1]);
        assert_eq!(h, [1.0]);
    }
}
