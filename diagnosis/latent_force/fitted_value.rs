//! What is fitted: the study's parameters and the values of effects, each with a prior.

use asid_core::Parameter;

/// A value that is fitted, or kept, with its prior: normal about a center, cut off at the bounds.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// As a column of a batch.
    pub parameter: Parameter,
    /// Center of its prior: the model's own value, or the effect's null.
    pub center: f64,
    /// Deviation of its prior.
    pub deviation: f64,
    /// Lowest and highest value.
    pub bounds: [f64; 2],
    /// Whether it is fitted.
    pub free: bool,
    /// Whether its prior is the tolerance of an ordinary machine: over that, no slope changes.
    pub is_tolerance: bool,
}

impl Unknown {
    /// A parameter of the study about the model's own value: as uncertain as its range is wide (the deviation of a
    /// uniform distribution over it).
    #[must_use]
    pub fn of_study(parameter: &Parameter, nominal: f64) -> Self {
        let [low, high] = parameter.range;
        Self {
            parameter: parameter.clone(),
            center: nominal,
            deviation: (high - low) / 12.0_f64.sqrt(),
            bounds: [low, high],
            free: true,
            is_tolerance: false,
        }
    }

    /// Distance of a value from the center, in deviations.
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        (value - self.center) / self.deviation
    }
}
