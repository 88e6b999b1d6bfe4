//! Trajectory, missing force and noise of all episodes, estimated by expectation maximisation.
//!
//! The smoother gives the trajectory and the missing force for given covariances; these follow from it (Shumway and
//! Stoffer 1982): `q` and `tau` from the force and its products over a row, `r` from what is left of
//! the readings. Between linearisations a few rounds are taken, lengthened, for EM is slow where a variance is small.

use asid_core::layout::{JointKind, Layout};
use asid_core::{Parameter, Result};
use asid_effects::EffectSpec;
use asid_mjcf::Plant;
use rayon::prelude::*;

use crate::data::Logs;
use crate::machine::Machine;
use crate::predict::State;

use super::initial::{from_readings, open_by_reading, position_noise, start, start_of_segment};
use super::smoother::{NoiseModel, Problem, Smoothed, Start, Sums, smooth};
use super::step_map::{Derivatives, LinearEpisode, StepMap};
use super::tangent::{difference, retract};
use super::walk::Walk;

/// Mean square of what is left of readings, beyond their noise and in units of it, that counts as nothing: a gap of 1.05.
pub const LEAST_LEFT: f64 = 0.1;
/// What a step of a segment's start may leave of its readings, relative to what its slopes promised.
const KEPT_PROMISE: f64 = 1.1;
/// Change of a segment's start that slopes are taken over, as a share of what its readings leave open.
const START_SHARE: f64 = 0.02;
/// Multiple of a step of EM in the logarithm of a variance: between 1 and 2 EM still rises (Lange 1995).
const LENGTHENED: f64 = 1.7;
/// Largest change of the logarithm of a variance in a round.
const LARGEST_CHANGE: f64 = 2.0;
/// Correlation over a row that the search begins with, and the largest.
const FIRST_CORRELATION: f64 = 0.9;
const LARGEST_CORRELATION: f64 = 0.9999;
/// Deviation of the white part of a missing force that the search begins with, relative to the whole.
const FIRST_WHITE: f64 = 0.1;
/// Least deviation of the white part, relative to what is missing without any effect: what is finer decides
/// nothing, for no law of friction or of a drive is the machine's own to the last digit.
const LEAST_WHITE: f64 = 0.1;
/// Least deviation of a reading, relative to its noise as given or first estimated.
const LEAST_READING: f64 = 0.2;
/// Most of it.
const MOST_READING: f64 = 2.0;
/// Least deviation of a missing force, relative to the joint's inertial forces.
const LEAST_FORCE: f64 = 1e-5;
/// Force that slopes are first taken over, N or N m: an inertia of 1e-5 to 1e3 moves by what doubles resolve.
const FIRST_PUSH: f64 = 1e-4;
/// Speed up to which a joint counts as at rest: in deviations of its estimate, and relative to its largest.
const REST_DEVIATIONS: f64 = 3.0;
const REST_SHARE: f64 = 0.02;

/// What is being explained: logs of a machine, walked row by row.
pub struct Context<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The logs.
    pub logs: &'a Logs,
    /// Their rows.
    pub walks: Vec<Walk>,
    /// The starts that logs give, one a walk; `None` where a walk begins within a log.
    pub given: Vec<Option<State>>,
    /// Where segments begin by their readings, `nq + nv`, one a walk.
    pub read: Vec<Vec<f64>>,
    /// Coordinates of the starts that logs leave open.
    pub open: Vec<usize>,
    /// Largest magnitude of each tangent coordinate.
    pub scale: Vec<f64>,
    /// Deviation of the reading of each position that a sensor reads directly, else 0; `nv`.
    pub position_noise: Vec<f64>,
    /// Variance of each entry of a reading, as given or first estimated.
    pub reading_variance: Vec<f64>,
    /// Typical inertial force at each degree of freedom, N or N m.
    pub inertial: Vec<f64>,
}

