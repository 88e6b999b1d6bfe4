//! Expected posterior standard deviations of an episode, computed before there is a posterior.
//!
//! The rewards of [`crate::fisher`] treat the scatter of neighbouring readings as independent and a
//! difference between two copies as a slope. That ranks episodes and is cheap. But a contact that
//! comes a step early shifts all later readings together, so the resulting standard deviation is
//! several times too small.
//!
//! This module uses the noise model of identification: slopes and roughness from a [`LocalFit`].
//! The region of the fit is narrowed down to that of the posterior, because an identifier also
//! learns how rough the simulator is there.

use nalgebra::DMatrix;

use crate::fisher::inverse_above_prior;
use crate::fisher::local_fit::{LocalFit, design, sets};
use asid_core::error::Result;
use asid_core::identify::Assumptions;
use asid_core::layout::Recording;
use asid_core::parameter::Parameter;
use asid_core::problem::{Batch, Problem, substeps};
use asid_core::simulator::{Control, Rollout};
use asid_core::tracker::{ReadingFrames, TrackerPrior};
use asid_readings::{SignalSet, SystematicErrors};

/// Settings of the computation of expected standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedSettings {
    /// What the identifier assumes about the readings.
    pub assumes: Assumptions,
    /// Number of fits, each over the region that the previous one found. On the shuffleboard, where
    /// convergence takes longest, the standard deviation stays within a third of its value from the
    /// seventh fit on.
    pub rounds: usize,
    /// Standard deviations of a region in units of the posterior's, as in an identifier.
    pub widen: f64,
}

impl Default for ExpectedSettings {
    fn default() -> Self {
        Self {
            assumes: Assumptions::default(),
            rounds: 7,
            widen: 2.0,
        }
    }
}

/// Initial half step of an unknown (in prior standard deviations) and of a start coordinate (in
/// standard deviations of its range): those of [`crate::fisher`].
///
/// They are wider than what most episodes leave of the prior, as an identifier's first region is.
/// In a region that is too narrow the simulator may be smooth by chance, and the following regions
/// would stay there.
const FIRST: [f64; 2] = [0.3, 0.02];

/// Largest half step of a start coordinate, in standard deviations of its range.
const START_REACH: f64 = 0.5;

/// Expected posterior standard deviation of each unknown after each control step of an episode.
///
/// The episode plays `actions` (`horizon x action`) at `theta` and `start`. The result has `horizon
/// + 1` rows, in the unknowns' units; the first holds the prior standard deviations. Binary
/// unknowns have no slope: their entries are NaN. `None` where nearly every simulation diverged.
///
/// # Errors
/// When the engine fails.
pub fn expected_deviation(
    problem: &Problem<'_>,
    settings: &ExpectedSettings,
    theta: &[f64],
    start: &[f64],
    actions: &[f64],
) -> Result<Option<Vec<Vec<f64>>>> {
    let mut episode = Episode::new(problem, theta, start, actions)?;
    let (d, n) = (episode.sought.len(), episode.dimension());
    if d == 0 {
        return Ok(None);
    }
    let mut rng = problem.streams.stream("expected deviation");
    let (low, high) = episode.bounds();
    let mut factor = DMatrix::from_fn(n, n, |i, j| {
        f64::from(u8::from(i == j)) * FIRST[usize::from(i >= d)]
    });
    let middle = episode.middle.clone();
    let mut fit = None;
    for _ in 0..settings.rounds.max(1) {
        let points = design(&middle, &factor, (&low, &high), sets(n), &mut rng);
        let Some(found) = episode.fit(&factor, &points, settings.assumes.tracker)? else {
            return Ok(None);
        };
        let Some(told) = found.emulated(settings.assumes.correlated) else {
            return Ok(None);
        };
        let covariance = inverse_above_prior(&(told + DMatrix::identity(n, n)));
        fit = Some(found);
        let Some(root) = covariance.cholesky() else {
            break;
        };
        // With this length, n pairs have the covariance of the region.
        factor = root.l() * (settings.widen * (n as f64).sqrt());
        for i in 0..n {
            let most = if i < d {
                Parameter::scaled_bound()
            } else {
                START_REACH
            };
            let length = factor.row(i).norm();
            if length > most {
                factor.row_mut(i).scale_mut(most / length);
            }
        }
    }
    let Some(fit) = fit else { return Ok(None) };
    let steps = problem.task.exploration().horizon;
    let mut out = Vec::with_capacity(steps + 1);
    for h in 0..=steps {
        let told = if h == 0 {
            None
        } else {
            fit.first(episode.readings_after(h))
                .emulated(settings.assumes.correlated)
        };
        let prior = DMatrix::identity(n, n);
        let total = told.map_or_else(|| prior.clone(), |t| t + &prior);
        out.push(episode.deviations(theta, &inverse_above_prior(&total)));
    }
    Ok(Some(out))
}

/// An episode simulated around a point: unknowns in prior-scaled coordinates, then the start pose
/// in standard deviations of its range.
struct Episode<'a> {
    problem: &'a Problem<'a>,
    /// Indices of the unknowns that are not binary.
    sought: Vec<usize>,
    theta: Vec<f64>,
    middle: Vec<f64>,
    ctrl: Vec<f64>,
    batch: Batch,
    recording: Recording,
    signals: SignalSet,
    substeps: usize,
    sims: Vec<usize>,
}

