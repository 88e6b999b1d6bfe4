//! Effects and values that a label or an answer names: the start of fits.

use asid_effects::EffectSpec;

use crate::answer::Answer;
use crate::catalogue::parameters_of;
use crate::label::{Label, name_of, site_of};
use crate::sites::Sites;

/// Looks up the value of a parameter of the study by its name.
pub(super) type Known<'a> = Box<dyn Fn(&str) -> Option<f64> + 'a>;

/// Effects with values, and values of the study's parameters, from one source.
pub(super) struct Named<'a> {
    pub(super) effects: Vec<EffectSpec>,
    pub(super) parameters: Known<'a>,
}

/// The true effects, with the start values of a fit.
///
/// These are the label's values that the catalogue knows. Without any, they are those of the answer
/// if it names the same effect.
pub(super) fn truth<'a>(label: &'a Label, answer: &Answer, sites: &Sites) -> Named<'a> {
    let values = |effect: &String| -> Vec<(String, f64)> {
        let known = parameters_of(name_of(effect)).unwrap_or_default();
        let labelled = known
            .iter()
            .filter_map(|p| Some((p.name.to_owned(), label.value(effect, p.name)?)));
        let labelled: Vec<(String, f64)> = labelled.collect();
        let said = || {
            answer
                .effects
                .iter()
                .find(|e| sites.same(&e.label(), effect))
        };
        match (labelled.is_empty(), said()) {
            (true, Some(said)) => said.parameters.clone().into_iter().collect(),
            _ => labelled,
        }
    };
    let spec = |effect: &String| EffectSpec {
        name: name_of(effect).to_owned(),
        site: site_of(effect).to_owned(),
        values: values(effect),
    };
    Named {
        effects: label.effects.iter().map(spec).collect(),
        parameters: Box::new(|name| label.parameters.get(name).copied()),
    }
}

/// The verdict's effects with their values.
pub(super) fn verdict<'a>(answer: &'a Answer) -> Named<'a> {
    let spec = |effect: &String| EffectSpec {
        name: name_of(effect).to_owned(),
        site: site_of(effect).to_owned(),
        values: answer
            .values(effect)
            .map(|v| v.parameters.clone().into_iter().collect())
            .unwrap_or_default(),
    };
    let estimate = |name: &str| {
        let found = answer.parameters.iter().find(|p| p.name == name)?;
        Some(found.estimate)
    };
    Named {
        effects: answer.verdict.effects.iter().map(spec).collect(),
        parameters: Box::new(estimate),
    }
}
