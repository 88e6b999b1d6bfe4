//! Expected posterior standard deviations of an episode, computed before there is a posterior.
//!
//! The rewards of [`crate::fisher`] treat the scatter of neighbouring readings as independent and a
//! difference between two copies as a slope. That ranks episodes and is cheap. But a contact that
//! comes a step early shifts all later readings together, so the resulting standard deviation is
//! several times too small.
//!
//! This module uses the noise model of identification: slopes and roughness from a [`LocalFit`].
//! As in an identifier, the region of the fit follows that of the posterior from round to round, the
//! simulations of earlier rounds are used again, and the start pose is known only by the readings.

use nalgebra::{DMatrix, DVector};

use crate::fisher::inverse_above_prior;
use crate::fisher::local_fit::{LocalFit, design, sets};
use asid_core::error::Result;
use asid_core::identify::Assumptions;
use asid_core::layout::Recording;
use asid_core::parameter::Parameter;
use asid_core::problem::{Batch, Problem, substeps};
use asid_core::simulator::{Control, Rollout};
use asid_core::tracker::ReadingFrames;
use asid_readings::{SignalSet, SystematicErrors};

use super::emulator::REACH;
use super::likelihood::{START_BOUND, start_deviation};

/// Settings of the computation of expected standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedSettings {
    /// What the identifier assumes about the readings.
    pub assumes: Assumptions,
    /// Number of fits, each over the region that the previous one found. On the shuffleboard, where
    /// convergence takes longest, the standard deviation stays within a tenth of its value from the
    /// fifth fit on.
    pub rounds: usize,
    /// Standard deviations of a region in units of the posterior's, as in an identifier.
    pub widen: f64,
}

impl Default for ExpectedSettings {
    fn default() -> Self {
        Self {
            assumes: Assumptions::default(),
            rounds: 5,
            widen: 2.0,
        }
    }
}

/// Initial half step of an unknown and of a start coordinate, in prior standard deviations.
///
/// It is wider than what most episodes leave of the prior, as an identifier's first region is. In a
/// region that is too narrow the simulator may be smooth by chance, and the following regions would
/// stay there.
const FIRST: f64 = 0.3;

