//! The task action by the cross-entropy method: minimise the expected cost over
//! samples of the belief. With the prior as the belief this is domain randomisation.

use asid_core::problem::Batch;
use asid_core::registry;
use asid_core::rng::Rng;
use asid_core::signal::SignalSet;
use asid_core::solve::{Solved, TaskPolicy, TaskSolver, Trial};
use asid_core::{Control, Error, Posterior, Problem, Recording, Result, Rollout};
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::optimise::{Cem, CemSettings};

/// Settings of the solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CemSolver {
    /// Refits of the distribution.
    pub iterations: usize,
    /// Actions a refit.
    pub population: usize,
    /// Samples of the belief that each action is tried at.
    pub belief_samples: usize,
    /// Search distribution.
    pub cem: CemSettings,
}

impl Default for CemSolver {
    fn default() -> Self {
        Self {
            iterations: 4,
            population: 12,
            belief_samples: 4,
            cem: CemSettings {
                elite_fraction: 0.25,
                ..CemSettings::default()
            },
        }
    }
}

asid_core::register!(SolverEntry {
    name: "cem",
    about: "cross-entropy method over the task's action",
    defaults: registry::defaults::<CemSolver>,
    make: |s| {
        let solver: CemSolver = registry::settings("solver", s)?;
        for (key, value) in [
            ("iterations", solver.iterations),
            ("population", solver.population),
            ("belief_samples", solver.belief_samples),
        ] {
            if value == 0 {
                return Err(Error::Config {
                    key: format!("solver.{key}"),
                    message: "must be at least 1".into(),
                });
            }
        }
        solver.cem.check("solver.cem")?;
        Ok(Box::new(solver))
    },
});

struct FixedAction(Vec<f64>);

impl TaskPolicy for FixedAction {
    fn act(&mut self, _start: &[f64], action: &mut [f64]) -> Result<()> {
        action.copy_from_slice(&self.0);
        Ok(())
    }
}

impl TaskSolver for CemSolver {
    fn solve<'a>(&'a self, problem: &'a Problem<'a>, belief: &Posterior) -> Result<Solved<'a>> {
        let protocol = problem.task.downstream();
        let mut rng = problem.streams.stream("solve");
        let mut attempts = Attempts::new(problem, belief, self.population, self.belief_samples)?;
        let low: Vec<f64> = protocol.action.iter().map(|c| c.range[0]).collect();
        let high: Vec<f64> = protocol.action.iter().map(|c| c.range[1]).collect();
        let center: Vec<f64> = protocol.action.iter().map(|c| c.center()).collect();
        let std: Vec<f64> = protocol.action.iter().map(|c| c.std()).collect();
        let mut cem = Cem::new(self.cem.clone(), &center, &std, &low, &high);
        let mut trials: Vec<Trial> = Vec::new();
        // The best actions so far stay among those that are refitted to: where most of the
        // range fails, a lucky few must not be lost to the next refit.
        let mut pool: Vec<(Vec<f64>, f64)> = Vec::new();
        problem.progress.begin("solve", self.iterations as u64);
        for iteration in 0..self.iterations {
            let actions = cem.ask(self.population, &mut rng);
            let costs = attempts.costs(&actions, &mut rng)?;
            pool.extend(actions.iter().cloned().zip(costs.iter().copied()));
            pool.sort_by(|a, b| a.1.total_cmp(&b.1));
            pool.truncate(self.population);
            let (best, best_costs): (Vec<_>, Vec<_>) = pool.iter().cloned().unzip();
            cem.tell(&best, &best_costs);
            trials.extend(actions.into_iter().zip(costs).map(|(action, cost)| Trial {
                iteration,
                action,
                cost,
            }));
            problem.progress.advance(1);
        }
        let action = settled(&trials, &mut attempts, &mut rng)?;
        problem.progress.end();
        Ok(Solved {
            policy: Box::new(FixedAction(action)),
            trials,
        })
    }
}

/// Trials within this share of the spread between best and median cost count as equally good.
const TIE: f64 = 0.02;