impl<'a> Episode<'a> {
    fn new(
        problem: &'a Problem<'a>,
        theta: &[f64],
        start: &[f64],
        actions: &[f64],
    ) -> Result<Self> {
        let protocol = problem.task.exploration();
        let layout = problem.model.layout();
        let sought: Vec<usize> = (0..theta.len())
            .filter(|&i| !problem.parameters[i].is_binary())
            .collect();
        let unknowns = sought
            .iter()
            .map(|&i| problem.parameters[i].to_scaled(theta[i]));
        let bound = Parameter::scaled_bound();
        let coordinates = start.iter().zip(&protocol.start);
        let middle: Vec<f64> = unknowns
            .map(|z| z.clamp(-bound, bound))
            .chain(coordinates.map(|(x, c)| x / c.std()))
            .collect();
        let mut commander = problem.task.commander()?;
        commander.reset();
        let block = protocol.frames_per_step * layout.nu();
        let mut ctrl = vec![0.0; protocol.horizon * block];
        let steps = actions.chunks_exact(protocol.action.len());
        for (action, ctrl) in steps.zip(ctrl.chunks_exact_mut(block.max(1))) {
            commander.commands(action, ctrl);
        }
        let n = middle.len();
        let size = 1 + 2 * n * sets(n);
        Ok(Self {
            sought,
            theta: theta.to_vec(),
            middle,
            ctrl,
            batch: problem.batch(size)?,
            recording: layout.recording(&protocol.channels())?,
            signals: SignalSet::new(layout, problem.signals)?.with_angles_of(
                problem.task.scene(),
                layout,
                problem.signals,
            )?,
            substeps: substeps(layout, protocol.frame_period)?,
            sims: (0..size).collect(),
            problem,
        })
    }

    fn dimension(&self) -> usize {
        self.middle.len()
    }

    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let d = self.sought.len();
        let high: Vec<f64> = (0..self.dimension())
            .map(|i| {
                if i < d {
                    Parameter::scaled_bound()
                } else {
                    f64::INFINITY
                }
            })
            .collect();
        (high.iter().map(|x| -x).collect(), high)
    }

    /// Number of residual entries after `steps` control steps; the first reading is that of the
    /// start.
    fn readings_after(&self, steps: usize) -> usize {
        let frames = steps * self.problem.task.exploration().frames_per_step;
        (1 + frames) * self.signals.whitened_len()
    }

    /// Simulates the middle and `points`, and fits their differences.
    ///
    /// The middle's readings determine how systematic errors of the trackers would show.
    fn fit(
        &mut self,
        factor: &DMatrix<f64>,
        points: &[Vec<f64>],
        tracker: TrackerPrior,
    ) -> Result<Option<LocalFit>> {
        let protocol = self.problem.task.exploration();
        let d = self.sought.len();
        let (mut theta, mut starts) = (Vec::new(), Vec::new());
        for point in std::iter::once(&self.middle).chain(points) {
            let mut values = self.theta.clone();
            for (&i, z) in self.sought.iter().zip(point) {
                values[i] = self.problem.parameters[i].from_scaled(*z);
            }
            theta.extend(values);
            let coordinates = point[d..].iter().zip(&protocol.start);
            starts.extend(coordinates.map(|(x, c)| x * c.std()));
        }
        self.batch.set_parameters(&self.sims, &theta)?;
        self.batch.place(self.problem.task, &self.sims, &starts)?;
        let (width, frames) = (self.recording.width(), protocol.frames());
        let mut first = vec![0.0; self.sims.len() * width];
        self.batch
            .simulator
            .read(&self.sims, &self.recording, &mut first)?;
        let mut readings = vec![0.0; self.sims.len() * frames * width];
        let before = self.batch.simulator.steps_taken();
        let rollout = Rollout::new(
            &self.sims,
            frames,
            self.substeps,
            Control::Shared(&self.ctrl),
            &self.recording,
        );
        self.batch.simulator.rollout(&rollout, &mut readings)?;
        self.problem.count_physics(&self.batch, before);

        let row = |s: usize| {
            let start = &first[s * width..][..width];
            let after = readings[s * frames * width..][..frames * width].chunks_exact(width);
            std::iter::once(start).chain(after)
        };
        let len = self.signals.whitened_len();
        let mut whitened = vec![0.0; len];
        // The tracked signals come first in a row.
        let tracked = self.signals.width();
        let all: Vec<f64> = row(0).flat_map(|r| r[..tracked].to_vec()).collect();
        let time: Vec<f64> = (0..=frames)
            .map(|k| k as f64 * protocol.frame_period)
            .collect();
        let systematic = SystematicErrors::at(tracker, &self.signals, &time, &all);
        // A slow tracker has no reading in some frames.
        let read = ReadingFrames::of(self.problem.task, protocol.frame_period);
        let is_read = (0..=frames).map(|frame| read.has(frame));
        let there: Vec<bool> = is_read.flat_map(|is| vec![is; len]).collect();
        let mut of = |s: usize| -> Option<Vec<f64>> {
            let mut out = Vec::with_capacity((1 + frames) * len);
            for (frame, (a, b)) in row(s).zip(row(0)).enumerate() {
                self.signals.difference(a, b, &mut whitened);
                if !read.has(frame) {
                    whitened.fill(0.0);
                }
                out.extend_from_slice(&whitened);
            }
            systematic.whiten(&there, &mut out);
            out.iter().all(|x| x.is_finite()).then_some(out)
        };
        let Some(middle) = of(0) else { return Ok(None) };
        let rows: Vec<Option<Vec<f64>>> = (1..self.sims.len()).map(of).collect();
        Ok(LocalFit::new(&self.middle, &middle, factor, points, &rows))
    }

    fn deviations(&self, theta: &[f64], covariance: &DMatrix<f64>) -> Vec<f64> {
        let mut out = vec![f64::NAN; theta.len()];
        for (k, &i) in self.sought.iter().enumerate() {
            let scaled = covariance[(k, k)].max(0.0).sqrt();
            out[i] = self.problem.parameters[i].unscale_std(theta[i], scaled);
        }
        out
    }
}
