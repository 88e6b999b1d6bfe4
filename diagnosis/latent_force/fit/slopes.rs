//! Slopes in the state that are kept while they hardly change (a chord method).
//!
//! They cost most of a linearisation, and what is found does not depend on them, only how fast.

use asid_core::Result;

use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;
use crate::latent_force::one_step::one_step_tells;
use crate::latent_force::step_map::{Anew, Derivatives, LinearEpisode, StepMap, Variation};
use crate::latent_force::tangent::difference;

use super::Hypothesis;
use super::kept_columns::{KeptColumns, furthest};
use super::secant::{Replayed, mend};

/// Linearisations that slopes along rows are kept for: their trajectory moves in each.
const KEPT: usize = 3;
/// How far a value may move meanwhile, in deviations of its prior.
const KEPT_MOVE: f64 = 0.3;
/// How far the start of a segment may move meanwhile, in steps that its slopes are taken over.
const KEPT_START: f64 = 50.0;
/// The same of a segment whose replay did not keep what its slopes promised: within a step the slopes are the same.
const MISLED_START: f64 = 1.0;

/// Information that the readings of a segment have of a coordinate of its start, in units of what is known of it before, up to which the
/// coordinate counts as blind: evidence changes by half of it. Where a body touches another, the six of what the contact blocks, and of how
/// a body of revolution is turned, have less, the others 0.1 or more.
const BLIND: f64 = 1e-5;

/// Slopes of each walk, and where they were taken.
#[derive(Clone, Debug, Default)]
pub struct Slopes {
    a: Vec<Vec<f64>>,
    carried: Vec<Vec<f64>>,
    h: Vec<Vec<f64>>,
    /// Of each segment the coordinates of its start that its readings do not depend on, as far as that is known.
    blind: Vec<Vec<bool>>,
    /// First states of the walks.
    first: Vec<Vec<f64>>,
    /// The values.
    theta: Vec<f64>,
    /// Linearisations that have used them.
    used: usize,
    /// Whether they are those of one physics step of each row.
    by_one_step: bool,
    /// Columns of values.
    columns: KeptColumns,
    /// Whether the last linearisation kept columns of values that are no tolerances.
    kept_values: bool,
    /// The replay of each segment in the linearisation before; none at the beginning of a fit, whose values are others.
    replayed: Vec<Replayed>,
}

impl Slopes {
    /// The same at the beginning of another fit.
    #[must_use]
    pub fn begun(&self) -> Self {
        Self {
            used: 0,
            columns: self.columns.begun(),
            replayed: Vec::new(),
            ..self.clone()
        }
    }

    /// None, but for what segments are blind to, for a fit of the same model.
    #[must_use]
    pub fn renewed(&self) -> Self {
        Self {
            blind: self.blind.clone(),
            ..Self::default()
        }
    }

    /// Of each segment the coordinates of its start that its readings do not depend on; empty where that is not known.
    #[must_use]
    pub fn blind(&self) -> &[Vec<bool>] {
        &self.blind
    }

    /// Whether the last linearisation took slopes anew along the rows.
    #[must_use]
    pub fn are_own(&self) -> bool {
        self.used == 0
    }

    /// Whether the columns of some values that are no tolerances were kept in the last linearisation; from here on none are.
    pub fn renew_columns(&mut self) -> bool {
        self.columns.renew();
        std::mem::take(&mut self.kept_values)
    }

