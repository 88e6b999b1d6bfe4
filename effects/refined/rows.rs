//! The effects of one simulation, attached with its values.

use std::sync::Arc;

use asid_core::error::Result;
use asid_core::target::Target;
use asid_mjcf::plant::{ForceLimit, Plant};

use super::Placed;
use super::ranges::Ranged;
use crate::catalogue::drive::BeyondRange;
use crate::{Acting, Acts, Site};

/// Effects of one simulation, in the order of those placed; `None` where one has its null values.
///
/// A [`BeyondRange`] of each drive that needs one follows.
pub(super) type Row = Vec<Option<Box<dyn Acting>>>;

/// What the effects of all simulations of a batch have in common.
pub(super) struct Effects {
    /// The machine.
    pub(super) plant: Arc<Plant>,
    /// The effects.
    pub(super) placed: Arc<Vec<Placed>>,
    /// Columns of the engine's batch that hold each effect's targets.
    pub(super) places: Vec<Vec<usize>>,
    /// Columns that change the machine, with their targets and their values in the document.
    pub(super) held: Vec<(usize, Target, f64)>,
    /// Drives whose commands effects may move beyond their range, with the columns of their gains.
    pub(super) ranged: Vec<Ranged<usize>>,
}

impl Effects {
    /// Attaches the effects with their values to a simulation, and lets them change its columns.
    ///
    /// # Errors
    /// When a value is invalid.
    pub(super) fn row(
        &self,
        given: &[Vec<f64>],
        episode: usize,
        columns: &mut [f64],
    ) -> Result<Row> {
        let all = 0..self.placed.len();
        let acts: Vec<bool> = all.clone().map(|k| !self.is_null(k, &given[k])).collect();
        let document: &Plant = &self.plant;
        let of_model = |k: &usize| self.placed[*k].effect.acts() == Acts::Model;
        let mut row: Row = all.clone().map(|_| None).collect();
        // Effects on the model come first: others may depend on their values or take them over.
        for k in all.clone().filter(|k| acts[*k] && of_model(k)) {
            let acting = self.attach(k, (document, &given[k], episode))?;
            acting.set(columns);
            row[k] = Some(acting);
        }
        let others: Vec<usize> = all.filter(|k| acts[*k] && !of_model(k)).collect();
        if others.is_empty() {
            return Ok(row);
        }
        let limits: Vec<Option<(usize, ForceLimit)>> = others
            .iter()
            .map(|&k| self.handed_over(k, given, &acts))
            .collect();
        let machine = self.machine(columns, limits.iter().copied().flatten().collect());
        let plant = machine.as_ref().unwrap_or(document);
        for (&k, limit) in others.iter().zip(&limits) {
            let acting = self.attach(k, (plant, &given[k], episode))?;
            if limit.is_none() {
                acting.set(columns);
                row[k] = Some(acting);
            }
        }
        for drive in &self.ranged {
            if drive.by.iter().any(|&k| acts[k])
                && let Some(beyond) = BeyondRange::new(plant, drive.actuator, &drive.gains)
            {
                beyond.set(columns);
                row.push(Some(Box::new(beyond)));
            }
        }
        Ok(row)
    }

    /// Whether an effect has or uses a column of the engine's batch.
    pub(super) fn uses(&self, column: usize) -> bool {
        let places = self.places.iter().flatten();
        let gains = self.ranged.iter().flat_map(|drive| &drive.gains);
        let held = self.held.iter().map(|(at, ..)| at);
        places.chain(gains).chain(held).any(|at| *at == column)
    }

    /// Whether an effect has its null values.
    fn is_null(&self, k: usize, values: &[f64]) -> bool {
        let nulls = self.placed[k].effect.parameters().iter().map(|p| p.null);
        !values.is_empty() && nulls.eq(values.iter().copied())
    }

    fn attach(
        &self,
        k: usize,
        (plant, values, episode): (&Plant, &[f64], usize),
    ) -> Result<Box<dyn Acting>> {
        let placed = &self.placed[k];
        placed.effect.attach(&Site {
            plant,
            name: &placed.site,
            values,
            columns: &self.places[k],
            episode,
        })
    }

    /// The limit of an actuator's force that an effect leaves to another one: to one that takes the
    /// drive, or else to the last one that limits it.
    fn handed_over(
        &self,
        k: usize,
        given: &[Vec<f64>],
        acts: &[bool],
    ) -> Option<(usize, ForceLimit)> {
        let placed = &self.placed[k];
        let limit = placed.effect.force_limit(&given[k])?;
        let (actuator, drive) = self.plant.drive(&placed.site).ok()?;
        let joint = &self.plant.layout.joints[drive.joint].name;
        let takes = |other: usize| {
            let by = &self.placed[other];
            let limits = || by.effect.force_limit(&given[other]).is_some();
            let takes_drive = by.effect.takes_drive() && by.site == *joint;
            takes_drive || other > k && by.site == placed.site && limits()
        };
        let taken = (0..self.placed.len()).any(|other| acts[other] && takes(other));
        taken.then_some((actuator, limit))
    }

    /// The machine with a simulation's values and these limits; `None` where it is the document's.
    fn machine(&self, columns: &[f64], limits: Vec<(usize, ForceLimit)>) -> Option<Plant> {
        let differs = |(at, _, nominal): &&(usize, Target, f64)| columns[*at] != *nominal;
        let mut differing = self.held.iter().filter(differs).peekable();
        if differing.peek().is_none() && limits.is_empty() {
            return None;
        }
        let mut plant = Plant::clone(&self.plant);
        for (at, target, nominal) in differing {
            plant.set(target, [*nominal, columns[*at]]);
        }
        plant.force_limits = limits;
        Some(plant)
    }
}
