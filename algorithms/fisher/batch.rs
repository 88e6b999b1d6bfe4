//! Episodes with their Fisher information.
//!
//! In a batch every episode has two copies for each entry (an unknown, or a coordinate of the start
//! pose): one with the entry slightly increased, one with it slightly decreased.
//!
//! [`Form`] says from which state the copies start a control step. [`Sensitivity`] computes
//! derivatives from their readings. [`Information`] sums these up and computes the rewards.

use super::sensitivity::Sensitivity;
use super::settings::{FisherSettings, Form};
use crate::fisher::Information;
use asid_core::error::Result;
use asid_core::layout::Recording;
use asid_core::parameter::Parameter;
use asid_core::problem::{Batch, Problem, substeps};
use asid_core::simulator::{Control, Rollout};
use asid_core::task::Commander;
use asid_core::tracker::ReadingFrames;
use asid_readings::SignalSet;

/// Step of the start pose in finite differences, in standard deviations of its range.
const START_DELTA: f64 = 0.02;

/// A batch of episodes with their Fisher information.
pub struct FisherBatch<'a> {
    problem: &'a Problem<'a>,
    settings: FisherSettings,
    batch: Batch,
    episodes: usize,
    entries: usize,
    sims: Vec<usize>,
    commanders: Vec<Box<dyn Commander>>,
    recording: Recording,
    sensitivity: Sensitivity,
    substeps: usize,
    read: ReadingFrames,
    /// Control steps taken.
    at: usize,
    /// Steps up and down of each pair of copies, prior-scaled: `episodes x entries`.
    steps: Vec<[f64; 2]>,
    information: Vec<Information>,
    ctrl: Vec<f64>,
    control: Vec<f64>,
    readings: Vec<f64>,
    copies: (Vec<usize>, Vec<usize>),
    alive: Vec<bool>,
}

/// The value of an unknown, or the end of its range if it lies beyond.
///
/// An identifier may leave the prior's range. Beyond an end both copies would be that end, and
/// their difference would tell nothing.
fn within_range(parameter: &Parameter, value: f64) -> f64 {
    let (z, bound) = (parameter.to_scaled(value), Parameter::scaled_bound());
    if z.abs() <= bound || parameter.is_binary() {
        return value;
    }
    parameter.from_scaled(z.clamp(-bound, bound))
}

impl<'a> FisherBatch<'a> {
    /// Prepares `episodes` simultaneous episodes.
    ///
    /// # Errors
    /// When the engine cannot set an unknown or the settings make no sense.
    pub fn new(
        problem: &'a Problem<'a>,
        settings: &FisherSettings,
        episodes: usize,
    ) -> Result<Self> {
        settings.check()?;
        let protocol = problem.task.exploration();
        let d = problem.parameters.len();
        let with_start = settings.nuisance && settings.form == Form::Trajectory;
        let nuisance = if with_start { protocol.start.len() } else { 0 };
        let entries = d + nuisance;
        let copies = 1 + 2 * entries;
        let batch = problem.batch(episodes * copies)?;
        let layout = problem.model.layout();
        let recording = layout.recording(&protocol.channels())?;
        let signals = SignalSet::new(layout, problem.signals)?;
        // The copies of a binary unknown are two models; a deviation from a straight line means
        // nothing between them.
        let binary = |entry| {
            problem
                .parameters
                .get(entry)
                .is_some_and(Parameter::is_binary)
        };
        let rough = (0..entries)
            .map(|entry| settings.roughness && !binary(entry))
            .collect();
        let from: Vec<usize> = (0..episodes)
            .flat_map(|e| std::iter::repeat_n(e * copies, copies - 1))
            .collect();
        let to: Vec<usize> = (0..episodes * copies).filter(|s| s % copies != 0).collect();
        let n = episodes * copies;
        Ok(Self {
            settings: settings.clone(),
            episodes,
            entries,
            sims: (0..n).collect(),
            commanders: (0..episodes)
                .map(|_| problem.task.commander())
                .collect::<Result<_>>()?,
            substeps: substeps(layout, protocol.frame_period)?,
            read: ReadingFrames::of(problem.task, protocol.frame_period),
            at: 0,
            steps: vec![[0.0; 2]; episodes * entries],
            information: vec![Information::prior(d, nuisance); episodes],
            ctrl: vec![0.0; protocol.frames_per_step * layout.nu()],
            control: vec![0.0; n * protocol.frames_per_step * layout.nu()],
            readings: vec![0.0; n * protocol.frames_per_step * recording.width()],
            sensitivity: Sensitivity::new(signals, rough),
            copies: (from, to),
            alive: vec![true; episodes],
            recording,
            batch,
            problem,
        })
    }

    /// Number of episodes.
    #[must_use]
    pub fn episodes(&self) -> usize {
        self.episodes
    }

