//! How large the gap is, where it lies, and how it is shared out.

use serde::{Deserialize, Serialize};

use crate::nullable;

/// Gap of one sensor, root mean square in units of its noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SignalGap {
    /// Sensor.
    pub signal: String,
    /// Deviation of its noise, in its unit.
    #[serde(deserialize_with = "nullable::scalar")]
    pub noise: f64,
    /// Unit.
    pub unit: String,
    /// The model as given.
    #[serde(deserialize_with = "nullable::scalar")]
    pub nominal: f64,
    /// After fitting the study's own parameters.
    #[serde(deserialize_with = "nullable::scalar")]
    pub identified: f64,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub refined: f64,
}

/// Gaps on the logs held out, root mean square in units of the noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Gap {
    /// 1 by definition.
    #[serde(deserialize_with = "nullable::scalar")]
    pub noise_floor: f64,
    /// The model as given.
    #[serde(deserialize_with = "nullable::scalar")]
    pub nominal: f64,
    /// After fitting the study's own parameters.
    #[serde(deserialize_with = "nullable::scalar")]
    pub identified: f64,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub refined: f64,
    /// Share of the excess squared gap that they close, negative where they widen it; null where there is none.
    pub closed: Option<f64>,
    /// 95 % interval of it, by a bootstrap over episodes; null where fewer than three are held out.
    pub closed_interval95: Option<[f64; 2]>,
    /// By what it goes with; `None` where there is none.
    #[serde(default)]
    pub shares: Option<Shares>,
    /// Probability that a machine that lacks nothing shows as much evidence for its best candidate; `None` where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// By sensor.
    pub signals: Vec<SignalGap>,
}

/// How the excess squared gap is shared out; the sum is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Shares {
    /// Closed by the verdict's effects.
    #[serde(deserialize_with = "nullable::scalar")]
    pub named: f64,
    /// Left by them, and foretold by a regression on position, speed, load and time.
    #[serde(deserialize_with = "nullable::scalar")]
    pub learnable: f64,
    /// Left by both.
    #[serde(deserialize_with = "nullable::scalar")]
    pub unrepeatable: f64,
}

impl Default for Gap {
    fn default() -> Self {
        Self {
            noise_floor: 1.0,
            nominal: f64::NAN,
            identified: f64::NAN,
            refined: f64::NAN,
            closed: None,
            closed_interval95: None,
            shares: None,
            p_value: None,
            signals: Vec::new(),
        }
    }
}

/// A share of the excess squared residual.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "Place")]
pub struct Where {
    /// Entry of a sensor.
    pub signal: String,
    /// Regime of motion.
    pub regime: String,
    /// Share of the excess.
    #[serde(deserialize_with = "nullable::scalar")]
    pub share: f64,
    /// A readable condition under which it arises, where one is found.
    pub condition: Option<String>,
}
