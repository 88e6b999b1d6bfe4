//! A refined model as a plain MJCF document.
//!
//! What an effect is in MJCF it says itself ([`native`](crate::Effect::native)). One that only changes values of targets is those values,
//! so that effects of plugins go along as well.

use std::path::Path;

use asid_core::error::Result;
use asid_core::{Backend, Target};
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;

use crate::{Acts, EffectSpec, Native, RefinedModel, Site};

/// How an effect stands in a document.
#[derive(Clone, Debug)]
pub struct Expressed {
    /// The effect with its values.
    pub effect: EffectSpec,
    /// How well the document says it.
    pub native: Native,
}

impl Expressed {
    /// One sentence where the document does not say all of it.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let label = self.effect.label();
        match &self.native {
            Native::Whole => None,
            Native::Nearly(what) => Some(format!("{label} {what}")),
            Native::LeftOut(why) => Some(format!("{label} is left out: it {why}")),
        }
    }
}

/// A document, and how it says what the model has.
#[derive(Clone, Debug)]
pub struct PlainModel {
    /// The document.
    pub xml: String,
    /// Effects, in the model's order.
    pub effects: Vec<Expressed>,
    /// Further things that the document does not say, a sentence each.
    pub left_out: Vec<String>,
    /// Values that it sets.
    pub values: Vec<(Target, f64)>,
}

impl PlainModel {
    /// All that the document does not say as the model does, a sentence each.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let effects = self.effects.iter().filter_map(Expressed::sentence);
        effects.chain(self.left_out.iter().cloned()).collect()
    }
}

/// Writes a model for a folder, from which the document finds its assets.
///
/// # Errors
/// When the engine refuses the scene, or an effect, site or value is unknown or makes no sense.
pub fn plain(backend: &dyn Backend, model: &RefinedModel, folder: &Path) -> Result<PlainModel> {
    let compiled = backend.load(&model.scene)?;
    let mut plant = Plant::of(&model.scene)?;
    // Names and ranges as the engine compiled them.
    plant.layout = compiled.layout().clone();
    let mut document = NativeModel::new(&plant);
    let mut values: Vec<(Target, f64)> = model.parameters.clone();
    let mut expressed = Vec::with_capacity(model.effects.len());
    // In the order in which a simulation applies them.
    let mut order: Vec<&EffectSpec> = model.effects.iter().collect();
    let mut found = Vec::with_capacity(order.len());
    for spec in &order {
        found.push(spec.find(&plant)?);
    }
    let mut places: Vec<usize> = (0..order.len()).collect();
    places.sort_by_key(|&i| found[i].acts() != Acts::Command);
    for i in places {
        let (spec, effect) = (order[i], &found[i]);
        let numbers = spec.values_of(&**effect)?;
        let targets = effect.targets(&plant, &spec.site);
        let mut columns = Vec::with_capacity(targets.len());
        for target in &targets {
            let at = values.iter().position(|(t, _)| t == target);
            columns.push(match at {
                Some(at) => at,
                None => {
                    values.push((target.clone(), compiled.nominal(target)?));
                    values.len() - 1
                }
            });
        }
        let site = Site {
            plant: &plant,
            name: &spec.site,
            values: &numbers,
            columns: &columns,
            episode: 0,
        };
        let acting = effect.attach(&site)?;
        if effect.acts() == Acts::Model && !effect.steps() {
            let mut row: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
            acting.set(&mut row);
            for ((_, value), new) in values.iter_mut().zip(row) {
                *value = new;
            }
        }
        expressed.push(Expressed {
            effect: spec.clone(),
            native: effect.native(&site, &mut document)?,
        });
    }
    order.clear();
    document.values.clone_from(&values);
    let written = document.write(&model.scene, &*compiled, folder)?;
    Ok(PlainModel {
        xml: written.xml,
        effects: expressed,
        left_out: written.left_out,
        values,
    })
}
