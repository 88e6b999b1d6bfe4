//! Unknown physical parameters: name, target, range, prior, scale and unit.
//!
//! Algorithms work in *prior-scaled* coordinates `z`: zero mean and unit standard
//! deviation under the prior, on the parameter's scale (linear or logarithmic).
//! There the prior's information is the identity, whatever the units.

use rand::Rng as _;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::rng::Rng;
use crate::target::Target;

/// Scale on which a parameter's prior is uniform and on which steps are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// The value itself.
    #[default]
    Linear,
    /// The logarithm of the value.
    Log,
    /// Two equally likely models, 0 and 1, with the targets' settings in the first and in the
    /// second.
    ///
    /// The range is `[0, 1]`; a value of 0.5 or more is the second.
    Binary([f64; 2]),
}

/// A named unknown with a uniform prior over its range, on its scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Name, such as `mass_offset`.
    pub name: String,
    /// What it sets in the scene: one target, or several that share the value.
    pub targets: Vec<Target>,
    /// Smallest and largest value, in `unit`.
    pub range: [f64; 2],
    /// Scale of the prior.
    #[serde(default)]
    pub scale: Scale,
    /// SI unit; empty for a pure number.
    #[serde(default)]
    pub unit: String,
}

/// Standard deviation of a uniform variable on `[0, 1]`.
const UNIFORM_STD: f64 = 0.288_675_134_594_812_9;

impl Parameter {
    /// Checks that range and scale make sense.
    ///
    /// # Errors
    /// When the range is not finite, is upside down or empty, or is not positive on a log scale.
    pub fn check(&self) -> Result<()> {
        let [low, high] = self.range;
        let fail = |message: String| {
            Err(Error::Parameter {
                parameter: self.name.clone(),
                message,
            })
        };
        if !(low.is_finite() && high.is_finite()) {
            return fail(format!("range [{low}, {high}] must be finite"));
        }
        if low >= high {
            return fail(format!(
                "range [{low}, {high}] is upside down or empty: the first value must be the smaller one"
            ));
        }
        if self.scale == Scale::Log && low <= 0.0 {
            return fail(format!(
                "range [{low}, {high}] must be positive on a log scale"
            ));
        }
        if let Scale::Binary([off, on]) = self.scale
            && (self.range != [0.0, 1.0] || !off.is_finite() || !on.is_finite() || off == on)
        {
            return fail(format!(
                "is binary: its range must be [0, 1], not [{low}, {high}], and its two settings finite and different"
            ));
        }
        if self.targets.is_empty() {
            return fail("has no target".into());
        }
        Ok(())
    }

    /// Value at a fraction `u` of the range, on its scale.
    #[must_use]
    pub fn from_unit(&self, u: f64) -> f64 {
        let [low, high] = self.range;
        match self.scale {
            Scale::Linear => low + u * (high - low),
            Scale::Log => (low.ln() + u * (high / low).ln()).exp(),
            Scale::Binary(_) => f64::from(u8::from(u >= 0.5)),
        }
    }

    /// Fraction of the range at a value, on its scale.
    #[must_use]
    pub fn to_unit(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        match self.scale {
            Scale::Linear | Scale::Binary(_) => (value - low) / (high - low),
            Scale::Log => (value / low).ln() / (high / low).ln(),
        }
    }

    /// Prior-scaled coordinate of a value: zero mean, unit deviation under the prior.
    #[must_use]
    pub fn to_scaled(&self, value: f64) -> f64 {
        (self.to_unit(value) - 0.5) / self.unit_std()
    }

    /// Whether it has only two values.
    #[must_use]
    pub fn is_binary(&self) -> bool {
        matches!(self.scale, Scale::Binary(_))
    }

