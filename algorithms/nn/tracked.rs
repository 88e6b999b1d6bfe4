//! Exploration episodes as a batch of environments, each with its own observer.

use asid_core::environment::{BatchEnvironment, Transition};
use asid_core::{Problem, Result};
use asid_learned::EpisodeBatch;
use asid_learned::file::ActionEntry;
use asid_learned::play::{Observe, actions};

/// Reward of control steps; `S` makes the observations.
pub trait Pay<S> {
    /// Called when a new episode begins in environment `e` with this reading.
    fn begin(&mut self, e: usize, sight: &S, reading: &[f64], theta: &[f64]);

    /// Reward of a control step that ended with this reading.
    fn reward(&mut self, e: usize, sight: &S, reading: &[f64], theta: &[f64]) -> f64;

    /// Called when all episodes have ended; `theta` is `episodes x unknowns`.
    ///
    /// # Errors
    /// When learning from the episodes fails.
    fn ended(&mut self, _sights: &mut [S], _theta: &[f64]) -> Result<()> {
        Ok(())
    }
}

/// Environments whose episodes begin and end together.
pub struct TrackedEnvironment<'a, S, P> {
    batch: EpisodeBatch<'a>,
    sights: Vec<S>,
    pub pay: P,
    actions: Vec<ActionEntry>,
    horizon: usize,
    unknowns: usize,
    observation_len: usize,
}

impl<'a, S: Observe, P: Pay<S>> TrackedEnvironment<'a, S, P> {
    /// One environment for each sight, with observations of `observation_len` entries.
    ///
    /// `stream` names the random stream of truths, starts and noise.
    ///
    /// # Errors
    /// As [`EpisodeBatch::new`].
    pub fn new(
        problem: &'a Problem<'a>,
        sights: Vec<S>,
        observation_len: usize,
        pay: P,
        stream: &str,
    ) -> Result<Self> {
        let rng = problem.streams.stream(stream);
        Ok(Self {
            batch: EpisodeBatch::new(problem, sights.len(), rng)?,
            sights,
            pay,
            actions: actions(problem),
            horizon: problem.task.exploration().horizon,
            unknowns: problem.parameters.len(),
            observation_len,
        })
    }

    fn observe(&mut self, observation: &mut [f64]) -> Result<()> {
        let step = self.batch.steps();
        let rows = observation.chunks_exact_mut(self.observation_len);
        for (e, (sight, row)) in self.sights.iter_mut().zip(rows).enumerate() {
            sight.observe(step, self.batch.reading(e), row)?;
        }
        Ok(())
    }

    fn theta(&self, e: usize) -> &[f64] {
        &self.batch.theta()[e * self.unknowns..][..self.unknowns]
    }
}

impl<S: Observe, P: Pay<S>> BatchEnvironment for TrackedEnvironment<'_, S, P> {
    fn batch_size(&self) -> usize {
        self.batch.episodes()
    }

    fn observation_len(&self) -> usize {
        self.observation_len
    }

    fn action_len(&self) -> usize {
        self.actions.len()
    }

    fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
        self.batch.begin()?;
        self.observe(observation)?;
        for e in 0..self.batch.episodes() {
            let theta = self.theta(e).to_vec();
            let reading = self.batch.reading(e);
            self.pay.begin(e, &self.sights[e], reading, &theta);
        }
        Ok(())
    }

    fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
        let entries = self.actions.iter().cycle();
        let scaled: Vec<f64> = actions
            .iter()
            .zip(entries)
            .map(|(u, entry)| entry.span(u.clamp(-1.0, 1.0)))
            .collect();
        self.batch.step(&scaled)?;
        self.observe(&mut transition.final_observation)?;
        for e in 0..self.batch.episodes() {
            let theta = self.theta(e).to_vec();
            let reading = self.batch.reading(e);
            let reward = self.pay.reward(e, &self.sights[e], reading, &theta);
            // A diverged episode earns nothing more.
            transition.reward[e] = if reward.is_finite() { reward } else { 0.0 };
        }
        // The horizon is part of the task and the time is observed: reaching it terminates the
        // episode and does not truncate it.
        let over = self.batch.steps() == self.horizon;
        transition.terminated.fill(over);
        transition.truncated.fill(false);
        if over {
            self.pay.ended(&mut self.sights, self.batch.theta())?;
            return self.reset(&mut transition.observation);
        }
        transition
            .observation
            .copy_from_slice(&transition.final_observation);
        Ok(())
    }
}

/// Zero reward, for learners that compute their own from the observations.
pub struct Nothing;

impl<S> Pay<S> for Nothing {
    fn begin(&mut self, _: usize, _: &S, _: &[f64], _: &[f64]) {}

    fn reward(&mut self, _: usize, _: &S, _: &[f64], _: &[f64]) -> f64 {
        0.0
    }
}
