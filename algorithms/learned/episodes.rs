//! A batch of exploration episodes as trackers see them: noisy readings at the trackers' rate, one
//! simulation per episode, and no copies.

use std::sync::atomic::Ordering;

use asid_core::layout::Recording;
use asid_core::problem::Batch;
use asid_core::rng::Rng;
use asid_core::simulator::{Control, Rollout};
use asid_core::task::Commander;
use asid_core::tracker::ReadingFrames;
use asid_core::{Problem, Result};
use asid_readings::SignalSet;
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

/// Episodes that step in lockstep.
pub struct EpisodeBatch<'a> {
    problem: &'a Problem<'a>,
    batch: Batch,
    sims: Vec<usize>,
    commanders: Vec<Box<dyn Commander>>,
    recording: Recording,
    signals: SignalSet,
    /// Which frames have readings of the trackers.
    read: ReadingFrames,
    substeps: usize,
    frames_per_step: usize,
    control: Vec<f64>,
    theta: Vec<f64>,
    /// Frames of the latest control step, `episodes x frames x width`.
    frames: Vec<f64>,
    /// The latest reading, `episodes x width`.
    latest: Vec<f64>,
    /// Whether each episode still runs, that is, has not diverged.
    alive: Vec<bool>,
    step: usize,
    rng: Rng,
}

impl<'a> EpisodeBatch<'a> {
    /// Prepares `episodes` simultaneous episodes; truths, start poses and noise are drawn from
    /// `rng`.
    ///
    /// # Errors
    /// When the engine cannot set an unknown.
    pub fn new(problem: &'a Problem<'a>, episodes: usize, rng: Rng) -> Result<Self> {
        let protocol = problem.task.exploration();
        let layout = problem.model.layout();
        let recording = layout.recording(&protocol.channels())?;
        let (frames, nu, width) = (protocol.frames_per_step, layout.nu(), recording.width());
        Ok(Self {
            batch: problem.batch(episodes)?,
            sims: (0..episodes).collect(),
            commanders: (0..episodes)
                .map(|_| problem.task.commander())
                .collect::<Result<_>>()?,
            signals: SignalSet::new(layout, problem.signals)?,
            read: ReadingFrames::of(problem.task, protocol.frame_period),
            alive: vec![true; episodes],
            substeps: problem.substeps(protocol.frame_period)?,
            frames_per_step: frames,
            control: vec![0.0; episodes * frames * nu],
            theta: Vec::new(),
            frames: vec![0.0; episodes * frames * width],
            latest: vec![0.0; episodes * width],
            step: 0,
            recording,
            problem,
            rng,
        })
    }

    /// Number of episodes.
    #[must_use]
    pub fn episodes(&self) -> usize {
        self.sims.len()
    }