/// What a model lacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missing {
    /// Power of the missing force where it is smoothed, beyond what is too fine to decide, in units of the inertial forces,
    /// over all degrees of freedom.
    pub force: f64,
    /// Mean square of what segments leave of their readings beyond the noise, in units of it.
    pub readings: f64,
    /// Share of the rows that are in segments.
    pub share: f64,
}

impl Missing {
    /// Relative to what another model lacks, of force and of readings by their shares of the rows.
    #[must_use]
    pub fn relative_to(self, other: Self) -> f64 {
        let force = self.force / other.force.max(f64::MIN_POSITIVE);
        let readings = self.readings / other.readings.max(LEAST_LEFT);
        (1.0 - self.share) * force + self.share * readings
    }
}

/// Trajectory, force and noise.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// States, `rows x (nq + nv)`, one a walk.
    pub trajectory: Vec<Vec<f64>>,
    /// Covariances.
    pub noise: NoiseModel,
    /// Slopes in generalized forces of the model without effects, one a walk.
    pub b: Vec<Vec<f64>>,
    /// Variance of the force that may hold a joint at rest, `rows x nv`, one a walk; empty for none.
    pub free: Vec<Vec<f64>>,
    /// Least variance of the white part of each force.
    pub least_white: Vec<f64>,
    /// Of each segment: variance of what is left of its readings, relative to that of the readings; 1 for other walks.
    pub excess: Vec<f64>,
    /// The last smoothing, about the trajectory before it.
    pub smoothed: Vec<Smoothed>,
    /// Its log-likelihood.
    pub log_likelihood: f64,
}

impl Context<'_> {
    /// The machine's structure.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.machine.plant
    }

    /// Whether some walks are segments.
    #[must_use]
    pub fn has_segments(&self) -> bool {
        self.walks.iter().any(|w| w.segment.is_some())
    }

    /// A step map of the machine with more effects; `roles` as [`StepMap::new`].
    ///
    /// # Errors
    /// As [`StepMap::new`].
    pub fn map(
        &self,
        specs: &[EffectSpec],
        parameters: &[Parameter],
        roles: usize,
    ) -> Result<StepMap<'_>> {
        let rows = (self.logs, &self.walks[..]);
        StepMap::new(self.machine, specs, parameters, rows, roles)
    }

    /// Changes of the start of a segment that slopes are taken over: a part of what its first readings leave open, so that
    /// points of contact that come and go even out.
    #[must_use]
    pub fn start_steps(&self) -> Vec<f64> {
        let scales = (&self.scale[..], &self.position_noise[..]);
        let open = (0..self.scale.len()).map(|i| open_by_reading(i, scales));
        open.map(|d| START_SHARE * d).collect()
    }

    /// Where the walks begin, about a trajectory.
    #[must_use]
    pub fn starts(&self, trajectory: &[Vec<f64>]) -> Vec<Start> {
        let width = self.plant().layout.nq + self.plant().layout.nv;
        let scales = (&self.scale[..], &self.position_noise[..]);
        let each = self.given.iter().zip(&self.walks).zip(&self.read);
        each.zip(trajectory)
            .map(|(((given, walk), read), states)| {
                let first = &states[..width];
                let given = given.as_ref().map(|s| (s, &self.open[..]));
                if given.is_none() && walk.segment.is_some() {
                    return start_of_segment(self.plant(), read, first, scales);
                }
                start(self.plant(), given, first, scales)
            })
            .collect()
    }
}

/// Duration of a row, s, as a mean over all walks.
fn row_seconds(walks: &[Walk]) -> f64 {
    let seconds: f64 = walks.iter().map(|w| w.time[w.len() - 1]).sum();
    let rows: usize = walks.iter().map(|w| w.len() - 1).sum();
    seconds / rows.max(1) as f64
}

