//! Writes a refined model as a plain MJCF document.
//!
//! Each effect writes itself in MJCF ([`native`](crate::Effect::native)). One that only changes
//! values of its targets is written as those values, so that effects of plugins work as well.

use std::path::Path;

use asid_core::error::Result;
use asid_core::{Backend, Target};
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;

use crate::refined::rank;
use crate::{Acts, EffectSpec, Native, RefinedModel, Site};

/// How the document expresses an effect.
#[derive(Clone, Debug)]
pub struct Expressed {
    /// The effect with its values.
    pub effect: EffectSpec,
    /// How well the document expresses it.
    pub native: Native,
}

impl Expressed {
    /// One sentence on what the document lacks of it, if anything.
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

/// A document, and how well it expresses the model.
#[derive(Clone, Debug)]
pub struct PlainModel {
    /// The document.
    pub xml: String,
    /// Effects, in the order in which a simulation applies them.
    pub effects: Vec<Expressed>,
    /// Further things that the document leaves out, a sentence each.
    pub left_out: Vec<String>,
    /// Values that it sets.
    pub values: Vec<(Target, f64)>,
}

impl PlainModel {
    /// All differences of the document from the model, a sentence each.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let effects = self.effects.iter().filter_map(Expressed::sentence);
        effects.chain(self.left_out.iter().cloned()).collect()
    }
}

/// Writes a model as a document that will stand in `folder`, so that it finds its assets.
///
/// # Errors
/// When the engine refuses the scene, or an effect, site or value is unknown or invalid.
pub fn plain(backend: &dyn Backend, model: &RefinedModel, folder: &Path) -> Result<PlainModel> {
    let compiled = backend.load(&model.scene)?;
    let mut plant = Plant::of(&model.scene)?;
    // Use the names and ranges that the engine compiled.
    plant.layout = compiled.layout().clone();
    let mut document = NativeModel::new(&plant);
    let mut values: Vec<(Target, f64)> = model.parameters.clone();
    let mut expressed = Vec::with_capacity(model.effects.len());
    // A simulation applies effects in this order.
    let mut order: Vec<&EffectSpec> = model.effects.iter().collect();
    let mut found = Vec::with_capacity(order.len());
    for spec in &order {
        found.push(spec.find(&plant)?);
    }
    let mut places: Vec<usize> = (0..order.len()).collect();
    places.sort_by_key(|&i| rank(&*found[i]));
    for i in places {
        let (spec, effect) = (order[i], &found[i]);
        let numbers = spec.values_of(&**effect)?;
        let nulls = effect.parameters().iter().map(|p| p.null);
        if !numbers.is_empty() && nulls.eq(numbers.iter().copied()) {
            // A simulation is without it.
            expressed.push(Expressed {
                effect: spec.clone(),
                native: Native::Whole,
            });
            continue;
        }
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
