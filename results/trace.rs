//! `trace.json` of a diagnosis: what its report shows besides `result.json`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable;
use crate::view::View;

/// What the report shows besides `result.json`. What a diagnosis does not have stays empty and is left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DiagnosisTrace {
    /// Readings of the first held-out episodes beside the simulations.
    pub signals: Vec<SignalTrace>,
    /// Gap on the held-out logs of each single effect that was tried to the end.
    pub ladder: Vec<Rung>,
    /// The force that the model lacks, at the degrees of freedom where most is missing, the most first.
    pub forces: Vec<ForceTrace>,
    /// The machine in 3-D.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<View>,
    /// Residuals by place, where a sensor reads a position.
    pub map: Option<Map>,
    /// Candidates that could not be tried, and why.
    pub left_out: Vec<NamedText>,
    /// What the catalogue says of the effects of the result, by name.
    pub catalogue: BTreeMap<String, EffectWords>,
    /// Number of episodes held out; 0 where it is not known.
    pub held_out: usize,
    /// Number of episodes fitted to; 0 where it is not known.
    pub fitted_to: usize,
    /// Engine of the simulations, with its version.
    pub engine: String,
    /// The command line that repeats the diagnosis.
    pub command: String,
    /// Versions and whatever else it takes: `asid`, `seed`, ….
    pub versions: Vec<NamedText>,
    /// What else lies in the folder.
    pub files: Vec<FileEntry>,
}

/// One signal of one held-out episode. What is missing or diverged is NaN.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SignalTrace {
    /// Episode's file.
    pub episode: String,
    /// Entry, `sensor` or `sensor.i`.
    pub signal: String,
    /// Unit.
    pub unit: String,
    /// Deviation of the sensor's noise, in its unit.
    #[serde(deserialize_with = "nullable::scalar")]
    pub noise: f64,
    /// Times, s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Log.
    #[serde(deserialize_with = "nullable::list")]
    pub real: Vec<f64>,
    /// The model as given.
    #[serde(deserialize_with = "nullable::list")]
    pub nominal: Vec<f64>,
    /// After fitting the study's parameters.
    #[serde(deserialize_with = "nullable::list")]
    pub identified: Vec<f64>,
    /// With the verdict's effects.
    #[serde(deserialize_with = "nullable::list")]
    pub refined: Vec<f64>,
}

impl SignalTrace {
    /// Residuals of a simulation in units of the noise; in the signal's unit where no noise is known.
    #[must_use]
    pub fn residuals(&self, simulated: &[f64]) -> Vec<f64> {
        let unit = if self.has_noise() { self.noise } else { 1.0 };
        self.real
            .iter()
            .zip(simulated)
            .map(|(real, simulated)| (real - simulated) / unit)
            .collect()
    }

    /// Root mean square of the residuals; NaN where there are none.
    #[must_use]
    pub fn gap(&self, simulated: &[f64]) -> f64 {
        let squares = self.residuals(simulated).into_iter().map(|r| r * r);
        let finite: Vec<f64> = squares.filter(|s| s.is_finite()).collect();
        (finite.iter().sum::<f64>() / finite.len() as f64).sqrt()
    }

    /// Whether residuals can be told in units of the noise.
    #[must_use]
    pub fn has_noise(&self) -> bool {
        self.noise.is_finite() && self.noise > 0.0
    }
}

/// A single effect that was tried to the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// Effect at its site.
    pub label: String,
    /// Gap with it.
    #[serde(deserialize_with = "nullable::scalar")]
    pub gap: f64,
}

/// The force that the model lacks at a degree of freedom, along the training logs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ForceTrace {
    /// Joint; with the axis (`.x`, `.rx`, …) where it has several.
    pub dof: String,
    /// Unit of forces: `N` or `N m`.
    pub unit: String,
    /// Unit of positions: `m` or `rad`.
    pub position_unit: String,
    /// Episode of the stretch.
    pub episode: String,
    /// Rows of one episode, one after the other.
    pub stretch: ForceSeries,
    /// Rows from all episodes, evenly chosen.
    pub spread: ForceSeries,
    /// Rows of a whole episode, evenly chosen: the episode of the first of the degrees of freedom, the same for all.
    /// Times and what is missing, no more.
    pub whole: ForceSeries,
}

/// Rows along which a force is missing. A column that a machine does not have is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ForceSeries {
    /// Times from the episode's first row on, s.
    #[serde(deserialize_with = "nullable::list")]
    pub time: Vec<f64>,
    /// Positions, m or rad.
    #[serde(deserialize_with = "nullable::list")]
    pub position: Vec<f64>,
    /// Speeds, m/s or rad/s.
    #[serde(deserialize_with = "nullable::list")]
    pub speed: Vec<f64>,
    /// Force of the drives as modelled, N or N m.
    #[serde(deserialize_with = "nullable::list")]
    pub load: Vec<f64>,
    /// What is missing once the study's parameters are fitted, N or N m.
    #[serde(deserialize_with = "nullable::list")]
    pub before: Vec<f64>,
    /// What is missing with the verdict's effects, N or N m.
    #[serde(deserialize_with = "nullable::list")]
    pub after: Vec<f64>,
    /// What these effects, and the values fitted with them, add to the model there, N or N m.
    #[serde(deserialize_with = "nullable::list")]
    pub law: Vec<f64>,
}

/// Residuals by place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// Names of the axes.
    pub axes: [String; 2],
    /// Unit of both axes.
    pub unit: String,
    /// Position on both axes, and the residual there in units of the noise.
    #[serde(deserialize_with = "nullable::rows")]
    pub points: Vec<[f64; 3]>,
}

/// What the catalogue says of an effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectWords {
    /// What it is, in a few words.
    pub about: String,
    /// Its parameters, by name.
    pub parameters: BTreeMap<String, ParameterWords>,
}

/// What the catalogue says of a parameter of an effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterWords {
    /// Unit; may be empty.
    pub unit: String,
    /// Value at which the effect is off.
    #[serde(deserialize_with = "nullable::scalar")]
    pub null: f64,
}

/// What a stage of a run took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageCost {
    /// Stage, such as `explore`.
    pub stage: String,
    /// Wall-clock time, s.
    #[serde(deserialize_with = "nullable::scalar")]
    pub wall_s: f64,
    /// Physics steps.
    pub physics_steps: u64,
}

/// A name and a text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedText {
    /// The name.
    pub name: String,
    /// The text.
    pub value: String,
}

impl NamedText {
    /// A name and a text.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
        }
    }
}

/// A file of a result's folder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FileEntry {
    /// Name relative to the folder.
    pub name: String,
    /// What it holds.
    pub what: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_counts_readings_that_are_there_in_units_of_the_noise() {
        let trace = SignalTrace {
            noise: 0.5,
            real: vec![1.0, f64::NAN, 2.0],
            ..SignalTrace::default()
        };
        // Residuals of 3 and 4 times the noise.
        assert!((trace.gap(&[2.5, 7.0, 0.0]) - 12.5f64.sqrt()).abs() < 1e-12);
        assert!(trace.gap(&[]).is_nan());
    }
}
