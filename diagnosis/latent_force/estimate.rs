//! Trajectory, missing force and noise of all episodes, estimated by expectation maximisation.
//!
//! The smoother gives the trajectory and the missing force for given covariances; these follow from it (Shumway and
//! Stoffer 1982): `q` and `tau` from the force and its products over a row, `r` from what is left of
//! the readings. Between linearisations a few rounds are taken, lengthened, for EM is slow where a variance is small.

use asid_core::{Parameter, Result};
use asid_effects::EffectSpec;
use asid_mjcf::Plant;
use rayon::prelude::*;

use crate::data::Logs;
use crate::machine::Machine;
use crate::predict::State;

use super::initial::{from_readings, scales, start};
use super::smoother::{NoiseModel, Problem, Smoothed, Start, Sums, smooth};
use super::step_map::{Derivatives, LinearEpisode, StepMap};
use super::tangent::retract;
use super::walk::Walk;

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

    /// Where the walks begin, about a trajectory.
    #[must_use]
    pub fn starts(&self, trajectory: &[Vec<f64>]) -> Vec<Start> {
        let width = self.plant().layout.nq + self.plant().layout.nv;
        self.given
            .iter()
            .zip(trajectory)
            .map(|(given, states)| {
                let given = given.as_ref().map(|s| (s, &self.open[..]));
                let scales = (&self.scale[..], &self.position_noise[..]);
                start(self.plant(), given, &states[..width], scales)
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

/// A context for some walks, and a first estimate of the model at `theta`, not yet smoothed. What no
/// sensor reads of the state is taken from `otherwise`.
///
/// # Errors
/// When the engine fails.
pub fn begin<'a>(
    machine: &'a Machine,
    logs: &'a Logs,
    walks: Vec<Walk>,
    (given, open): (Vec<Option<State>>, Vec<usize>),
    (parameters, theta): (&[Parameter], &[f64]),
    otherwise: &[Vec<f64>],
) -> Result<(Context<'a>, Estimate)> {
    let plant = &machine.plant;
    let layout = &plant.layout;
    let (nv, width) = (layout.nv, layout.nq + layout.nv);
    let trajectory = from_readings(plant, logs, &walks, otherwise);
    let noise = logs.entry_noise();
    let mut position_noise = vec![0.0; nv];
    for sensor in &logs.sensors {
        let place = layout.sensors.iter().position(|s| s.name == sensor.name);
        if let Some(asid_mjcf::plant::Reads::Joint(j)) = place.map(|p| plant.sensors[p])
            && place.is_some_and(|p| layout.sensors[p].kind == "jointpos")
        {
            position_noise[layout.joints[j].qvel] = sensor.noise;
        }
    }
    let mut context = Context {
        machine,
        logs,
        given,
        open,
        scale: scales(plant, &trajectory),
        position_noise,
        reading_variance: noise.iter().map(|n| n * n).collect(),
        inertial: vec![0.0; nv],
        walks,
    };
    let mut map = context.map(&[], parameters, nv + 1)?;
    let want = Derivatives {
        force: true,
        ..Derivatives::default()
    };
    let push = vec![FIRST_PUSH; nv];
    let linear = map.linearise(theta, &trajectory, want, &push, &[])?;
    let b: Vec<Vec<f64>> = linear.into_iter().map(|l| l.b).collect();
    // Inertia by the speed that a force makes, times the acceleration seen.
    let mut sums = vec![(0.0, 0.0); nv];
    for ((walk, states), b) in context.walks.iter().zip(&trajectory).zip(&b) {
        for k in 0..walk.len() - 1 {
            for (d, sum) in sums.iter_mut().enumerate() {
                let gained = b[(k * 2 * nv + nv + d) * nv + d];
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

    /// Smooths about the present trajectory, fits the noise over some rounds, and moves the trajectory.
    pub fn improve(&mut self, context: &Context<'_>, linear: &[LinearEpisode], rounds: usize) {
        let starts = context.starts(&self.trajectory);
        let mut length = LENGTHENED;
        let mut before = (f64::NEG_INFINITY, self.noise.clone());
        for round in 0..rounds.max(1) {
            let smoothed: Vec<Smoothed> = self
                .problems(context, linear, &starts)
                .map(|p| smooth(p, &self.noise))
                .collect();
            let mut sums = Sums::default();
            smoothed.iter().for_each(|s| sums.add(&s.sums));
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
            }
        }
        let layout = &context.plant().layout;
        let (nx, width) = (2 * layout.nv, layout.nq + layout.nv);
        for (states, smoothed) in self.trajectory.iter_mut().zip(&self.smoothed) {
            let changes = smoothed.change.chunks_exact(nx);
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
        for (states, smoothed) in out.trajectory.iter_mut().zip(&there.smoothed) {
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
        let dt = sums.seconds / sums.steps.max(1.0);
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

    /// Power of the missing force beyond what is too fine to decide, in units of the inertial forces, over all degrees of
    /// freedom.
    #[must_use]
    pub fn missing_power(&self, inertial: &[f64]) -> f64 {
        let noise = &self.noise;
        let total = |j: usize| noise.q[j] + noise.white[j] - self.least_white[j];
        (0..inertial.len())
            .map(|j| total(j).max(0.0) / inertial[j].powi(2))
            .sum()
    }

    /// From here on nothing finer than a part of the force that is missing now decides.
    pub fn set_resolution(&mut self, nv: usize) {
        for j in 0..nv {
            let all = || {
                let smoothed = self.smoothed.iter();
                smoothed.flat_map(|s| s.force.iter().skip(j).step_by(nv))
            };
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
            .map(|w| vec![0.0; w.len() * nv])
            .collect();
        for joint in context.plant().scalar_joints() {
            let d = layout.joints[joint].qvel;
            let mut against = Vec::new();
            for (w, smoothed) in self.smoothed.iter().enumerate() {
                for k in 0..context.walks[w].len() {
                    let speed = self.speed(context, w, k, d);
                    if speed.abs() > rest[d] {
                        against.push(-smoothed.force[k * nv + d] * speed.signum());
                    }
                }
            }
            let friction = crate::noise::median(&mut against).unwrap_or(0.0).max(0.0);
            for (w, free) in free.iter_mut().enumerate() {
                for k in 0..context.walks[w].len() {
                    if self.speed(context, w, k, d).abs() <= rest[d] {
                        free[k * nv + d] = friction * friction;
                    }
                }
            }
        }
        self.free = free;
    }

    /// Quantile of the magnitude of the missing force at each degree of freedom.
    #[must_use]
    pub fn force_quantile(&self, nv: usize, quantile: f64) -> Vec<f64> {
        (0..nv)
            .map(|d| {
                let mut all: Vec<f64> = self
                    .smoothed
                    .iter()
                    .flat_map(|s| s.force.iter().skip(d).step_by(nv))
                    .map(|x| x.abs())
                    .collect();
                if all.is_empty() {
                    return 0.0;
                }
                let at = ((all.len() - 1) as f64 * quantile).round() as usize;
                *all.select_nth_unstable_by(at, f64::total_cmp).1
            })
            .collect()
    }
}