/// The middle of the best actions: where a whole stretch of actions does equally well, its
/// middle is the safest. Should that middle do worse than the best trial, the best trial it is.
fn settled(trials: &[Trial], attempts: &mut Attempts<'_>, rng: &mut Rng) -> Result<Vec<f64>> {
    let mut order: Vec<&Trial> = trials.iter().filter(|t| t.cost.is_finite()).collect();
    order.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let (Some(best), Some(median)) = (order.first(), order.get(order.len() / 2)) else {
        return Err(Error::Failed("every attempt at the task diverged".into()));
    };
    let limit = best.cost + TIE * (median.cost - best.cost);
    let ties: Vec<&Trial> = order
        .iter()
        .copied()
        .take_while(|t| t.cost <= limit)
        .collect();
    let middle: Vec<f64> = (0..best.action.len())
        .map(|i| {
            // Half way between the ends, however the draws are spread between them.
            let values = ties.iter().map(|t| t.action[i]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            let high = values.fold(f64::NEG_INFINITY, f64::max);
            0.5 * (low + high)
        })
        .collect();
    let tried = attempts.costs(&[middle.clone(), best.action.clone()], rng)?;
    Ok(if tried[0] <= tried[1].max(limit) {
        middle
    } else {
        best.action.clone()
    })
}

/// Attempts at the task in the simulator, over samples of the belief.
struct Attempts<'a> {
    problem: &'a Problem<'a>,
    belief: &'a Posterior,
    samples: usize,
    batch: Batch,
    signals: SignalSet,
    tracked: Recording,
    recording: Recording,
    substeps: usize,
}

impl<'a> Attempts<'a> {
    fn new(
        problem: &'a Problem<'a>,
        belief: &'a Posterior,
        population: usize,
        samples: usize,
    ) -> Result<Self> {
        let protocol = problem.task.downstream();
        let layout = problem.model.layout();
        let names: Vec<&str> = problem.signals.iter().map(|s| &*s.sensor).collect();
        Ok(Self {
            batch: problem.batch(samples * population.max(2))?,
            signals: SignalSet::new(layout, problem.signals)?,
            tracked: layout.recording(&names)?,
            recording: layout.recording(&protocol.channels)?,
            substeps: problem.substeps(protocol.frame_period)?,
            problem,
            belief,
            samples,
        })
    }

    /// Mean cost of each action over fresh samples of the unknowns, of the start pose and of
    /// what the trackers show of it; the same for all actions.
    fn costs(&mut self, actions: &[Vec<f64>], rng: &mut Rng) -> Result<Vec<f64>> {
        let (problem, samples) = (self.problem, self.samples);
        let protocol = problem.task.downstream();
        let n = samples * actions.len();
        let sims: Vec<usize> = (0..n).collect();
        let theta: Vec<f64> = self.belief.resample(samples, rng).concat();
        let starts: Vec<f64> = (0..samples)
            .flat_map(|_| {
                protocol
                    .start
                    .iter()
                    .map(|c| c.at(rng.random()))
                    .collect::<Vec<_>>()
            })
            .collect();
        self.batch
            .set_parameters(&sims, &theta.repeat(actions.len()))?;
        self.batch
            .place(problem.task, &sims, &starts.repeat(actions.len()))?;
        let width = self.tracked.width();
        let mut seen = vec![0.0; samples * width];
        self.batch
            .simulator
            .read(&sims[..samples], &self.tracked, &mut seen)?;
        let believed: Vec<Vec<f64>> = seen
            .chunks_exact_mut(width)
            .map(|reading| {
                self.signals
                    .add_noise(reading, || StandardNormal.sample(rng));
                problem.task.locate(reading)
            })
            .collect();
        let nu = problem.model.layout().nu();
        let mut control = Vec::with_capacity(n * protocol.frames * nu);
        for action in actions {
            for start in &believed {
                control.extend(problem.task.attempt(start, action)?);
            }
        }
        let width = self.recording.width();
        let mut readings = vec![0.0; n * protocol.frames * width];
        let before = self.batch.simulator.steps_taken();
        let rollout = Rollout::new(
            &sims,
            protocol.frames,
            self.substeps,
            Control::PerSimulation(&control),
            &self.recording,
        );
        self.batch.simulator.rollout(&rollout, &mut readings)?;
        problem.count_physics(&self.batch, before);
        Ok(readings
            .chunks_exact(samples * protocol.frames * width)
            .map(|tried| {
                let costs = tried
                    .chunks_exact(protocol.frames * width)
                    .map(|r| problem.task.outcome(r).cost);
                costs.sum::<f64>() / samples as f64
            })
            .collect())
    }
}