    /// Number of entries of a reading's row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.recording.width()
    }

    /// Control steps taken since the episodes began.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.step
    }

    /// Elapsed share of the episodes, from 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.step as f64 / self.problem.task.exploration().horizon as f64
    }

    /// The episodes' true values, `episodes x unknowns`, in their units.
    #[must_use]
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// The latest reading of an episode, with noise.
    #[must_use]
    pub fn reading(&self, episode: usize) -> &[f64] {
        let width = self.width();
        &self.latest[episode * width..][..width]
    }

    /// Whether an episode has not diverged.
    #[must_use]
    pub fn alive(&self, episode: usize) -> bool {
        self.alive[episode]
    }

    /// Frames of an episode's latest control step, `frames x width`, with noise; the tracked
    /// entries are NaN in frames without a reading of the trackers.
    #[must_use]
    pub fn frames(&self, episode: usize) -> &[f64] {
        let len = self.frames_per_step * self.width();
        &self.frames[episode * len..][..len]
    }

    /// Continues with another random generator, such as that of the next episode.
    pub fn reseed(&mut self, rng: Rng) {
        self.rng = rng;
    }

    /// Begins new episodes at truths drawn from the prior and start poses of the protocol.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn begin(&mut self) -> Result<()> {
        let protocol = self.problem.task.exploration();
        self.theta.clear();
        let mut starts = Vec::new();
        for _ in 0..self.episodes() {
            for p in self.problem.parameters {
                self.theta.push(p.sample(&mut self.rng));
            }
            for c in &protocol.start {
                starts.push(c.at(self.rng.random()));
            }
        }
        self.batch.set_parameters(&self.sims, &self.theta)?;
        self.batch.place(self.problem.task, &self.sims, &starts)?;
        for commander in &mut self.commanders {
            commander.reset();
        }
        self.alive.fill(true);
        self.step = 0;
        let mut latest = std::mem::take(&mut self.latest);
        let read = self
            .batch
            .simulator
            .read(&self.sims, &self.recording, &mut latest);
        self.add_noise(&mut latest);
        self.latest = latest;
        read
    }

    /// Takes one control step with `actions` (`episodes x action`, in the task's units).
    ///
    /// # Errors
    /// When the engine fails as a whole. A single episode that diverges only gives readings that
    /// are not finite.
    pub fn step(&mut self, actions: &[f64]) -> Result<()> {
        let a = self.problem.task.exploration().action.len();
        let block = self.control.len() / self.episodes();
        let rows = self.control.chunks_exact_mut(block);
        for ((commander, row), action) in self
            .commanders
            .iter_mut()
            .zip(rows)
            .zip(actions.chunks_exact(a))
        {
            commander.commands(action, row);
        }
        let before = self.batch.simulator.steps_taken();
        let rollout = Rollout::new(
            &self.sims,
            self.frames_per_step,
            self.substeps,
            Control::PerSimulation(&self.control),
            &self.recording,
        );
        let mut frames = std::mem::take(&mut self.frames);
        let done = self.batch.simulator.rollout(&rollout, &mut frames);
        self.add_noise(&mut frames);
        self.frames = frames;
        done?;
        self.problem.count_physics(&self.batch, before);
        let episodes = self.episodes() as u64;
        self.problem
            .env_counter
            .fetch_add(episodes, Ordering::Relaxed);
        self.look();
        self.step += 1;
        Ok(())
    }

    /// Takes the frames of the present control step as the trackers show them.
    ///
    /// Where a reading is missing the latest one is kept, as a tracker's driver does.
    fn look(&mut self) {
        let (width, tracked) = (self.width(), self.signals.width());
        let played = self.step * self.frames_per_step;
        let episodes = self.frames.chunks_exact_mut(self.frames_per_step * width);
        for (e, frames) in episodes.enumerate() {
            self.alive[e] &= frames.iter().all(|x| x.is_finite());
            let latest = &mut self.latest[e * width..][..width];
            for (i, row) in frames.chunks_exact_mut(width).enumerate() {
                latest[tracked..].copy_from_slice(&row[tracked..]);
                if self.read.has(played + i + 1) {
                    latest[..tracked].copy_from_slice(&row[..tracked]);
                } else {
                    row[..tracked].fill(f64::NAN);
                }
            }
        }
    }

    fn add_noise(&mut self, rows: &mut [f64]) {
        let (width, tracked) = (self.width(), self.signals.width());
        let Self { signals, rng, .. } = self;
        for row in rows.chunks_exact_mut(width) {
            // A row that is not finite needs no noise.
            if row.iter().all(|x| x.is_finite()) {
                signals.add_noise(&mut row[..tracked], || StandardNormal.sample(rng));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::with_problem;

    /// Frames and reading of the second of two episodes after one control step.
    fn played(problem: &Problem<'_>) -> [Vec<f64>; 2] {
        let rng = problem.streams.stream("episodes");
        let mut batch = EpisodeBatch::new(problem, 2, rng).unwrap();
        batch.begin().unwrap();
        batch.step(&[0.05, 0.0, -0.02, 0.05]).unwrap();
        [batch.frames(1).to_vec(), batch.reading(1).to_vec()]
    }

    /// Symptom: an estimator for a tracker of 10 Hz learned from the means of 50 Hz readings over
    /// each control step, which lag behind the single reading that such a tracker gives. Cause: the
    /// trackers' rate was left out of the episodes of a training.
    #[test]
    fn a_slow_tracker_gives_one_reading_a_control_step() {
        with_problem("rod-balancing", |problem| {
            let levels = [("tracker_rate".to_owned(), 10.0)].into();
            let slow = problem.task.adjusted(&levels).unwrap().unwrap();
            let [every, reading] = played(problem);
            let [some, latest] = played(&Problem {
                task: &*slow,
                ..*problem
            });
            let width = reading.len();
            // Position and orientation of the rod come first; the hand is read at every frame.
            let tracked = 7;
            let rows = every.chunks_exact(width).zip(some.chunks_exact(width));
            for (frame, (a, b)) in (1..).zip(rows) {
                assert_eq!(a[tracked..], b[tracked..]);
                if frame == 5 {
                    assert_eq!(a, b);
                } else {
                    assert!(b[..tracked].iter().all(|x| x.is_nan()), "frame {frame}");
                }
            }
            assert_eq!(reading, latest);
        });
    }
}