/// What the logs of a study are taken as.
pub struct Taken {
    /// Rows.
    pub walks: Vec<Walk>,
    /// The starts that logs give, one a walk; `None` where a walk begins within a log.
    pub given: Vec<Option<State>>,
    /// Coordinates of the starts that logs leave open.
    pub open: Vec<usize>,
    /// States where no sensor reads them, `rows x (nq + nv)`, one a walk.
    pub otherwise: Vec<Vec<f64>>,
    /// Largest magnitude of each tangent coordinate.
    pub scale: Vec<f64>,
}

/// Raises the largest speeds that a unit of each force has made over a row to those of some more rows, `rows x nx x nv`.
pub(super) fn raise_free(free: &mut [f64], b: &[f64], rows: usize) {
    let nv = free.len();
    for k in 0..rows {
        for (d, free) in free.iter_mut().enumerate() {
            *free = free.max(b[(k * 2 * nv + nv + d) * nv + d]);
        }
    }
}

/// Gives all directions of a free body the largest of its forces, and all its turns the largest of its torques: along the one
/// that a contact blocks it hardly moves, and what acts along it is no smaller.
fn level_blocks(layout: &Layout, forces: &mut [f64]) {
    for joint in &layout.joints {
        let first = joint.qvel;
        let blocks = match joint.kind {
            JointKind::Free => 2,
            JointKind::Ball => 1,
            JointKind::Hinge | JointKind::Slide => 0,
        };
        for block in forces[first..].chunks_exact_mut(3).take(blocks) {
            let largest = block.iter().copied().fold(0.0, f64::max);
            block.fill(largest);
        }
    }
}

/// A context for some walks, and a first estimate of the model at `theta`, not yet smoothed.
///
/// # Errors
/// When the engine fails.
pub fn begin<'a>(
    machine: &'a Machine,
    logs: &'a Logs,
    taken: Taken,
    (parameters, theta): (&[Parameter], &[f64]),
) -> Result<(Context<'a>, Estimate)> {
    let plant = &machine.plant;
    let layout = &plant.layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let mut trajectory = from_readings(plant, logs, &taken.walks, &taken.otherwise);
    let read = trajectory.iter().map(|s| s[..width].to_vec());
    let noise = logs.entry_noise();
    let mut context = Context {
        machine,
        logs,
        given: taken.given,
        read: read.collect(),
        open: taken.open,
        scale: taken.scale,
        position_noise: position_noise(plant, logs),
        reading_variance: noise.iter().map(|n| n * n).collect(),
        inertial: vec![0.0; nv],
        walks: taken.walks,
    };
    let mut map = context.map(&[], parameters, nv + 1)?;
    let all = vec![true; trajectory.len()];
    map.roll(theta, (&mut trajectory, &all), &context.reading_variance)?;
    let want = Derivatives {
        force: true,
        ..Derivatives::default()
    };
    let push = vec![FIRST_PUSH; nv];
    let linear = map.linearise(theta, &trajectory, want, &push, &[])?;
    let b: Vec<Vec<f64>> = linear.into_iter().map(|l| l.b).collect();
    // Inertia by the speed that a force makes, where no contact takes it up, times the acceleration seen.
    let mut free = vec![0.0; nv];
    for (walk, b) in context.walks.iter().zip(&b) {
        raise_free(&mut free, b, walk.len() - 1);
    }
    let mut sums = vec![(0.0, 0.0); nv];
    for ((walk, states), b) in context.walks.iter().zip(&trajectory).zip(&b) {
        for k in 0..walk.len() - 1 {
            for (d, sum) in sums.iter_mut().enumerate() {
                let own = b[(k * 2 * nv + nv + d) * nv + d];
                let gained = if walk.segment.is_some() { free[d] } else { own };
                let speed = |k: usize| states[k * width + layout.nq + d];
                if gained > 0.0 {
                    sum.0 += ((speed(k + 1) - speed(k)) / gained).abs();
                    sum.1 += 1.0;
                }
            }
        }
    }
    context.inertial = sums
        .iter()
        .map(|(force, n)| (force / f64::max(*n, 1.0)).max(1e-9))
        .collect();
    if context.has_segments() {
        level_blocks(layout, &mut context.inertial);
    }
    let tau = -row_seconds(&context.walks) / FIRST_CORRELATION.ln();
    let estimate = Estimate {
        noise: NoiseModel {
            q: context.inertial.iter().map(|f| f * f).collect(),
            tau: vec![tau; nv],
            white: context
                .inertial
                .iter()
                .map(|f| (FIRST_WHITE * f).powi(2))
                .collect(),
            r: context.reading_variance.clone(),
        },
        free: vec![Vec::new(); trajectory.len()],
        excess: vec![1.0; trajectory.len()],
        least_white: vec![0.0; nv],
        smoothed: Vec::new(),
        log_likelihood: f64::NEG_INFINITY,
        trajectory,
        b,
    };
    Ok((context, estimate))
}