/// Expected posterior standard deviation of each unknown after each control step of an episode.
///
/// The episode plays `actions` (`horizon x action`) at `theta` and `start`. The result has a row for
/// the start, which holds the prior standard deviations, and one for each control step, in the
/// unknowns' units. Binary unknowns have no slope: their entries are NaN. `None` where nearly every
/// simulation diverged, the start has no reading, or all unknowns are binary.
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
    let Some(mut episode) = Episode::new(problem, theta, start, actions)? else {
        return Ok(None);
    };
    let (d, n) = (episode.sought.len(), episode.dimension());
    if d == 0 {
        return Ok(None);
    }
    let mut rng = problem.streams.stream("expected deviation");
    let bound = Parameter::scaled_bound();
    let (low, high) = (vec![-bound; n], vec![bound; n]);
    let mut factor = DMatrix::identity(n, n) * FIRST;
    let middle = episode.middle.clone();
    let mut fit = None;
    for _ in 0..settings.rounds.max(1) {
        let points = design(&middle, &factor, (&low, &high), sets(n), &mut rng);
        let Some(found) = episode.fit(&factor, &points, settings)? else {
            return Ok(None);
        };
        let Some(told) = found.emulated(settings.assumes.correlated) else {
            return Ok(None);
        };
        fit = Some(found);
        let next = within_reach(&factor)
            .and_then(|limits| inverse_above_prior(&(told + limits)).cholesky());
        let Some(root) = next else { break };
        // With this length, n pairs have the covariance of the region.
        factor = root.l() * (settings.widen * (n as f64).sqrt());
        for mut row in factor.row_iter_mut() {
            let length = row.norm();
            row.scale_mut(bound / length.max(bound));
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

/// Information of the prior and of the region with this factor, in prior standard deviations.
///
/// The draws of an identifier stay within [`REACH`] standard deviations of the region.
fn within_reach(factor: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = factor.nrows();
    let inverse = factor.solve_lower_triangular(&DMatrix::identity(n, n))?;
    // The factor is `sqrt(n)` standard deviations long. A uniform density over `REACH` of them to
    // either side has `REACH^2 / 3` times their variance.
    let limits = inverse.tr_mul(&inverse) * (n as f64 * 3.0 / REACH.powi(2));
    Some(DMatrix::identity(n, n) + limits)
}

/// An episode simulated around a point: unknowns in prior-scaled coordinates, then the offset of the
/// start pose.
///
/// As in an identifier, the start pose lies within [`START_BOUND`] standard deviations of what one
/// reading shows. Offsets are in standard deviations of a uniform density over that range, so that
/// they have the same bounds as the unknowns.
struct Episode<'a> {
    problem: &'a Problem<'a>,
    /// Indices of the unknowns that are not binary.
    sought: Vec<usize>,
    theta: Vec<f64>,
    start: Vec<f64>,
    /// Unit of the offset of each start coordinate.
    start_std: Vec<f64>,
    middle: Vec<f64>,
    ctrl: Vec<f64>,
    batch: Batch,
    recording: Recording,
    signals: SignalSet,
    substeps: usize,
    sims: Vec<usize>,
    /// Pairs of all fits so far: their points and what these read.
    pairs: Vec<[Simulated; 2]>,
}

/// A point and its residuals relative to the middle's; `None` where the simulation diverged.
type Simulated = (Vec<f64>, Option<Vec<f64>>);

impl<'a> Episode<'a> {
    fn new(
        problem: &'a Problem<'a>,
        theta: &[f64],
        start: &[f64],
        actions: &[f64],
    ) -> Result<Option<Self>> {
        let protocol = problem.task.exploration();
        let layout = problem.model.layout();
        let sought: Vec<usize> = (0..theta.len())
            .filter(|&i| !problem.parameters[i].is_binary())
            .collect();
        let unknowns = sought
            .iter()
            .map(|&i| problem.parameters[i].to_scaled(theta[i]));
        let bound = Parameter::scaled_bound();
        let middle: Vec<f64> = unknowns
            .map(|z| z.clamp(-bound, bound))
            .chain(start.iter().map(|_| 0.0))
            .collect();
        let mut inside = theta.to_vec();
        for (&i, z) in sought.iter().zip(&middle) {
            inside[i] = problem.parameters[i].from_scaled(*z);
        }
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
        let signals = SignalSet::new(layout, problem.signals)?.with_angles_of(
            problem.task.scene(),
            layout,
            problem.signals,
        )?;
        let recording = layout.recording(&protocol.channels())?;
        let mut batch = problem.batch(size)?;
        let mut first = vec![0.0; recording.width()];
        batch.set_parameters(&[0], &inside)?;
        batch.place(problem.task, &[0], start)?;
        batch.simulator.read(&[0], &recording, &mut first)?;
        // The tracked signals come first in a row.
        first.truncate(signals.width());
        if first.iter().any(|x| !x.is_finite()) {
            return Ok(None);
        }
        let mut start_std = start_deviation(problem, &signals, &first);
        for std in &mut start_std {
            *std *= START_BOUND / bound;
        }
        Ok(Some(Self {
            sought,
            theta: inside,
            start: start.to_vec(),
            start_std,
            middle,
            ctrl,
            batch,
            recording,
            signals,
            substeps: substeps(layout, protocol.frame_period)?,
            sims: (0..size).collect(),
            pairs: Vec::new(),
            problem,
        }))
    }

    fn dimension(&self) -> usize {
        self.middle.len()
    }

    /// Number of residual entries after `steps` control steps; the first reading is that of the
    /// start.
    fn readings_after(&self, steps: usize) -> usize {
        let frames = steps * self.problem.task.exploration().frames_per_step;
        (1 + frames) * self.signals.whitened_len()
    }

    /// Simulates the middle and `points`, and fits their differences, together with those of earlier
    /// fits that lie within the region of `factor`.
    ///
    /// The middle's readings determine how systematic errors of the trackers would show.
    fn fit(
        &mut self,
        factor: &DMatrix<f64>,
        points: &[Vec<f64>],
        settings: &ExpectedSettings,
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
            let offsets = point[d..].iter().zip(&self.start_std);
            let offsets = offsets.map(|(x, std)| x * std);
            starts.extend(self.start.iter().zip(offsets).map(|(x, offset)| x + offset));
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
        let systematic = SystematicErrors::at(settings.assumes.tracker, &self.signals, &time, &all);
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
        let mut simulated = points.iter().cloned().zip((1..self.sims.len()).map(of));
        let mut fresh = Vec::with_capacity(points.len() / 2);
        while let (Some(up), Some(down)) = (simulated.next(), simulated.next()) {
            fresh.push([up, down]);
        }
        let n = self.middle.len();
        // The factor is `sqrt(n)` standard deviations of the region long.
        let reach = REACH / (n as f64).sqrt();
        let within = |point: &[f64]| {
            let step = DVector::from_fn(n, |i, _| point[i] - self.middle[i]);
            let step = factor.solve_lower_triangular(&step);
            step.is_some_and(|u| u.amax() <= reach)
        };
        let near = |pair: &&[Simulated; 2]| pair.iter().all(|(point, _)| within(point));
        let used = self.pairs.iter().filter(near).chain(&fresh).flatten();
        let (points, rows): (Vec<_>, Vec<_>) = used.cloned().unzip();
        self.pairs.extend(fresh);
        Ok(LocalFit::new(&self.middle, &middle, factor, &points, &rows))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_adds_the_information_of_its_limits_to_the_prior() {
        // A region of half a prior standard deviation: 1 + 3 / (3 * 0.5)^2.
        let factor = DMatrix::identity(3, 3) * (0.5 * 3.0_f64.sqrt());
        let limits = within_reach(&factor).unwrap();
        let expected = DMatrix::identity(3, 3) * (1.0 + 3.0 / 2.25);
        assert!((limits - expected).norm() < 1e-12);
    }
}