    /// Linearises a model at some values about an estimate's trajectory, with slopes in the state, and columns of values, that are taken
    /// anew where they are due, and kept elsewhere. `variations` has one for each value that is fitted, or none.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn linearise(
        &mut self,
        (context, map): (&Context<'_>, &mut StepMap<'_>),
        (theta, model): (&[f64], &Hypothesis),
        estimate: &Estimate,
        variations: &[Variation],
    ) -> Result<Vec<LinearEpisode>> {
        // Slopes of segments are mended by each step that is made, and each that misleads is due by itself.
        let far = || furthest(&self.theta, theta, &model.unknowns) > KEPT_MOVE;
        let moved = self.h.is_empty() || !map.is_all_segments() && far();
        // Readings that remember have slopes of their own past.
        let along =
            moved || self.used >= KEPT || map.remembers_readings() && !map.is_all_segments();
        let due: Vec<bool> = (0..context.walks.len())
            .map(|w| match context.walks[w].segment {
                Some(_) => moved || self.has_left(context, estimate, w),
                None => along,
            })
            .collect();
        let want = Derivatives {
            state: due.contains(&true),
            ..Derivatives::default()
        };
        let steps = context.start_steps();
        let trajectory = &estimate.trajectory;
        if moved {
            let refined = (&model.specs[..], &model.parameters()[..]);
            self.by_one_step = one_step_tells(context, refined, (theta, trajectory))?;
        }
        map.by_one_step(self.by_one_step);
        let free = if variations.is_empty() {
            Vec::new()
        } else {
            model.free()
        };
        // Late readings are given to other rows.
        let keeps = !map.remembers_readings() || map.is_all_segments();
        let values = (&model.unknowns[..], &free[..]);
        let places = if keeps {
            self.columns.places(values, theta)
        } else {
            vec![None; free.len()]
        };
        let kept: Vec<bool> = places.iter().map(Option::is_some).collect();
        let mut of_values = free.iter().zip(&kept);
        self.kept_values = of_values.any(|(&i, kept)| *kept && !model.unknowns[i].is_tolerance);
        // Of a segment the columns are those of a replay from where it begins.
        let is_segment = context.walks.iter().map(|w| w.segment.is_some());
        let left: Vec<bool> = is_segment.zip(&due).map(|(s, due)| s && *due).collect();
        let anew = Anew {
            state: &due,
            carried: &self.carried,
            kept: &kept,
            columns: &left,
            blind: &self.blind,
        };
        let mut linear = map.linearise_anew(theta, trajectory, (want, anew), &steps, variations)?;
        if keeps && !variations.is_empty() {
            self.columns.join(&mut linear, &places, &left);
            self.columns.keep(&linear, values, (theta, &kept));
        }
        if context.has_segments() {
            let deviations = |&i: &usize| theta[i] / model.unknowns[i].deviation;
            let values: Vec<f64> = free.iter().map(deviations).collect();
            self.mend(context, (&linear, &due), trajectory, &values);
        }
        self.exchange(&mut linear, &due, trajectory);
        self.see(context, estimate, (&linear, &due));
        if moved || along && !context.has_segments() {
            self.theta = theta.to_vec();
        }
        self.used = if along { 0 } else { self.used + 1 };
        Ok(linear)
    }

    /// Whether the start of a segment is no longer where its slopes were taken, or these kept no promise.
    fn has_left(&self, context: &Context<'_>, estimate: &Estimate, walk: usize) -> bool {
        let layout = &context.plant().layout;
        let now = &estimate.trajectory[walk][..layout.nq + layout.nv];
        let mut change = vec![0.0; 2 * layout.nv];
        difference(layout, now, &self.first[walk][..now.len()], &mut change);
        let steps = context.start_steps();
        let pairs = change.iter().zip(&steps);
        let furthest = pairs.map(|(c, step)| c.abs() / step).fold(0.0, f64::max);
        let most = if estimate.misled[walk] > 1.0 {
            MISLED_START
        } else {
            KEPT_START
        };
        furthest > most
    }

    /// Mends the slopes of segments that are kept by what their replays did since the linearisation before.
    fn mend(
        &mut self,
        context: &Context<'_>,
        (linear, due): (&[LinearEpisode], &[bool]),
        trajectory: &[Vec<f64>],
        values: &[f64],
    ) {
        let layout = &context.plant().layout;
        let width = layout.nq + layout.nv;
        let steps = context.start_steps();
        let replayed = linear.iter().zip(trajectory).map(|(l, states)| Replayed {
            residual: l.residual.clone(),
            columns: l.reading_columns.clone(),
            start: states[..width].to_vec(),
            values: values.to_vec(),
        });
        let replayed: Vec<Replayed> = replayed.collect();
        for (w, (before, after)) in self.replayed.iter().zip(&replayed).enumerate() {
            if context.walks[w].segment.is_some() && !due[w] {
                let mut change = vec![0.0; 2 * layout.nv];
                difference(layout, &after.start, &before.start, &mut change);
                mend(&mut self.h[w], (before, after), &change, &steps);
            }
        }
        self.replayed = replayed;
    }

    /// Notes what the readings of segments do not depend on, of those whose slopes are fresh and were taken in all coordinates.
    fn see(
        &mut self,
        context: &Context<'_>,
        estimate: &Estimate,
        (linear, due): (&[LinearEpisode], &[bool]),
    ) {
        self.blind.resize(linear.len(), Vec::new());
        let starts = context.starts(&estimate.trajectory, &estimate.read);
        for (w, linear) in linear.iter().enumerate() {
            if context.walks[w].segment.is_some() && due[w] && self.blind[w].is_empty() {
                let open = &starts[w].variance;
                self.blind[w] = linear.blind(open, &estimate.noise.r, BLIND);
            }
        }
    }

    /// Takes fresh slopes over where they were due, and gives the kept ones to the other walks.
    fn exchange(&mut self, linear: &mut [LinearEpisode], due: &[bool], trajectory: &[Vec<f64>]) {
        self.a.resize(linear.len(), Vec::new());
        self.carried.resize(linear.len(), Vec::new());
        self.h.resize(linear.len(), Vec::new());
        self.first.resize(linear.len(), Vec::new());
        for (w, linear) in linear.iter_mut().enumerate() {
            if due[w] {
                self.a[w].clone_from(&linear.a);
                self.carried[w] = std::mem::take(&mut linear.carried);
                self.h[w].clone_from(&linear.h);
                self.first[w].clone_from(&trajectory[w]);
            } else {
                linear.a.clone_from(&self.a[w]);
                linear.h.clone_from(&self.h[w]);
            }
        }
    }
}
