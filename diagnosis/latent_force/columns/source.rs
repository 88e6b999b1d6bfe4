//! Where columns come from: the engine, or a trace of the forces.

use asid_core::{Parameter, Progress, Result};
use asid_effects::EffectSpec;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::fit::Hypothesis;
use crate::latent_force::step_map::{Derivatives, Variation, retime_columns};
use crate::latent_force::trace::{is_traceable, trace};

/// Columns that one walk of the engine takes, at most: between two of them work can be stopped, and of all at once the memory
/// would grow with the candidates.
const SLICE: usize = 64;

/// The present model with all candidates that need the engine at their nulls: effects, parameters and values.
#[derive(Clone)]
pub(super) struct All<'c> {
    pub(super) specs: Vec<EffectSpec>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) theta: Vec<f64>,
    pub(super) candidates: &'c [Candidate],
    /// First parameter of each candidate.
    pub(super) first: Vec<usize>,
    traces: bool,
}

impl<'c> All<'c> {
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
    fn is_traced(&self, context: &Context<'_>, candidate: &Candidate) -> bool {
        self.traces && is_traceable(context.plant(), candidate)
    }

    /// All values with those of one candidate.
    pub(super) fn with(&self, candidate: usize, values: &[f64]) -> Vec<f64> {
        let mut theta = self.theta.clone();
        let first = self.first[candidate];
        theta[first..first + values.len()].copy_from_slice(values);
        theta
    }
}

/// A column that is wanted: a candidate with some values, and what its change is divided by.
pub(super) struct Wanted {
    pub(super) candidate: usize,
    pub(super) values: Vec<f64>,
    pub(super) scale: f64,
}

impl Wanted {
    /// The slope of a candidate in a parameter about some values, over a step towards the inside of its range.
    pub(super) fn slope(
        candidates: &[Candidate],
        c: usize,
        begin: &[f64],
        parameter: usize,
        step: f64,
    ) -> Self {
        let [_, high] = candidates[c].ranges[parameter];
        let mut values = begin.to_vec();
        let step = if values[parameter] + step <= high {
            step
        } else {
            -step
        };
        values[parameter] += step;
        Self {
            candidate: c,
            values,
            scale: step,
        }
    }
}

/// Columns along a walk: of the next states, `(rows - 1) x nx x m`, and of the readings, `rows x ns x m`.
pub(super) type Along = (Vec<f64>, Vec<f64>);

/// Columns of the present model with some candidates: those that need the engine from it, the others traced.
pub(super) struct Source<'s> {
    pub(super) all: All<'s>,
    /// Slopes in forces, one a walk.
    pub(super) slopes: &'s [Vec<f64>],
    /// How late readings are in the present model.
    pub(super) late: &'s [Vec<f64>],
    /// Who says when to stop.
    pub(super) progress: &'s dyn Progress,
}

impl Source<'_> {
    /// The columns wanted, along each walk, and whether they are all there: where work
    /// is stopped, those that the engine has not come to are zero.
    pub(super) fn columns(
        &self,
        context: &Context<'_>,
        states: &[Vec<f64>],
        wanted: &[Wanted],
    ) -> Result<(Vec<Along>, bool)> {
        let plant = context.plant();
        let (nv, m) = (plant.layout.nv, wanted.len());
        let (nx, ns) = (2 * nv, context.logs.entries.len());
        let traced = |w: &Wanted| {
            self.all
                .is_traced(context, &self.all.candidates[w.candidate])
        };
        let by_engine: Vec<usize> = (0..m).filter(|&i| !traced(&wanted[i])).collect();
        let mut out: Vec<Along> = context
            .walks
            .iter()
            .map(|w| {
                let n = w.len();
                (vec![0.0; (n - 1) * nx * m], vec![0.0; n * ns * m])
            })
            .collect();
        let mut complete = true;
        for (n, slice) in by_engine.chunks(SLICE).enumerate() {
            if n > 0 && self.progress.is_stopped() {
                complete = false;
                break;
            }
            let variations: Vec<Variation> = slice
                .iter()
                .map(|&i| Variation {
                    theta: self.all.with(wanted[i].candidate, &wanted[i].values),
                    scale: wanted[i].scale,
                })
                .collect();
            let own = slice.len();
            let mut map = context.map(&self.all.specs, &self.all.parameters, own + 1)?;
            let found = map.linearise(
                &self.all.theta,
                states,
                Derivatives::default(),
                &[],
                &variations,
            )?;
            for (w, mut linear) in found.into_iter().enumerate() {
                if let Some(late) = self.late.get(w).filter(|l| !l.is_empty()) {
                    let time = &context.walks[w].time;
                    retime_columns(&mut linear.reading_columns, time, late, own);
                }
                let spread = |from: &[f64], to: &mut [f64]| {
                    for (row, target) in from.chunks_exact(own).zip(to.chunks_exact_mut(m)) {
                        row.iter().zip(slice).for_each(|(x, &i)| target[i] = *x);
                    }
                };
                // Of a segment there are none: its columns are those of its readings.
                spread(&linear.state_columns, &mut out[w].0);
                spread(&linear.reading_columns, &mut out[w].1);
            }
        }
        for (w, walk) in context.walks.iter().enumerate() {
            let b = &self.slopes[w];
            for (i, wanted) in wanted.iter().enumerate().filter(|(_, w)| traced(w)) {
                let candidate = &self.all.candidates[wanted.candidate];
                let forces = trace(plant, candidate, &wanted.values, walk, &states[w])?;
                for (k, force) in forces.chunks_exact(nv).enumerate() {
                    if force.iter().all(|x| *x == 0.0) {
                        continue;
                    }
                    for s in 0..nx {
                        let b = &b[(k * nx + s) * nv..(k * nx + s + 1) * nv];
                        let sum: f64 = b.iter().zip(force).map(|(x, y)| x * y).sum();
                        out[w].0[(k * nx + s) * m + i] = sum / wanted.scale;
                    }
                }
            }
        }
        Ok((out, complete))
    }
}
