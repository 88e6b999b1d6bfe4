//! The label of a case, as in `labels.json`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One item of dirt: a small effect that every real machine has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dirt {
    /// Name of the effect.
    pub effect: String,
    /// Element; empty if the site is the whole machine.
    pub site: String,
    /// Values by the catalogue's parameter names.
    pub parameters: BTreeMap<String, f64>,
    /// Excess gap of this item alone.
    pub excess_gap: f64,
}

/// A wiring fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WiringLabel {
    /// Name of the fault.
    pub fault: String,
    /// Columns.
    pub columns: Vec<String>,
    /// Factor, shift or delay.
    pub value: f64,
}

/// A share of the excess in one column of the logs and one regime of motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Column.
    pub signal: String,
    /// Regime ([`crate::regime`]).
    pub regime: String,
    /// Share of the squared excess.
    pub share: f64,
}

/// A case's label.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Kind of machine.
    pub world: String,
    /// Half to which the machine belongs.
    pub half: String,
    /// `none`, `single`, `pair`, `triple`, `group` or `unknown`.
    pub kind: String,
    /// Effects as `NAME@SITE`; empty for `none`.
    pub effects: Vec<String>,
    /// Values of the effects' parameters, by `NAME@SITE.parameter`.
    pub effect_parameters: BTreeMap<String, f64>,
    /// Effects that a diagnosis may lack in its catalogue although their names are agreed on.
    #[serde(default)]
    pub agreed_only: Vec<String>,
    /// True values of the study's parameters.
    pub parameters: BTreeMap<String, f64>,
    /// Other sets of effects that count as right.
    #[serde(default)]
    pub acceptable: Vec<Vec<String>>,
    /// Whether the world is dirty: everything deviates a little.
    pub dirty: bool,
    /// The items of dirt.
    pub dirt: Vec<Dirt>,
    /// Excess gap of all dirt together.
    pub dirt_gap: f64,
    /// Excess gap for which each cause alone was sized; 0 without a cause.
    pub target_gap: f64,
    /// Multiple of the gap of the dirt that the causes reach; 0 in a clean world.
    pub factor: f64,
    /// Excess gap of each cause alone, by `NAME@SITE`; a group is under its first site.
    pub own_gaps: BTreeMap<String, f64>,
    /// Excess gap of the whole world, in the motions of the logs.
    pub excess_gap: f64,
    /// Share of the squared excess in each column of the logs; empty if the excess gap is very
    /// small.
    pub signals: BTreeMap<String, f64>,
    /// The same shares by column and regime of motion, largest first; negligible ones are not
    /// listed.
    #[serde(default, rename = "where")]
    pub places: Vec<Place>,
    /// Wiring faults.
    pub wiring: Vec<WiringLabel>,
    /// Correlation of the noise from row to row; 0 is white.
    pub noise_correlation: f64,
    /// Standard deviation of the reading times about their stamps, as a share of the time between
    /// rows.
    pub jitter: f64,
    /// Faults of the log.
    pub log_faults: Vec<String>,
    /// Whether the machine hardly moves.
    pub little_excitation: bool,
    /// Whether the first row of the logs holds the initial state.
    pub starts: bool,
    /// Time step of the world, s.
    pub timestep: f64,
    /// Engine that moves the world: `mujoco` or `rapier`.
    #[serde(default = "mujoco")]
    pub engine: String,
    /// Integrator of the world.
    pub integrator: String,
    /// Gap between world and study that time step and engine alone make.
    pub integration_gap: f64,
    /// Noise of each sensor, in its unit; rad for an orientation.
    pub noise: BTreeMap<String, f64>,
    /// Earlier draws that were left out, with their reasons.
    pub left_out: Vec<String>,
    /// Salt of the seal.
    #[serde(default)]
    pub salt: String,
}

/// Engine of labels that do not name one.
fn mujoco() -> String {
    "mujoco".to_owned()
}
