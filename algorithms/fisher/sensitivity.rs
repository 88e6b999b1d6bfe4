//! Derivative of one reading, from the copies of an episode.
//!
//! Each entry (an unknown, or a coordinate of the start pose) has two copies: one with the entry
//! slightly increased, one with it slightly decreased. The difference of their readings divided by
//! the difference of the entry is one Jacobian column. It is divided by the noise: that of the
//! trackers plus, for some entries, the squared deviation of the reading from a straight line over
//! the copies.

use asid_readings::SignalSet;

/// Computes whitened Jacobians from the readings of an episode and its copies.
pub struct Sensitivity {
    signals: SignalSet,
    /// For each entry, whether its deviation from a straight line counts as noise.
    rough: Vec<bool>,
    jacobian: Vec<f64>,
    difference: Vec<f64>,
    below: Vec<f64>,
    noise: Vec<f64>,
}

impl Sensitivity {
    /// Sensitivities of these signals to `rough.len()` entries.
    ///
    /// `rough` says for which entries the deviation from a straight line counts as noise.
    pub fn new(signals: SignalSet, rough: Vec<bool>) -> Self {
        let rows = signals.whitened_len();
        Self {
            signals,
            jacobian: vec![0.0; rough.len() * rows],
            rough,
            difference: vec![0.0; rows],
            below: vec![0.0; rows],
            noise: vec![1.0; rows],
        }
    }

    /// Number of values of a whitened reading: the rows of a Jacobian.
    pub fn rows(&self) -> usize {
        self.signals.whitened_len()
    }

    /// The whitened Jacobian of a reading, column by column, one column per entry.
    ///
    /// `reading` returns the row of a copy: 0 is the episode itself, `1 + 2 i` has entry `i`
    /// increased and `2 + 2 i` has it decreased. `steps` are the increase and the decrease of each
    /// entry, prior-scaled. They differ where a range ends.
    pub fn jacobian<'r>(
        &mut self,
        reading: impl Fn(usize) -> &'r [f64],
        steps: &[[f64; 2]],
    ) -> &[f64] {
        let rows = self.rows();
        self.noise.fill(1.0);
        for (entry, [above, below]) in steps.iter().enumerate() {
            let step = above + below;
            let (up, down) = (reading(1 + 2 * entry), reading(2 + 2 * entry));
            self.signals.difference(up, down, &mut self.difference);
            for k in 0..rows {
                self.jacobian[entry * rows + k] = self.difference[k] / step;
            }
            if self.rough[entry] {
                // The middle's distance from the chord between the copies: zero on a straight
                // line, otherwise roughness and curvature.
                let middle = reading(0);
                self.signals.difference(up, middle, &mut self.difference);
                self.signals.difference(middle, down, &mut self.below);
                for (noise, (a, b)) in self
                    .noise
                    .iter_mut()
                    .zip(self.difference.iter().zip(&self.below))
                {
                    *noise += ((below * a - above * b) / step).powi(2);
                }
            }
        }
        for (i, j) in self.jacobian.iter_mut().enumerate() {
            *j /= self.noise[i % rows].sqrt();
        }
        &self.jacobian
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Layout;
    use asid_core::layout::Sensor;
    use asid_core::signal::Signal;

    /// Symptom: near an end of a prior's range the expected deviation was up to four times too
    /// large. Cause: the copies of an episode are then at unequal distances, and the slope was
    /// taken for roughness.
    #[test]
    fn a_straight_line_is_not_rough_where_its_range_ends() {
        let layout = Layout {
            sensors: vec![Sensor {
                name: "x".into(),
                kind: "jointpos".into(),
                address: 0,
                len: 1,
            }],
            ..Layout::default()
        };
        let signal = Signal {
            sensor: "x".into(),
            noise: 0.1,
        };
        let signals = SignalSet::new(&layout, &[signal]).unwrap();
        let mut sensitivity = Sensitivity::new(signals, vec![true]);
        // The reading is 3 times the entry: a slope of 30 in units of the noise.
        for [above, below] in [[0.3, 0.3], [0.1, 0.3], [0.0, 0.3]] {
            let readings = [[0.0], [3.0 * above], [-3.0 * below]];
            let slope = sensitivity.jacobian(|i| &readings[i], &[[above, below]]);
            assert!((slope[0] - 30.0).abs() < 1e-9, "{slope:?}");
        }
        // A deviation of one noise from a straight line counts as as much noise again.
        let readings = [[0.1], [0.3], [-0.3]];
        let slope = sensitivity.jacobian(|i| &readings[i], &[[0.1, 0.1]]);
        assert!((slope[0] - 30.0 / 2.0_f64.sqrt()).abs() < 1e-9, "{slope:?}");
    }
}
