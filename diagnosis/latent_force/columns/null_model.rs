//! The present model with all candidates at their nulls, from which columns are taken.

use asid_core::Parameter;
use asid_effects::EffectSpec;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::fit::Hypothesis;
use crate::latent_force::trace::is_traceable;

use super::source::Wanted;

/// The present model with all candidates that need the engine at their nulls: effects, parameters and values.
#[derive(Clone)]
pub(super) struct All<'c> {
    pub(super) specs: Vec<EffectSpec>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) theta: Vec<f64>,
    pub(super) candidates: &'c [Candidate],
    /// First parameter of each candidate.
    pub(super) first: Vec<usize>,
    /// Whether no walk is a replay.
    traces: bool,
}

impl<'c> All<'c> {
    /// Of a model, its values, and candidates.
    pub(super) fn new(
        context: &Context<'_>,
        base: &Hypothesis,
        theta: &[f64],
        candidates: &'c [Candidate],
    ) -> Self {
        let mut all = Self {
            specs: base.specs.clone(),
            parameters: base.parameters(),
            theta: theta.to_vec(),
            candidates,
            first: Vec::with_capacity(candidates.len()),
            traces: context.walks.iter().all(|w| w.segment.is_none()),
        };
        for c in candidates {
            all.first.push(all.theta.len());
            if all.is_traced(context, c) {
                continue;
            }
            all.specs.push(c.spec.clone());
            all.parameters
                .extend(c.unknowns().into_iter().map(|(p, _)| p));
            all.theta.extend(c.parameters().iter().map(|p| p.null));
        }
        all
    }

    /// Whether a candidate needs no engine: it acts through forces alone, and no walk is a replay.
    pub(super) fn is_traced(&self, context: &Context<'_>, candidate: &Candidate) -> bool {
        self.traces && is_traceable(context.plant(), candidate)
    }

    /// All values with those of some candidates.
    pub(super) fn with_all<'w>(&self, wanted: impl Iterator<Item = &'w Wanted>) -> Vec<f64> {
        let mut theta = self.theta.clone();
        for w in wanted {
            let first = self.first[w.candidate];
            theta[first..first + w.values.len()].copy_from_slice(&w.values);
        }
        theta
    }
}
