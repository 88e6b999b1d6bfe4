//! What is fitted: the study's parameters and the values of effects, each with a prior.

use asid_core::Parameter;

/// A value, fitted or fixed, with its prior: normal about a center, truncated at the bounds.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// The value as a column of a batch.
    pub parameter: Parameter,
    /// Center of its prior: the model's own value, or the effect's null.
    pub center: f64,
    /// Standard deviation of its prior.
    pub deviation: f64,
    /// Lowest and highest value.
    pub bounds: [f64; 2],
    /// Whether it is fitted.
    pub free: bool,
    /// Whether its prior is the tolerance of an ordinary machine: over so narrow a range
    /// derivatives hardly change.
    pub is_tolerance: bool,
}

impl Unknown {
    /// Returns an unknown for a parameter of the study, centered on the model's own value.
    ///
    /// Its prior standard deviation is that of a uniform distribution over its range. One with only
    /// two values has no derivative and is not fitted: replays choose among the two before the fit.
    #[must_use]
    pub fn of_study(parameter: &Parameter, nominal: f64) -> Self {
        let [low, high] = parameter.range;
        Self {
            parameter: parameter.clone(),
            center: nominal,
            deviation: (high - low) / 12.0_f64.sqrt(),
            bounds: [low, high],
            free: !parameter.is_binary(),
            is_tolerance: false,
        }
    }

    /// Distance of a value from the center, in prior standard deviations.
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        (value - self.center) / self.deviation
    }
}
