//! Fisher exploration as a batch of environments, for learners.
//!
//! An observation holds a reading with the trackers' noise, as in the real world, the elapsed share
//! of the episode, and the information gathered so far (see [`Observer`]). With the latter two, the
//! return of the telescoping objectives is a function of the observation.

use crate::fisher::{FisherBatch, FisherSettings};
use asid_core::environment::{BatchEnvironment, Transition};
use asid_core::rng::Rng;
use asid_core::{Problem, Result, Streams};
use asid_readings::SignalSet;
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

use super::observation::Observer;

/// Name of the random stream for unknowns, start poses and the trackers' noise.
const STREAM: &str = "fisher environment";

/// A batch of Fisher exploration episodes that step together.
pub struct FisherEnvironment<'a> {
    problem: &'a Problem<'a>,
    batch: FisherBatch<'a>,
    observer: Observer,
    signals: SignalSet,
    rng: Rng,
    step: usize,
    readings: Vec<f64>,
    /// Whether each episode has diverged; it then waits until the horizon, when all restart.
    ended: Vec<bool>,
}

impl<'a> FisherEnvironment<'a> {
    /// Creates `episodes` environments; unknowns and start poses are drawn anew for each episode.
    ///
    /// # Errors
    /// As [`FisherBatch::new`].
    pub fn new(
        problem: &'a Problem<'a>,
        settings: &FisherSettings,
        episodes: usize,
    ) -> Result<Self> {
        let batch = FisherBatch::new(problem, settings, episodes)?;
        Ok(Self {
            readings: vec![0.0; episodes * batch.width()],
            ended: vec![false; episodes],
            rng: problem.streams.stream(STREAM),
            observer: Observer::new(problem)?,
            signals: SignalSet::new(problem.model.layout(), problem.signals)?,
            batch,
            problem,
            step: 0,
        })
    }

    /// Draws all further random numbers from these streams, so that what follows is reproducible.
    pub fn reseed(&mut self, streams: &Streams) {
        self.rng = streams.stream(STREAM);
    }

    /// Starts one episode in each environment, at the given unknowns and start poses.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn begin_at(
        &mut self,
        theta: &[f64],
        starts: &[f64],
        observation: &mut [f64],
    ) -> Result<()> {
        self.step = 0;
        self.ended.fill(false);
        let mut readings = std::mem::take(&mut self.readings);
        let begun = self.batch.begin(theta, starts, &mut readings);
        self.readings = readings;
        begun?;
        self.observe(observation);
        Ok(())
    }

    /// The episodes with their information.
    #[must_use]
    pub fn batch(&self) -> &FisherBatch<'a> {
        &self.batch
    }

    /// The observer that makes the environments' observations.
    #[must_use]
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    fn observe(&mut self, observation: &mut [f64]) {
        let width = self.batch.width();
        let share = self.step as f64 / self.problem.task.exploration().horizon as f64;
        let mut noisy = vec![0.0; width];
        let tracked = self.signals.width();
        let rows = observation.chunks_exact_mut(self.observer.observation_len());
        for (e, row) in rows.enumerate() {
            noisy.copy_from_slice(&self.readings[e * width..(e + 1) * width]);
            self.signals.add_noise(&mut noisy[..tracked], || {
                StandardNormal.sample(&mut self.rng)
            });
            let std = self.batch.information()[e].expected_std();
            self.observer.observe(&noisy, share, &std, row);
        }
    }
}

impl BatchEnvironment for FisherEnvironment<'_> {
    fn batch_size(&self) -> usize {
        self.batch.episodes()
    }

    fn observation_len(&self) -> usize {
        self.observer.observation_len()
    }

    fn action_len(&self) -> usize {
        self.problem.task.exploration().action.len()
    }

    fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
        let n = self.batch.episodes();
        let protocol = self.problem.task.exploration();
        let mut theta = Vec::new();
        let mut starts = Vec::new();
        for _ in 0..n {
            for p in self.problem.parameters {
                theta.push(p.sample(&mut self.rng));
            }
            for c in &protocol.start {
                starts.push(c.at(self.rng.random()));
            }
        }
        self.begin_at(&theta, &starts, observation)
    }

    fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
        let protocol = self.problem.task.exploration();
        let a = protocol.action.len();
        let scaled: Vec<f64> = actions
            .iter()
            .enumerate()
            .map(|(i, u)| protocol.action[i % a].at((u.clamp(-1.0, 1.0) + 1.0) / 2.0))
            .collect();
        self.batch
            .step(&scaled, &mut self.readings, &mut transition.reward)?;
        self.step += 1;
        let over = self.step == protocol.horizon;
        self.observe(&mut transition.final_observation);
        for (ended, alive) in self.ended.iter_mut().zip(self.batch.alive()) {
            *ended |= !alive;
        }
        // The horizon is part of the task and the time is observed: reaching it terminates the
        // episode and does not truncate it. An episode that diverged earns 0 until then.
        transition.terminated.fill(over);
        for (reward, ended) in transition.reward.iter_mut().zip(&self.ended) {
            *reward = if *ended { 0.0 } else { *reward };
        }
        transition.truncated.fill(false);
        if over {
            return self.reset(&mut transition.observation);
        }
        transition
            .observation
            .copy_from_slice(&transition.final_observation);
        Ok(())
    }
}
