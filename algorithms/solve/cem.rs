//! Finds the task action by the cross-entropy method: it minimises the expected cost over samples
//! of the belief.
//!
//! With the prior as the belief this is domain randomisation.

use asid_core::registry;
use asid_core::rng::Rng;
use asid_core::solve::{Solved, TaskPolicy, TaskSolver, Trial};
use asid_core::{Error, Posterior, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Attempts;
use crate::optimise::search::rank;
use crate::optimise::{Cem, CemSettings};

/// Settings of the solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CemSolver {
    /// Refits of the search distribution.
    pub iterations: usize,
    /// Actions per refit.
    pub population: usize,
    /// Samples of the belief at which each action is tried.
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
    meanings: registry::meanings::<CemSolver>,
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
        let samples = self.belief_samples;
        let mut attempts = Attempts::new(problem, belief, samples * self.population.max(2))?;
        let low: Vec<f64> = protocol.action.iter().map(|c| c.range[0]).collect();
        let high: Vec<f64> = protocol.action.iter().map(|c| c.range[1]).collect();
        let center: Vec<f64> = protocol.action.iter().map(|c| c.center()).collect();
        let std: Vec<f64> = protocol.action.iter().map(|c| c.std()).collect();
        let mut cem = Cem::new(self.cem.clone(), &center, &std, &low, &high);
        let mut trials: Vec<Trial> = Vec::new();
        // The best actions so far stay in the set that is refitted to: where most of the range
        // fails, the few successful actions must survive the next refit.
        let mut pool: Vec<(Vec<f64>, f64)> = Vec::new();
        problem.progress.begin("solve", self.iterations as u64);
        for iteration in 0..self.iterations {
            let actions = cem.ask(self.population, &mut rng);
            // New draws for each refit, the same for all its actions.
            let situations = attempts.draw(samples, &mut rng)?;
            let costs = attempts.mean_costs(&situations, &actions)?;
            pool.extend(actions.iter().cloned().zip(costs.iter().copied()));
            keep_best(&mut pool, self.population);
            let (best, best_costs): (Vec<_>, Vec<_>) = pool.iter().cloned().unzip();
            cem.tell(&best, &best_costs);
            trials.extend(actions.into_iter().zip(costs).map(|(action, cost)| Trial {
                iteration,
                action,
                cost,
            }));
            problem.progress.advance(1);
        }
        let finalists: Vec<_> = pool.into_iter().map(|(action, _)| action).collect();
        let action = settled(finalists, &mut attempts, samples, &mut rng)?;
        problem.progress.end();
        Ok(Solved {
            policy: Box::new(FixedAction(action)),
            trials,
        })
    }
}

/// Keeps the `most` actions with the lowest costs, lowest first; failures come last.
fn keep_best(pool: &mut Vec<(Vec<f64>, f64)>, most: usize) {
    pool.sort_by(|a, b| rank(a.1).total_cmp(&rank(b.1)));
    pool.truncate(most);
}

/// Share of the spread between best and median cost within which actions count as equally good.
const TIE: f64 = 0.02;

/// The midpoint of the best actions, or the best of them if the midpoint does worse.
///
/// Where a whole interval of actions does equally well, its middle is the safest. Each refit has
/// its own situations, so the best cost over many refits is partly luck. The better half of the
/// finalists is therefore compared again at common situations, twice as many; only these costs
/// count.
fn settled(
    mut finalists: Vec<Vec<f64>>,
    attempts: &mut Attempts<'_>,
    samples: usize,
    rng: &mut Rng,
) -> Result<Vec<f64>> {
    finalists.truncate((finalists.len() / 2).max(1));
    let situations = attempts.draw(2 * samples, rng)?;
    let costs = attempts.mean_costs(&situations, &finalists)?;
    let mut order: Vec<(f64, &[f64])> = costs
        .iter()
        .zip(&finalists)
        .filter(|(cost, _)| cost.is_finite())
        .map(|(cost, action)| (*cost, action.as_slice()))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(&(best_cost, best)), Some(&(median, _))) =
        (order.first(), order.get(order.len() / 2))
    else {
        return Err(Error::Failed("every attempt at the task diverged".into()));
    };
    let limit = best_cost + TIE * (median - best_cost);
    let ties = || order.iter().take_while(|(cost, _)| *cost <= limit);
    let middle: Vec<f64> = (0..best.len())
        .map(|i| {
            // Half way between the ends, however the draws are distributed between them.
            let values = ties().map(|(_, action)| action[i]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            let high = values.fold(f64::NEG_INFINITY, f64::max);
            0.5 * (low + high)
        })
        .collect();
    let tried = attempts.mean_costs(&situations, std::slice::from_ref(&middle))?;
    Ok(if tried[0] <= limit {
        middle
    } else {
        best.to_vec()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: of a task whose cost is minus a height, the solver kept the attempts that diverged.
    /// Cause: minus NaN sorts before every number.
    #[test]
    fn an_attempt_that_diverged_is_never_the_best() {
        let costs = [-f64::NAN, 0.5, f64::INFINITY, -2.0, f64::NAN];
        let mut pool: Vec<(Vec<f64>, f64)> = costs.iter().map(|c| (vec![*c], *c)).collect();
        keep_best(&mut pool, 2);
        assert_eq!(pool, [(vec![-2.0], -2.0), (vec![0.5], 0.5)]);
    }
}
