//! What a case is, in the words of `labels.json`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One item of dirt: an effect that every real machine has a little of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dirt {
    /// Name of the effect.
    pub effect: String,
    /// Element; empty where it is the whole machine.
    pub site: String,
    /// Values by the catalogue's names.
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

/// A share of the excess: a column of the logs in a regime of motion.
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
    /// Half that it belongs to.
    pub half: String,
    /// `none`, `single`, `pair`, `triple`, `group` or `unknown`.
    pub kind: String,
    /// Effects as `NAME@SITE`; none of them for `none`.
    pub effects: Vec<String>,
    /// Their values: `NAME@SITE.parameter`.
    pub effect_parameters: BTreeMap<String, f64>,
    /// Effects that a diagnosis may not have in its catalogue although their names are agreed on.
    #[serde(default)]
    pub agreed_only: Vec<String>,
    /// True values of the study's parameters.
    pub parameters: BTreeMap<String, f64>,
    /// Other sets of effects that are right.
    #[serde(default)]
    pub acceptable: Vec<Vec<String>>,
    /// Whether everything is a little off.
    pub dirty: bool,
    /// What is.
    pub dirt: Vec<Dirt>,
    /// Excess gap of all dirt together.
    pub dirt_gap: f64,
    /// Excess gap that the causes were sized for, each alone; 0 without a cause.
    pub target_gap: f64,
    /// How far they stand out of the dirt; 0 in a clean world.
    pub factor: f64,
    /// Excess gap of each cause alone, by `NAME@SITE`; of a group under its first site.
    pub own_gaps: BTreeMap<String, f64>,
    /// Excess gap of the whole world, in the motions of the logs.
    pub excess_gap: f64,
    /// Share of the squared excess in each column of the logs; empty where there is no excess to speak of.
    pub signals: BTreeMap<String, f64>,
    /// The same by column and regime of motion, largest first; what has next to nothing is not listed.
    #[serde(default, rename = "where")]
    pub places: Vec<Place>,
    /// Wiring faults.
    pub wiring: Vec<WiringLabel>,
    /// Correlation of the noise from row to row; 0 is white.
    pub noise_correlation: f64,
    /// Deviation of the times of reading from their stamps, as a share of the time between rows.
    pub jitter: f64,
    /// Faults of the log.
    pub log_faults: Vec<String>,
    /// Whether the machine hardly moves.
    pub little_excitation: bool,
    /// Whether the logs hold the state of their first row.
    pub starts: bool,
    /// Time step of the world, s.
    pub timestep: f64,
    /// Engine that moves the world: `mujoco` or `rapier`.
    #[serde(default = "mujoco")]
    pub engine: String,
    /// Integrator of the world.
    pub integrator: String,
    /// Gap that time step and engine alone make between world and study.
    pub integration_gap: f64,
    /// Noise of each sensor, in its unit; rad for an orientation.
    pub noise: BTreeMap<String, f64>,
    /// Draws that were left out before this one, with the reason.
    pub left_out: Vec<String>,
    /// Salt of the seal.
    #[serde(default)]
    pub salt: String,
}

/// Engine of labels that do not say one.
fn mujoco() -> String {
    "mujoco".to_owned()
}
