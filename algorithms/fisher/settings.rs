//! Settings of Fisher information: which derivative of an episode is taken, and what is rewarded.
//!
//! There are two forms of the sensitivity:
//!
//! - *One-step*: before each control step the copies take the episode's state. Their difference is
//!   `d f_theta(s_h, a_h) / d theta`, the derivative in the paper.
//! - *Trajectory*: the copies run on from the start of the episode. Their difference is `d s_h / d
//!   theta` under the same actions: what a tracked trajectory reveals when it is replayed as a
//!   whole. Start-pose entries make sense in this form only.

use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fisher::Objective;
use asid_core::error::{Error, Result};

/// Which derivative is taken; see the module documentation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// From the episode's state, one control step at a time.
    OneStep,
    /// From the start of the episode.
    #[default]
    Trajectory,
}

impl Form {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OneStep => "one-step",
            Self::Trajectory => "trajectory",
        }
    }
}

impl FromStr for Form {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        [Self::OneStep, Self::Trajectory]
            .into_iter()
            .find(|f| f.name() == text)
            .ok_or_else(|| Error::unknown("form", text, ["one-step", "trajectory"]))
    }
}

/// How the information of an episode is computed and rewarded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FisherSettings {
    /// What a control step is rewarded for.
    pub objective: Objective,
    /// Which derivative is taken.
    pub form: Form,
    /// Estimate the start pose jointly with the unknowns (trajectory form only).
    pub nuisance: bool,
    /// Half the difference between the copies, in prior standard deviations.
    pub delta: f64,
    /// Count the copies' deviation from a straight line as noise. With contact the trajectory is
    /// rough: a difference divided by a small step is then mostly random, and an explorer that is
    /// rewarded for it seeks chaos.
    pub roughness: bool,
}

impl Default for FisherSettings {
    fn default() -> Self {
        Self {
            objective: Objective::AOptimal,
            form: Form::Trajectory,
            nuisance: true,
            delta: 0.3,
            roughness: true,
        }
    }
}

impl FisherSettings {
    /// The objective in words, such as `a-optimal (trajectory form)`.
    #[must_use]
    pub fn describe(&self) -> String {
        let start = if self.nuisance {
            ", start pose co-estimated"
        } else {
            ""
        };
        let (objective, form) = (self.objective.name(), self.form.name());
        format!("{objective} ({form} form{start})")
    }

    /// Checks that the settings make sense.
    ///
    /// # Errors
    /// [`Error::Config`] when `delta` is not finite, or is not above 0 and at most 1.
    pub fn check(&self) -> Result<()> {
        if !(self.delta.is_finite() && self.delta > 0.0 && self.delta <= 1.0) {
            return Err(Error::Config {
                key: "explorer.fisher.delta".into(),
                message: format!(
                    "must be above 0 and at most 1 prior standard deviation, not {}",
                    self.delta
                ),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_without_size_or_beyond_the_prior_is_refused() {
        let check = |delta| {
            let settings = FisherSettings {
                delta,
                ..FisherSettings::default()
            };
            settings.check()
        };
        for delta in [f64::NAN, f64::INFINITY, -0.1, 0.0, 1.1] {
            let error = check(delta).unwrap_err().to_string();
            assert!(error.contains("explorer.fisher.delta"), "{error}");
        }
        assert!(check(1.0).is_ok());
    }
}
