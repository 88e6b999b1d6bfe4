//! Solves for the task action by proximal policy optimisation: a policy that responds to the
//! observed start pose.
//!
//! An attempt is one action, so an episode has one step (a contextual bandit). The observation is
//! the start pose as the trackers show it; the reward is minus the task's cost. Every episode draws
//! the unknowns from the belief, the start pose from its range, and the readings' noise anew. With
//! the prior as the belief this is domain randomisation.

use std::ops::ControlFlow;

use asid_algorithms::solve::{Attempts, Situations};
use asid_core::environment::{BatchEnvironment, Transition};
use asid_core::registry;
use asid_core::rng::Rng;
use asid_core::solve::{Solved, TaskPolicy, TaskSolver, Trial};
use asid_core::task::Coordinate;
use asid_core::{Error, Posterior, Problem, Result};
use rand::Rng as _;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::evaluation::mean_and_std;
use crate::ppo::{PpoProgress, train};
use asid_learned::Policy;
use asid_learned::PpoConfig;

/// Settings of the solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PpoSolver {
    /// Attempts that are simulated at once.
    pub environments: usize,
    /// The learner. Its `reward_scale` multiplies an automatic scale that gives the costs of
    /// uniformly random first actions a standard deviation of 1.
    pub ppo: PpoConfig,
}

impl Default for PpoSolver {
    fn default() -> Self {
        Self {
            environments: 64,
            ppo: PpoConfig {
                total_steps: 2048,
                n_steps: 128,
                minibatch: 32,
                learning_rate: 3e-3,
                anneal_learning_rate: true,
                gamma: 1.0,
                hidden: vec![32, 32],
                initial_log_std: -0.7,
                evaluation_episodes: 0,
                ..PpoConfig::default()
            },
        }
    }
}

asid_core::register!(SolverEntry {
    name: "ppo",
    about: "policy over the start pose, trained by proximal policy optimisation",
    defaults: registry::defaults::<PpoSolver>,
    meanings: registry::meanings::<PpoSolver>,
    make: |s| {
        let solver: PpoSolver = registry::settings("solver", s)?;
        if solver.environments < 2 {
            return Err(Error::Config {
                key: "solver.environments".into(),
                message: "must be at least 2".into(),
            });
        }
        solver.ppo.validate("solver")?;
        Ok(Box::new(solver))
    },
});

impl TaskSolver for PpoSolver {
    fn solve<'a>(&'a self, problem: &'a Problem<'a>, belief: &Posterior) -> Result<Solved<'a>> {
        let protocol = problem.task.downstream();
        let mut rng = problem.streams.stream("ppo solver");
        let seed = rng.random();
        let mut bandit = Bandit {
            attempts: Attempts::new(problem, belief, self.environments)?,
            situations: Situations::default(),
            action: &protocol.action,
            width: protocol.start.len(),
            size: self.environments,
            rng,
            trials: Vec::new(),
            batches_an_update: self.ppo.n_steps.div_ceil(self.environments),
            batches: 0,
        };
        let mut config = self.ppo.clone();
        config.reward_scale /= bandit.spread()?;
        let mut told = 0;
        let total = config.total_steps as u64;
        problem.progress.begin("solve: training", total);
        let trained = train(&mut bandit, &config, seed, &mut |p: &PpoProgress| {
            problem.progress.advance((p.env_steps - told) as u64);
            told = p.env_steps;
            ControlFlow::Continue(())
        });
        problem.progress.end();
        let policy = Learnt {
            network: trained?.policy,
            action: bandit.action,
        };
        Ok(Solved {
            policy: Box::new(policy),
            trials: bandit.trials,
        })
    }
}

/// A trained network as a task policy.
struct Learnt<'a> {
    network: Policy,
    action: &'a [Coordinate],
}

impl TaskPolicy for Learnt<'_> {
    fn act(&mut self, start: &[f64], action: &mut [f64]) -> Result<()> {
        self.network.act(start, action)?;
        span(self.action, action);
        Ok(())
    }
}

/// Maps entries in `[-1, 1]`, row after row, to the ranges of an action.
fn span(coordinates: &[Coordinate], rows: &mut [f64]) {
    for (a, c) in rows.iter_mut().zip(coordinates.iter().cycle()) {
        *a = c.at((*a + 1.0) / 2.0);
    }
}

/// Attempts as one-step episodes.
struct Bandit<'a> {
    attempts: Attempts<'a>,
    /// The situations that await an action.
    situations: Situations,
    action: &'a [Coordinate],
    /// Number of entries of a start pose.
    width: usize,
    /// Number of simultaneous attempts.
    size: usize,
    rng: Rng,
    trials: Vec<Trial>,
    batches_an_update: usize,
    batches: usize,
}

impl Bandit<'_> {
    /// Standard deviation of the costs of uniformly random actions; 1 where all costs are equal.
    fn spread(&mut self) -> Result<f64> {
        self.situations = self.attempts.draw(self.size, &mut self.rng)?;
        let uniform: Vec<f64> = (0..self.size * self.action.len())
            .map(|_| self.rng.random_range(-1.0..=1.0))
            .collect();
        let (_, std) = mean_and_std(&self.attempt(&uniform)?);
        Ok(if std > 0.0 { std } else { 1.0 })
    }

    /// Costs of actions in `[-1, 1]` in the situations that await an action.
    fn attempt(&mut self, actions: &[f64]) -> Result<Vec<f64>> {
        let mut scaled = actions.to_vec();
        span(self.action, &mut scaled);
        let rows: Vec<&[f64]> = scaled.chunks_exact(self.action.len()).collect();
        let mut costs = self.attempts.costs(&self.situations, &rows)?;
        // A diverged attempt costs as much as the worst of its batch.
        let finite = costs.iter().copied().filter(|c| c.is_finite());
        let worst = finite.fold(f64::NEG_INFINITY, f64::max);
        if worst == f64::NEG_INFINITY {
            return Err(Error::Failed("every attempt at the task diverged".into()));
        }
        for cost in costs.iter_mut().filter(|c| !c.is_finite()) {
            *cost = worst;
        }
        let iteration = self.batches.saturating_sub(1) / self.batches_an_update;
        let tried = rows.into_iter().zip(&costs);
        self.trials.extend(tried.map(|(action, &cost)| Trial {
            iteration,
            action: action.to_vec(),
            cost,
        }));
        self.batches += 1;
        Ok(costs)
    }
}

impl BatchEnvironment for Bandit<'_> {
    fn batch_size(&self) -> usize {
        self.size
    }

    fn observation_len(&self) -> usize {
        self.width
    }

    fn action_len(&self) -> usize {
        self.action.len()
    }

    fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
        self.situations = self.attempts.draw(self.size, &mut self.rng)?;
        let seen = self.situations.believed.iter().flatten();
        for (o, x) in observation.iter_mut().zip(seen) {
            *o = *x;
        }
        Ok(())
    }

    fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
        let costs = self.attempt(actions)?;
        for (reward, cost) in transition.reward.iter_mut().zip(costs) {
            *reward = -cost;
        }
        transition.terminated.fill(true);
        transition.truncated.fill(false);
        // There is nothing to observe at the end of an episode; the next one begins.
        transition
            .final_observation
            .copy_from_slice(&transition.observation);
        self.reset(&mut transition.observation)
    }
}
