//! The present model with candidates at their nulls, from which columns are taken.

use asid_core::Parameter;
use asid_effects::{Acts, EffectSpec};
use asid_mjcf::Plant;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::fit::Hypothesis;
use crate::latent_force::trace::is_traceable;

use super::source::Wanted;

/// How the column of a candidate is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// Without the engine: the candidate acts through forces alone.
    Traced,
    /// By the engine, from one physics step of a row: the candidate changes the model itself.
    OneStep,
    /// By the engine, over whole rows.
    WholeRow,
}

impl Way {
    /// Chooses the way for a candidate; where some walks are `replayed`, all columns are those of
    /// whole replays.
    pub(super) fn of(replayed: bool, plant: &Plant, candidate: &Candidate) -> Self {
        if replayed {
            Self::WholeRow
        } else if is_traceable(plant, candidate) {
            Self::Traced
        } else if candidate.effect.acts() == Acts::Model {
            Self::OneStep
        } else {
            Self::WholeRow
        }
    }
}

/// The present model with all candidates of one way at their nulls: effects, parameters and values.
#[derive(Clone)]
pub(super) struct NullModel {
    pub(super) specs: Vec<EffectSpec>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) theta: Vec<f64>,
    /// Index of each candidate's first parameter.
    first: Vec<usize>,
}

impl NullModel {
    /// Builds it from a model, its values, and candidates.
    pub(super) fn new(
        context: &Context<'_>,
        (base, theta): (&Hypothesis, &[f64]),
        candidates: &[Candidate],
        way: Way,
    ) -> Self {
        let mut model = Self {
            specs: base.specs.clone(),
            parameters: base.parameters(),
            theta: theta.to_vec(),
            first: Vec::with_capacity(candidates.len()),
        };
        for c in candidates {
            model.first.push(model.theta.len());
            if Way::of(context.has_segments(), context.plant(), c) != way {
                continue;
            }
            model.specs.push(c.spec.clone());
            let parameters = c.unknowns().into_iter().map(|(p, _)| p);
            model.parameters.extend(parameters);
            model.theta.extend(c.parameters().iter().map(|p| p.null));
        }
        model
    }

    /// Returns all values, with those of some candidates set.
    pub(super) fn with_all<'w>(&self, wanted: impl Iterator<Item = &'w Wanted>) -> Vec<f64> {
        let mut theta = self.theta.clone();
        for w in wanted {
            let first = self.first[w.candidate];
            theta[first..first + w.values.len()].copy_from_slice(&w.values);
        }
        theta
    }
}