impl Estimate {
    /// The problem of each walk; `starts` as [`Context::starts`] has them.
    pub fn problems<'p>(
        &'p self,
        context: &'p Context<'_>,
        linear: &'p [LinearEpisode],
        starts: &'p [Start],
    ) -> impl IndexedParallelIterator<Item = Problem<'p>> {
        context
            .walks
            .par_iter()
            .zip(linear)
            .zip(&self.b)
            .zip(starts)
            .zip(&self.free)
            .map(|((((walk, linear), b), start), free)| Problem {
                walk,
                linear,
                b,
                start,
                free,
            })
    }

    /// The noise of a walk, that of forces and of what segments leave scaled.
    #[must_use]
    pub fn noise_along(&self, context: &Context<'_>, walk: usize, scale: f64) -> NoiseModel {
        if context.walks[walk].segment.is_none() {
            return self.noise.scaled(scale, &self.least_white);
        }
        let excess = (scale * self.excess[walk]).max(1.0);
        let none = vec![0.0; self.noise.q.len()];
        NoiseModel {
            q: none.clone(),
            white: none,
            r: self.noise.r.iter().map(|r| r * excess).collect(),
            tau: self.noise.tau.clone(),
        }
    }

    /// Scales the variances of the missing force and of what segments leave.
    pub fn rescale(&mut self, scale: f64) {
        self.noise = self.noise.scaled(scale, &self.least_white);
        self.excess
            .iter_mut()
            .for_each(|x| *x = (scale * *x).max(1.0));
    }

    /// Replays the segments from their starts, which have just been moved from those `before`: each takes the step, of those
    /// offered and none, that leaves least of its readings.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn roll(
        &mut self,
        map: &mut StepMap<'_>,
        theta: &[f64],
        before: &[Vec<f64>],
    ) -> Result<()> {
        if !map.has_segments() {
            return Ok(());
        }
        let layout = map.layout().clone();
        let width = layout.nq + layout.nv;
        let all: Vec<bool> = vec![true; self.trajectory.len()];
        let mut left = map.roll(theta, (&mut self.trajectory, &all), &self.noise.r)?;
        // Where the step left what it promised, no shorter one is tried.
        let worse: Vec<bool> = left
            .iter()
            .zip(&self.smoothed)
            .map(|(left, s)| {
                let promised = s
                    .sums
                    .reading
                    .iter()
                    .zip(&self.noise.r)
                    .map(|([sum, _], r)| sum / r);
                *left > KEPT_PROMISE * promised.sum::<f64>()
            })
            .collect();
        let offered = self
            .smoothed
            .iter()
            .map(|s| s.damped.len())
            .max()
            .unwrap_or(0);
        for i in 0..=offered {
            let mut other = before.to_vec();
            for (states, smoothed) in other.iter_mut().zip(&self.smoothed) {
                if let Some(change) = smoothed.damped.get(i) {
                    retract(&layout, &mut states[..width], change);
                }
            }
            let of_other = map.roll(theta, (&mut other, &worse), &self.noise.r)?;
            for (w, states) in other.into_iter().enumerate() {
                if worse[w] && of_other[w] < left[w] {
                    left[w] = of_other[w];
                    self.trajectory[w] = states;
                }
            }
        }
        Ok(())
    }

    /// Smooths about the present trajectory, fits the noise over some rounds, and moves the trajectory.
    pub fn improve(&mut self, context: &Context<'_>, linear: &[LinearEpisode], rounds: usize) {
        let starts = context.starts(&self.trajectory);
        let mut length = LENGTHENED;
        let mut before = (f64::NEG_INFINITY, self.noise.clone());
        for round in 0..rounds.max(1) {
            let smoothed: Vec<Smoothed> = self
                .problems(context, linear, &starts)
                .enumerate()
                .map(|(w, p)| smooth(p, &self.noise_along(context, w, 1.0)))
                .collect();
            let mut sums = Sums::default();
            let along = context.walks.iter().zip(&smoothed);
            along
                .filter(|(w, _)| w.segment.is_none())
                .for_each(|(_, s)| sums.add(&s.sums));
            let likelihood: f64 = smoothed.iter().map(|s| s.log_likelihood).sum();
            if likelihood.is_nan() || likelihood < before.0 {
                // A lengthened step went too far.
                self.noise = before.1.clone();
                length = 1.0;
                continue;
            }
            self.log_likelihood = likelihood;
            self.smoothed = smoothed;
            before = (likelihood, self.noise.clone());
            if round + 1 < rounds {
                self.update_noise(context, &sums, length);
                self.update_excess(context);
            }
        }
        let layout = &context.plant().layout;
        let (nx, width) = (2 * layout.nv, layout.nq + layout.nv);
        let pairs = self.trajectory.iter_mut().zip(&self.smoothed);
        for ((states, smoothed), walk) in pairs.zip(&context.walks) {
            // A segment is replayed from its start.
            let rows = if walk.segment.is_some() {
                1
            } else {
                walk.len()
            };
            let changes = smoothed.change.chunks_exact(nx).take(rows);
            for (state, change) in states.chunks_exact_mut(width).zip(changes) {
                if change.iter().all(|x| x.is_finite()) {
                    retract(layout, state, change);
                }
            }
        }
    }

    /// Part of the way from here to what [`Estimate::improve`] made of it.
    #[must_use]
    pub fn towards(&self, context: &Context<'_>, there: &Self, part: f64) -> Self {
        let layout = &context.plant().layout;
        let (nx, width) = (2 * layout.nv, layout.nq + layout.nv);
        let mut out = there.clone();
        let mut change = vec![0.0; nx];
        let pairs = out.trajectory.iter_mut().zip(&there.smoothed);
        for (w, ((states, smoothed), walk)) in pairs.zip(&context.walks).enumerate() {
            if walk.segment.is_some() {
                let from = &self.trajectory[w][..width];
                difference(layout, &states[..width], from, &mut change);
                change.iter_mut().for_each(|c| *c *= part);
                states[..width].copy_from_slice(from);
                retract(layout, &mut states[..width], &change);
                continue;
            }
            let changes = smoothed.change.chunks_exact(nx);
            for (state, whole) in states.chunks_exact_mut(width).zip(changes) {
                if whole.iter().all(|x| x.is_finite()) {
                    for (c, w) in change.iter_mut().zip(whole) {
                        *c = (part - 1.0) * w;
                    }
                    retract(layout, state, &change);
                }
            }
        }
        let between = |a: &[f64], b: &[f64]| -> Vec<f64> {
            let pairs = a.iter().zip(b);
            pairs
                .map(|(a, b)| (a.ln() + part * (b / a).ln()).exp())
                .collect()
        };
        out.noise = NoiseModel {
            q: between(&self.noise.q, &there.noise.q),
            tau: between(&self.noise.tau, &there.noise.tau),
            white: between(&self.noise.white, &there.noise.white),
            r: between(&self.noise.r, &there.noise.r),
        };
        out
    }

    fn update_excess(&mut self, context: &Context<'_>) {
        let each = self.excess.iter_mut().zip(&self.smoothed);
        for ((excess, smoothed), walk) in each.zip(&context.walks) {
            if walk.segment.is_none() {
                continue;
            }
            let (mut squares, mut n) = (0.0, 0.0);
            for ([sum, count], r) in smoothed.sums.reading.iter().zip(&self.noise.r) {
                squares += sum / r;
                n += count;
            }
            let value: f64 = squares / f64::max(n, 1.0);
            *excess = if value.is_finite() {
                value.max(1.0)
            } else {
                *excess
            };
        }
    }

    fn update_noise(&mut self, context: &Context<'_>, sums: &Sums, length: f64) {
        let moved = |old: f64, new: f64, least: f64| {
            let change = (new / old).ln().clamp(-LARGEST_CHANGE, LARGEST_CHANGE);
            let moved = old * (length * change).exp();
            if moved.is_finite() {
                moved.max(least)
            } else {
                old
            }
        };
        if sums.steps == 0.0 {
            return;
        }
        let dt = sums.seconds / sums.steps;
        for (j, [later, earlier, product]) in sums.force.iter().enumerate() {
            let rho = (product / earlier).clamp(1e-6, LARGEST_CORRELATION);
            if !rho.is_finite() {
                continue;
            }
            // What a row adds is well told by the readings; how large it grows in the long run is not.
            let innovation = (later - 2.0 * rho * product + rho * rho * earlier) / sums.steps;
            let before = self.noise.q[j] * (1.0 - (-2.0 * dt / self.noise.tau[j]).exp());
            let least = (LEAST_FORCE * context.inertial[j]).powi(2);
            let added = moved(before, innovation, 0.0);
            self.noise.q[j] = (added / (1.0 - rho * rho)).max(least);
            self.noise.tau[j] = -dt / rho.ln();
            self.noise.white[j] = moved(
                self.noise.white[j],
                sums.white[j] / sums.steps,
                1e-2 * least,
            )
            .max(self.least_white[j]);
        }
        for (i, [squares, n]) in sums.reading.iter().enumerate() {
            if *n > 0.0 {
                let least = LEAST_READING.powi(2) * context.reading_variance[i];
                let most = MOST_READING.powi(2) * context.reading_variance[i];
                self.noise.r[i] = moved(self.noise.r[i], squares / n, least).min(most);
            }
        }
    }

    /// Speed of a degree of freedom in a row of a walk.
    fn speed(&self, context: &Context<'_>, walk: usize, row: usize, dof: usize) -> f64 {
        let layout = &context.plant().layout;
        self.trajectory[walk][row * (layout.nq + layout.nv) + layout.nq + dof]
    }

    /// Speed up to which each degree of freedom counts as at rest.
    #[must_use]
    pub fn rest_speeds(&self, context: &Context<'_>) -> Vec<f64> {
        let nv = context.plant().layout.nv;
        (0..nv)
            .map(|d| {
                let mut variances: Vec<f64> = self
                    .smoothed
                    .iter()
                    .flat_map(|s| s.change_variance.iter().skip(nv + d).step_by(2 * nv))
                    .copied()
                    .collect();
                let typical = crate::noise::median(&mut variances).unwrap_or(0.0).sqrt();
                (REST_DEVIATIONS * typical).max(REST_SHARE * context.scale[nv + d])
            })
            .collect()
    }

    /// What the model lacks.
    #[must_use]
    pub fn missing(&self, context: &Context<'_>) -> Missing {
        let noise = &self.noise;
        let power = |j: usize| {
            let beyond = noise.q[j] + noise.white[j] - self.least_white[j];
            beyond.max(0.0) / context.inertial[j].powi(2)
        };
        let (mut squares, mut n, mut in_segments, mut rows) = (0.0, 0.0, 0, 0);
        for (walk, smoothed) in context.walks.iter().zip(&self.smoothed) {
            rows += walk.len();
            if walk.segment.is_some() {
                in_segments += walk.len();
                for ([sum, count], r) in smoothed.sums.reading.iter().zip(&noise.r) {
                    squares += sum / r;
                    n += count;
                }
            }
        }
        let share = in_segments as f64 / rows.max(1) as f64;
        Missing {
            force: if share < 1.0 {
                (0..context.inertial.len()).map(power).sum()
            } else {
                0.0
            },
            readings: (squares / f64::max(n, 1.0) - 1.0).max(0.0),
            share,
        }
    }

    /// From here on nothing finer than a part of the force that is missing now decides.
    pub fn set_resolution(&mut self, context: &Context<'_>) {
        let nv = context.plant().layout.nv;
        for j in 0..nv {
            let all = || self.forces(context, j);
            let n = all().count().max(1) as f64;
            let mean_square = all().map(|w| w * w).sum::<f64>() / n;
            self.least_white[j] = LEAST_WHITE * LEAST_WHITE * mean_square;
            self.noise.white[j] = self.noise.white[j].max(self.least_white[j]);
        }
    }

    /// Lets joints that stand be held by any force as large as the dry friction that moving rows show, in
    /// every model alike: at rest friction is any force within its cone, and says nothing of its size.
    pub fn free_at_rest(&mut self, context: &Context<'_>) {
        let layout = &context.plant().layout;
        let nv = layout.nv;
        let rest = self.rest_speeds(context);
        let mut free: Vec<Vec<f64>> = context
            .walks
            .iter()
            .map(|w| vec![0.0; if w.segment.is_some() { 0 } else { w.len() * nv }])
            .collect();
        for joint in context.plant().scalar_joints() {
            let d = layout.joints[joint].qvel;
            let mut against = Vec::new();
            for (w, smoothed) in self.smoothed.iter().enumerate() {
                for k in 0..free[w].len() / nv {
                    let speed = self.speed(context, w, k, d);
                    if speed.abs() > rest[d] {
                        against.push(-smoothed.force[k * nv + d] * speed.signum());
                    }
                }
            }
            let friction = crate::noise::median(&mut against).unwrap_or(0.0).max(0.0);
            for (w, free) in free.iter_mut().enumerate() {
                for k in 0..free.len() / nv {
                    if self.speed(context, w, k, d).abs() <= rest[d] {
                        free[k * nv + d] = friction * friction;
                    }
                }
            }
        }
        self.free = free;
    }

    /// The missing force at a degree of freedom, along all walks that are smoothed.
    fn forces<'s>(
        &'s self,
        context: &'s Context<'_>,
        dof: usize,
    ) -> impl Iterator<Item = f64> + 's {
        let nv = context.plant().layout.nv;
        let pairs = self.smoothed.iter().zip(&context.walks);
        pairs
            .filter(|(_, w)| w.segment.is_none())
            .flat_map(move |(s, _)| s.force.iter().skip(dof).step_by(nv).copied())
    }

    /// Quantile of the magnitude of the missing force at each degree of freedom.
    #[must_use]
    pub fn force_quantile(&self, context: &Context<'_>, quantile: f64) -> Vec<f64> {
        (0..context.plant().layout.nv)
            .map(|d| {
                let mut all: Vec<f64> = self.forces(context, d).map(f64::abs).collect();
                if all.is_empty() {
                    return 0.0;
                }
                let at = ((all.len() - 1) as f64 * quantile).round() as usize;
                *all.select_nth_unstable_by(at, f64::total_cmp).1
            })
            .collect()
    }
}
