//! The task action by the cross-entropy method: minimise the expected cost over
//! samples of the belief. With the prior as the belief this is domain randomisation.

use asid_core::registry::{self, SolverEntry};
use asid_core::solve::{Solved, TaskPolicy, TaskSolver, Trial};
use asid_core::{Control, Error, Posterior, Problem, Result, Rollout};
use rand::Rng as _;
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

inventory::submit! {
    SolverEntry {
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
    }
}

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
        let layout = problem.model.layout();
        let recording = layout.recording(&protocol.channels)?;
        let substeps = problem.substeps(protocol.frame_period)?;
        let (samples, population) = (self.belief_samples, self.population);
        let n = samples * population;
        let mut batch = problem.batch(n)?;
        let sims: Vec<usize> = (0..n).collect();
        let mut rng = problem.streams.stream("solve");
        let low: Vec<f64> = protocol.action.iter().map(|c| c.range[0]).collect();
        let high: Vec<f64> = protocol.action.iter().map(|c| c.range[1]).collect();
        let center: Vec<f64> = protocol.action.iter().map(|c| c.center()).collect();
        let std: Vec<f64> = protocol.action.iter().map(|c| c.std()).collect();
        let mut cem = Cem::new(self.cem.clone(), &center, &std, &low, &high);
        let width = recording.width();
        let mut readings = vec![0.0; n * protocol.frames * width];
        let mut trials = Vec::new();
        problem.progress.begin("solve", self.iterations as u64);
        for iteration in 0..self.iterations {
            let actions = cem.ask(population, &mut rng);
            let thetas = belief.resample(samples, &mut rng);
            let starts: Vec<Vec<f64>> = (0..samples)
                .map(|_| protocol.start.iter().map(|c| c.at(rng.random())).collect())
                .collect();
            let theta: Vec<f64> = (0..population)
                .flat_map(|_| thetas.iter().flatten().copied())
                .collect();
            let start: Vec<f64> = (0..population)
                .flat_map(|_| starts.iter().flatten().copied())
                .collect();
            let mut control = Vec::with_capacity(n * protocol.frames * layout.nu());
            for action in &actions {
                for s in &starts {
                    control.extend(problem.task.attempt(s, action)?);
                }
            }
            batch.set_parameters(&sims, &theta)?;
            batch.place(problem.task, &sims, &start)?;
            let before = batch.simulator.steps_taken();
            let rollout = Rollout::new(
                &sims,
                protocol.frames,
                substeps,
                Control::PerSimulation(&control),
                &recording,
            );
            batch.simulator.rollout(&rollout, &mut readings)?;
            problem.count_physics(&batch, before);
            let costs: Vec<f64> = readings
                .chunks_exact(samples * protocol.frames * width)
                .map(|tried| {
                    tried
                        .chunks_exact(protocol.frames * width)
                        .map(|r| problem.task.outcome(r).cost)
                        .sum::<f64>()
                        / samples as f64
                })
                .collect();
            cem.tell(&actions, &costs);
            for (action, cost) in actions.into_iter().zip(costs) {
                trials.push(Trial {
                    iteration,
                    action,
                    cost,
                });
            }
            problem.progress.advance(1);
        }
        problem.progress.end();
        if cem.best().is_none() {
            return Err(Error::Failed("every attempt at the task diverged".into()));
        }
        Ok(Solved {
            policy: Box::new(FixedAction(cem.mean().to_vec())),
            trials,
        })
    }
}