    /// The setting of its targets at a value: the value itself, unless the parameter is binary.
    #[must_use]
    pub fn setting(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Binary([off, on]) => {
                if value >= 0.5 {
                    on
                } else {
                    off
                }
            }
            Scale::Linear | Scale::Log => value,
        }
    }

    /// The value within the range whose setting of the targets is nearest to a given one.
    #[must_use]
    pub fn value_of(&self, setting: f64) -> f64 {
        match self.scale {
            Scale::Binary([off, on]) => {
                f64::from(u8::from((setting - on).abs() < (setting - off).abs()))
            }
            Scale::Linear | Scale::Log => setting.clamp(self.range[0], self.range[1]),
        }
    }

    /// Prior standard deviation of the fraction of the range.
    fn unit_std(&self) -> f64 {
        if self.is_binary() { 0.5 } else { UNIFORM_STD }
    }

    /// Value at a prior-scaled coordinate, clamped to the range.
    #[must_use]
    pub fn from_scaled(&self, z: f64) -> f64 {
        self.from_unit((z * self.unit_std() + 0.5).clamp(0.0, 1.0))
    }

    /// Largest prior-scaled coordinate; the smallest is its negative.
    #[must_use]
    pub fn scaled_bound() -> f64 {
        0.5 / UNIFORM_STD
    }

    /// Value in the middle of the prior, on its scale.
    #[must_use]
    pub fn center(&self) -> f64 {
        self.from_unit(0.5)
    }

    /// Converts a prior-scaled deviation near `value` to the parameter's unit.
    #[must_use]
    pub fn unscale_std(&self, value: f64, scaled: f64) -> f64 {
        let [low, high] = self.range;
        scaled
            * self.unit_std()
            * match self.scale {
                Scale::Linear | Scale::Binary(_) => high - low,
                Scale::Log => value * (high / low).ln(),
            }
    }

    /// A draw from the prior.
    pub fn sample(&self, rng: &mut Rng) -> f64 {
        self.from_unit(rng.random())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Streams;

    fn parameter(range: [f64; 2], scale: Scale) -> Parameter {
        Parameter {
            name: "p".into(),
            targets: vec!["geom/a/friction/0".parse().unwrap()],
            range,
            scale,
            unit: String::new(),
        }
    }

    #[test]
    fn scaled_coordinates_have_unit_deviation_under_the_prior() {
        for scale in [Scale::Linear, Scale::Log] {
            let p = parameter([0.01, 1.0], scale);
            let mut rng = Streams::new(1).stream("t");
            let n = 20_000;
            let z: Vec<f64> = (0..n).map(|_| p.to_scaled(p.sample(&mut rng))).collect();
            let mean = z.iter().sum::<f64>() / n as f64;
            let var = z.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / n as f64;
            // Standard errors: 1/sqrt(n) = 0.007 for the mean, about 0.006 for the variance.
            assert!(
                mean.abs() < 0.03 && (var - 1.0).abs() < 0.03,
                "{mean} {var}"
            );
        }
    }

    #[test]
    fn coordinates_round_trip() {
        for scale in [Scale::Linear, Scale::Log] {
            let p = parameter([0.5, 2.0], scale);
            for u in [0.0, 0.3, 1.0] {
                let x = p.from_unit(u);
                assert!((p.to_unit(x) - u).abs() < 1e-12);
                assert!((p.from_scaled(p.to_scaled(x)) - x).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_binary_parameter_is_one_of_two_settings() {
        let p = parameter([0.0, 1.0], Scale::Binary([7.0, 0.2]));
        assert!(p.check().is_ok());
        assert_eq!([p.setting(0.0), p.setting(1.0)], [7.0, 0.2]);
        // Mean 1/2 and deviation 1/2: the two models lie one prior deviation to either side.
        assert_eq!([p.to_scaled(0.0), p.to_scaled(1.0)], [-1.0, 1.0]);
        assert_eq!([p.from_scaled(-0.2), p.from_scaled(0.2)], [0.0, 1.0]);
        let mut rng = Streams::new(2).stream("t");
        let ones = (0..2000).filter(|_| p.sample(&mut rng) == 1.0).count();
        assert!((900..1100).contains(&ones), "{ones}");
        for (range, settings) in [([0.0, 2.0], [0.0, 1.0]), ([0.0, 1.0], [3.0, 3.0])] {
            assert!(parameter(range, Scale::Binary(settings)).check().is_err());
        }
    }

    /// Symptom: a hinge with a friction of 0.3 N m, which a parameter holds with 200 N m or leaves
    /// at 0.3 N m, began as held. Cause: its setting, 0.3, was read as a value of the parameter.
    #[test]
    fn the_value_of_a_setting_is_the_one_that_sets_it() {
        let binary = parameter([0.0, 1.0], Scale::Binary([200.0, 0.3]));
        for (setting, value) in [(0.3, 1.0), (200.0, 0.0), (0.5, 1.0), (150.0, 0.0)] {
            assert_eq!(binary.value_of(setting), value, "{setting}");
        }
        assert_eq!(binary.setting(binary.value_of(0.3)), 0.3);
        let linear = parameter([0.5, 2.0], Scale::Linear);
        assert_eq!([0.1, 1.0, 7.0].map(|x| linear.value_of(x)), [0.5, 1.0, 2.0]);
    }

    #[test]
    fn ranges_upside_down_or_not_finite_are_refused() {
        for range in [
            [1.0, 0.5],
            [1.0, 1.0],
            [f64::NAN, 1.0],
            [0.0, f64::INFINITY],
        ] {
            assert!(
                parameter(range, Scale::Linear).check().is_err(),
                "{range:?}"
            );
        }
        assert!(parameter([0.0, 1.0], Scale::Log).check().is_err());
        assert!(parameter([0.1, 1.0], Scale::Log).check().is_ok());
    }
}
