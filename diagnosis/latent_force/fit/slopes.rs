//! Derivatives with respect to the state, kept while they hardly change (a chord method).
//!
//! They are the largest cost of a linearisation. The result of a fit does not depend on them, only
//! its speed does.

use asid_core::Result;

use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;
use crate::latent_force::one_step::one_step_tells;
use crate::latent_force::step_map::{Anew, Derivatives, LinearEpisode, StepMap, Variation};
use crate::latent_force::tangent::difference;

use super::Hypothesis;
use super::kept_columns::{KeptColumns, furthest};
use super::secant::{Replayed, mend};

/// Linearisations for which derivatives along rows are kept: the trajectory moves in each.
const KEPT: usize = 3;
/// Largest move of a value while derivatives are kept, in standard deviations of its prior.
const KEPT_MOVE: f64 = 0.3;
/// Largest move of a segment's initial state while derivatives are kept, in steps of their finite
/// differences.
const KEPT_START: f64 = 50.0;
/// The same for a segment whose replay left more than its derivatives predicted: within one step
/// they would come out the same.
const MISLED_START: f64 = 1.0;

/// Information of a segment's readings about a coordinate of its initial state, relative to the
/// prior's, below which the coordinate counts as blind.
///
/// The evidence changes by half of this. Coordinates that a contact blocks have less, and so do the
/// rotations of a body whose orientation no sensor reads, because their prior is the narrowest. The
/// others have 0.1 or more.
const BLIND: f64 = 1e-5;

/// Derivatives of each walk, and the point at which they were taken.
#[derive(Clone, Debug, Default)]
pub struct Slopes {
    a: Vec<Vec<f64>>,
    carried: Vec<Vec<f64>>,
    h: Vec<Vec<f64>>,
    /// For each segment: coordinates of its initial state on which its readings do not depend, as
    /// far as known.
    blind: Vec<Vec<bool>>,
    /// First states of the walks.
    first: Vec<Vec<f64>>,
    /// Values of the model.
    theta: Vec<f64>,
    /// Linearisations that have used the kept derivatives.
    used: usize,
    /// Whether the derivatives are those of one physics step of each row.
    by_one_step: bool,
    /// Columns of values.
    columns: KeptColumns,
    /// Whether the last linearisation kept columns of values other than tolerances.
    kept_values: bool,
    /// Replay of each segment in the linearisation before; empty at the beginning of a fit, whose
    /// values differ.
    replayed: Vec<Replayed>,
}

impl Slopes {
    /// Returns the derivatives for the beginning of another fit.
    #[must_use]
    pub fn begun(&self) -> Self {
        Self {
            used: 0,
            columns: self.columns.begun(),
            replayed: Vec::new(),
            ..self.clone()
        }
    }

    /// Returns no derivatives, only the blind coordinates of segments, for a fit of the same model.
    #[must_use]
    pub fn renewed(&self) -> Self {
        Self {
            blind: self.blind.clone(),
            ..Self::default()
        }
    }

    /// Returns the derivatives of a linearisation of the same model, for a fit that begins at its
    /// values and trajectory; as [`Slopes::renewed`] unless all walks are segments.
    ///
    /// The first linearisation of that fit would compute the same ones again. The linearisation has
    /// left out the blind coordinates.
    #[must_use]
    pub fn taken(
        &self,
        context: &Context<'_>,
        (theta, trajectory): (&[f64], &[Vec<f64>]),
        linear: &[LinearEpisode],
    ) -> Self {
        let renewed = self.renewed();
        let seen = self.blind.iter().filter(|blind| !blind.is_empty()).count();
        let is_segment = |w: usize| context.walks[w].segment.is_some();
        if seen < linear.len() || !(0..linear.len()).all(is_segment) {
            return renewed;
        }
        Self {
            a: vec![Vec::new(); linear.len()],
            carried: vec![Vec::new(); linear.len()],
            h: linear.iter().map(|l| l.h.clone()).collect(),
            first: trajectory.to_vec(),
            theta: theta.to_vec(),
            ..renewed
        }
    }

    /// For each segment: coordinates of its initial state on which its readings do not depend;
    /// empty where unknown.
    #[must_use]
    pub fn blind(&self) -> &[Vec<bool>] {
        &self.blind
    }

    /// Whether the last linearisation computed derivatives along the rows anew.
    #[must_use]
    pub fn are_own(&self) -> bool {
        self.used == 0
    }

    /// Whether the last linearisation kept columns of values other than tolerances; drops these
    /// columns.
    pub fn renew_columns(&mut self) -> bool {
        self.columns.renew();
        std::mem::take(&mut self.kept_values)
    }

    /// Linearises a model at given values about an estimate's trajectory.
    ///
    /// Derivatives with respect to the state and columns of values are computed anew where they are
    /// due, and kept elsewhere. `variations` has one entry per fitted value, or none.
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
        // Derivatives of segments are updated by each step, and a misleading one is due on its own
        // account.
        let far = || furthest(&self.theta, theta, &model.unknowns) > KEPT_MOVE;
        let moved = self.h.is_empty() || !map.is_all_segments() && far();
        // Readings with memory have derivatives with respect to their own past.
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
        // Late readings are assigned to other rows.
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
        // The columns of a segment are those of a replay from its initial state.
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

    /// Whether a segment has moved too far from where its derivatives were taken, or they
    /// mispredicted a replay.
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

    /// Updates the kept derivatives of segments from their replays since the linearisation before.
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

    /// Records blind coordinates, for segments whose derivatives are fresh and were taken for all
    /// coordinates.
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

    /// Stores fresh derivatives where they were due, and fills in the kept ones along the other
    /// walks.
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
