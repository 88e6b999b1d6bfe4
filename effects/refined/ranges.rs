//! Ranges of commands: they limit what a drive is given, and effects act behind them.

use asid_core::backend::Model;
use asid_core::layout::Layout;
use asid_core::target::Target;
use asid_mjcf::plant::{Drive, Plant};

use super::Placed;
use crate::Acts;
use crate::catalogue::drive::gains;

/// A drive whose command some effects may move beyond its range.
#[derive(Clone, Debug)]
pub(super) struct Ranged<G> {
    /// Index of its actuator.
    pub(super) actuator: usize,
    /// Its gains: targets, or columns of a batch.
    pub(super) gains: Vec<G>,
    /// Those effects, as indices among all.
    pub(super) by: Vec<usize>,
}

/// Finds such drives, where the engine has their gains as targets.
pub(super) fn ranged(model: &dyn Model, plant: &Plant, placed: &[Placed]) -> Vec<Ranged<Target>> {
    let mut found = Vec::new();
    for (actuator, place) in plant.layout.actuators.iter().enumerate() {
        let drive = plant.drives[actuator].filter(Drive::is_memoryless);
        let Some(drive) = drive.filter(|_| place.ctrl_range.is_some()) else {
            continue;
        };
        let joint = &plant.layout.joints[drive.joint].name;
        let moves = |p: &Placed| match p.effect.acts() {
            Acts::Command => p.site == place.name,
            _ => p.effect.takes_drive() && p.site == *joint,
        };
        let by: Vec<usize> = (0..placed.len()).filter(|&k| moves(&placed[k])).collect();
        let gains = gains(plant, actuator);
        if !by.is_empty() && gains.iter().all(|gain| model.nominal(gain).is_ok()) {
            found.push(Ranged {
                actuator,
                gains,
                by,
            });
        }
    }
    found
}

/// The machine as its effects see it: an engine has compiled the ranges of its commands, and these
/// are applied before any effect.
pub(super) fn behind_ranges(plant: &Plant, compiled: &Layout) -> Plant {
    let mut plant = plant.clone();
    let own = plant.layout.actuators.iter_mut();
    for (own, compiled) in own.zip(&compiled.actuators) {
        own.ctrl_range = compiled.ctrl_range.filter(|[low, high]| low <= high);
    }
    for drive in plant.drives.iter_mut().flatten() {
        drive.ctrl_range = None;
    }
    plant
}
