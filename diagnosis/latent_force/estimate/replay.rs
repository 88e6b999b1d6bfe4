//! Replays of segments from changed initial states.

use asid_core::Result;
use asid_core::rng::Streams;
use nalgebra::DVector;
use rand::Rng as _;
use rand_distr::StandardNormal;

use crate::latent_force::context::Context;
use crate::latent_force::initial::open_by_reading;
use crate::latent_force::step_map::StepMap;
use crate::latent_force::tangent::retract;
use crate::latent_force::walk::Walk;

use super::Estimate;

/// Residuals that a step of a segment's initial state may leave, relative to those that its
/// derivatives predicted.
const KEPT_PROMISE: f64 = 1.1;
/// Widths of the draws of an initial state where no step achieves its prediction, in standard
/// deviations of its posterior.
///
/// The posterior has the shape of the valley where the derivatives are right. A contact that begins
/// a row earlier or later is another valley, to which no derivative leads.
const BY_POSTERIOR: [f64; 3] = [0.5, 2.0, 8.0];
/// The same in standard deviations of what the readings, or the prior if it is narrower, leave
/// open, for where the derivatives are wrong.
const BY_READING: [f64; 3] = [0.03, 0.1, 0.3];
/// Draws of each width.
const DRAWS: usize = 4;

impl Estimate {
    /// Sets the initial state of each segment to the state of another estimate in that row; the
    /// other has the same logs in other segments.
    pub fn begin_at(&mut self, context: &Context<'_>, (others, other): (&Context<'_>, &Self)) {
        let layout = &context.plant().layout;
        let width = layout.nq + layout.nv;
        for (walk, states) in context.walks.iter().zip(&mut self.trajectory) {
            let first = walk.rows[0];
            let place = |w: &Walk| w.rows.iter().position(|&row| row == first);
            // Of several, the one that is furthest from its own initial state knows the row best.
            let found = others.walks.iter().zip(&other.trajectory);
            let found = found
                .filter(|(w, _)| w.episode == walk.episode && w.segment.is_some())
                .filter_map(|(w, states)| place(w).map(|at| (at, states)))
                .max_by_key(|(at, _)| *at);
            if let Some((at, from)) = found.filter(|_| walk.segment.is_some()) {
                states[..width].copy_from_slice(&from[at * width..(at + 1) * width]);
            }
        }
    }

    /// Replays the segments from their initial states, which have just been moved from those
    /// `before`.
    ///
    /// Each segment takes the step with the smallest residuals. The choices are the steps on offer,
    /// no step, and the one that [follows its reading](Self::read_as). Where the residuals exceed
    /// the prediction, it also draws initial states about the present one.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn roll(
        &mut self,
        context: &Context<'_>,
        map: &mut StepMap<'_>,
        theta: &[f64],
        (before, followed): (&[Vec<f64>], &[Vec<f64>]),
    ) -> Result<()> {
        if !map.has_segments() {
            return Ok(());
        }
        let all = vec![Some(f64::INFINITY); self.trajectory.len()];
        let mut left = map.roll(theta, (&mut self.trajectory, &all), &self.noise.r)?;
        self.follow(map, theta, (before, followed), &mut left)?;
        let promised: Vec<f64> = self
            .smoothed
            .iter()
            .map(|s| {
                let sums = s.promised.iter().zip(&self.noise.r);
                sums.map(|(sum, r)| sum / r).sum::<f64>()
            })
            .collect();
        let offered = self.smoothed.iter().map(|s| s.damped.len()).max();
        for i in 0..=offered.unwrap_or(0) {
            let step = |s: &Self, w: usize| s.smoothed[w].damped.get(i).cloned();
            self.offer(map, theta, (before, &promised, &mut left), step)?;
        }
        self.rolls += 1;
        let mut random = Streams::new(self.rolls).stream("starts of segments");
        // The log gives some initial states, which are hardly uncertain.
        let starts = context.starts(before, &self.read);
        let scales = (&context.scale[..], &context.position_noise[..]);
        for _ in 0..DRAWS {
            for (posterior, reading) in BY_POSTERIOR.into_iter().zip(BY_READING) {
                let from = self.trajectory.clone();
                let nx = context.scale.len();
                let most = self.smoothed.iter().map(|s| s.root.ncols()).max();
                let normal = DVector::from_fn(most.unwrap_or(0).max(nx), |_, _| {
                    random.sample::<f64, _>(StandardNormal)
                });
                let along = |s: &Self, w: usize| {
                    let root = &s.smoothed[w].root;
                    let change = || posterior * root * normal.rows(0, root.ncols());
                    (root.ncols() > 0).then(|| change().as_slice().to_vec())
                };
                self.offer(map, theta, (&from, &promised, &mut left), along)?;
                let from = self.trajectory.clone();
                let about = |_: &Self, w: usize| {
                    let known = starts[w].variance.iter().map(|v| v.sqrt()).enumerate();
                    let open = known.map(|(i, known)| known.min(open_by_reading(i, scales)));
                    Some(open.zip(&normal).map(|(d, n)| reading * n * d).collect())
                };
                self.offer(map, theta, (&from, &promised, &mut left), about)?;
            }
        }
        let each = self.misled.iter_mut().zip(left.iter().zip(&promised));
        for (misled, (left, promised)) in each {
            let ratio = left / promised;
            *misled = if ratio > KEPT_PROMISE { ratio } else { 1.0 };
        }
        Ok(())
    }

    /// Replays the segments whose residuals exceed the prediction from other initial states, which
    /// are those `from` changed.
    ///
    /// A segment takes its other initial state if that leaves smaller residuals.
    fn offer(
        &mut self,
        map: &mut StepMap<'_>,
        theta: &[f64],
        (from, promised, left): (&[Vec<f64>], &[f64], &mut [f64]),
        change: impl Fn(&Self, usize) -> Option<Vec<f64>>,
    ) -> Result<()> {
        let layout = map.layout().clone();
        let width = layout.nq + layout.nv;
        let worse = left.iter().zip(promised);
        let worse: Vec<bool> = worse.map(|(l, p)| *l > KEPT_PROMISE * p).collect();
        if !worse.contains(&true) {
            return Ok(());
        }
        let mut other = from.to_vec();
        for w in (0..other.len()).filter(|&w| worse[w]) {
            if let Some(change) = change(self, w) {
                retract(&layout, &mut other[w][..width], &change);
            }
        }
        // A replay with larger residuals than the best so far is of no use.
        let each = worse.iter().zip(&*left);
        let most: Vec<Option<f64>> = each.map(|(worse, left)| worse.then_some(*left)).collect();
        self.take_better(map, theta, (other, &most), left)
    }

    /// Replays segments from other initial states, each until its residuals exceed its limit in
    /// `most`.
    ///
    /// A segment takes its other replay if that leaves less than the residuals `left` so far.
    pub(super) fn take_better(
        &mut self,
        map: &mut StepMap<'_>,
        theta: &[f64],
        (mut other, most): (Vec<Vec<f64>>, &[Option<f64>]),
        left: &mut [f64],
    ) -> Result<()> {
        let of_other = map.roll(theta, (&mut other, most), &self.noise.r)?;
        for (w, states) in other.into_iter().enumerate() {
            if most[w].is_some() && of_other[w] < left[w] {
                left[w] = of_other[w];
                self.trajectory[w] = states;
            }
        }
        Ok(())
    }
}