    /// Number of entries of a reading's row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.recording.width()
    }

    /// Information gathered so far in each episode.
    #[must_use]
    pub fn information(&self) -> &[Information] {
        &self.information
    }

    /// Starts all episodes at `theta` (`episodes x d`) and `starts` (`episodes x
    /// coordinates`), and writes the first true readings (`episodes x width`).
    ///
    /// # Errors
    /// When the engine fails.
    pub fn begin(&mut self, theta: &[f64], starts: &[f64], first: &mut [f64]) -> Result<()> {
        let (d, k) = (
            self.problem.parameters.len(),
            self.problem.task.exploration().start.len(),
        );
        let mut all_theta = Vec::with_capacity(self.sims.len() * d);
        let mut all_starts = Vec::with_capacity(self.sims.len() * k);
        for e in 0..self.episodes {
            let t: Vec<f64> = self
                .problem
                .parameters
                .iter()
                .zip(&theta[e * d..])
                .map(|(p, value)| within_range(p, *value))
                .collect();
            let s = &starts[e * k..(e + 1) * k];
            all_theta.extend_from_slice(&t);
            all_starts.extend_from_slice(s);
            for entry in 0..self.entries {
                let mut taken = [0.0; 2];
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let (mut t, mut s) = (t.clone(), s.to_vec());
                    if let Some(parameter) = self.problem.parameters.get(entry) {
                        let bound = Parameter::scaled_bound();
                        let z = parameter.to_scaled(t[entry]);
                        // The copies of a binary unknown are its two models, one prior standard
                        // deviation to either side of their mean.
                        let moved = if parameter.is_binary() {
                            sign
                        } else {
                            (z + sign * self.settings.delta).clamp(-bound, bound)
                        };
                        t[entry] = parameter.from_scaled(moved);
                        taken[side] = sign * (moved - z);
                    } else {
                        let i = entry - d;
                        let unit = self.problem.task.exploration().start[i].std();
                        s[i] += sign * START_DELTA * unit;
                        taken[side] = START_DELTA;
                    }
                    all_theta.extend(t);
                    all_starts.extend(s);
                }
                self.steps[e * self.entries + entry] = taken;
            }
        }
        self.batch.set_parameters(&self.sims, &all_theta)?;
        self.batch
            .place(self.problem.task, &self.sims, &all_starts)?;
        for c in &mut self.commanders {
            c.reset();
        }
        for i in &mut self.information {
            i.reset();
        }
        self.alive.fill(true);
        self.at = 0;
        let width = self.width();
        let mut all = vec![0.0; self.sims.len() * width];
        self.batch
            .simulator
            .read(&self.sims, &self.recording, &mut all)?;
        let copies = 1 + 2 * self.entries;
        for e in 0..self.episodes {
            first[e * width..(e + 1) * width].copy_from_slice(&all[e * copies * width..][..width]);
            if self.entries > self.problem.parameters.len() {
                self.accumulate(e, copies, 1, 0, &all);
            }
        }
        Ok(())
    }

    /// Takes one control step with `actions` (`episodes x action`, in the task's units).
    ///
    /// Writes the last true reading of each episode (`episodes x width`) and its reward.
    /// [`FisherBatch::alive`] then says which episodes still run.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn step(&mut self, actions: &[f64], last: &mut [f64], reward: &mut [f64]) -> Result<()> {
        let protocol = self.problem.task.exploration();
        let a = protocol.action.len();
        let copies = 1 + 2 * self.entries;
        let block = self.ctrl.len();
        for e in 0..self.episodes {
            self.commanders[e].commands(&actions[e * a..(e + 1) * a], &mut self.ctrl);
            for c in 0..copies {
                self.control[(e * copies + c) * block..][..block].copy_from_slice(&self.ctrl);
            }
        }
        if self.settings.form == Form::OneStep && copies > 1 {
            self.batch
                .simulator
                .copy_state(&self.copies.0, &self.copies.1)?;
        }
        let frames = protocol.frames_per_step;
        let before = self.batch.simulator.steps_taken();
        let rollout = Rollout::new(
            &self.sims,
            frames,
            self.substeps,
            Control::PerSimulation(&self.control),
            &self.recording,
        );
        self.batch.simulator.rollout(&rollout, &mut self.readings)?;
        self.problem.count_physics(&self.batch, before);
        self.problem
            .env_counter
            .fetch_add(self.episodes as u64, std::sync::atomic::Ordering::Relaxed);
        let width = self.width();
        let readings = std::mem::take(&mut self.readings);
        for e in 0..self.episodes {
            let trace = self.information[e].trace();
            // The one-step derivative is that of the state at the end of the control step; the
            // trajectory form counts every reading of the log.
            let first = if self.settings.form == Form::OneStep {
                frames - 1
            } else {
                0
            };
            let (read, before) = (self.read, self.at * frames);
            for frame in (first..frames).filter(|f| read.has(before + f + 1)) {
                self.accumulate(e, copies, frames, frame, &readings);
            }
            reward[e] = self.information[e].reward(self.settings.objective, trace);
            let row = &readings[(e * copies * frames + frames - 1) * width..][..width];
            last[e * width..(e + 1) * width].copy_from_slice(row);
            self.alive[e] = row.iter().all(|x| x.is_finite());
            if !self.alive[e] {
                reward[e] = 0.0;
            }
        }
        self.readings = readings;
        self.at += 1;
        Ok(())
    }

    /// Whether each episode still runs, that is, has not diverged.
    #[must_use]
    pub fn alive(&self) -> &[bool] {
        &self.alive
    }

    /// Adds the reading of one frame to an episode's information.
    fn accumulate(
        &mut self,
        e: usize,
        copies: usize,
        frames: usize,
        frame: usize,
        readings: &[f64],
    ) {
        let width = self.recording.width();
        let rows = self.sensitivity.rows();
        let reading =
            |copy: usize| &readings[((e * copies + copy) * frames + frame) * width..][..width];
        let steps = &self.steps[e * self.entries..(e + 1) * self.entries];
        let jacobian = self.sensitivity.jacobian(reading, steps);
        self.information[e].add(jacobian, rows);
    }
}
