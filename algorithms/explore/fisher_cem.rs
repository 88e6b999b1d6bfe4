//! Planner without a network: the cross-entropy method over open-loop action sequences, for the
//! Fisher objective.
//!
//! It plans when the episode begins, for the start pose that the first reading shows. Each
//! candidate is simulated at several values of the unknowns, drawn from the prior, and scored by
//! its mean return. These draws differ between iterations, so the best candidates of all iterations
//! are compared once more at common draws.

use crate::fisher::{FisherBatch, FisherSettings};
use asid_core::explore::{CurvePoint, Explored, Explorer};
use asid_core::registry;
use asid_core::rng::Rng;
use asid_core::{Error, Posterior, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::open_loop::{OpenLoop, Planned, Planner};
use crate::optimise::{CemSettings, require};

/// Settings of the planner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FisherCem {
    /// Refits of the distribution.
    pub iterations: usize,
    /// Action sequences per refit.
    pub population: usize,
    /// Values of the unknowns at which each sequence is simulated.
    pub prior_samples: usize,
    /// Control steps that share an action; more of them leave fewer numbers to search for.
    pub hold: usize,
    /// Initial standard deviation of an action, as a fraction of half its range.
    pub std: f64,
    /// Search distribution.
    pub cem: CemSettings,
    /// Objective.
    pub fisher: FisherSettings,
}

impl Default for FisherCem {
    fn default() -> Self {
        Self {
            iterations: 5,
            population: 32,
            prior_samples: 2,
            hold: 5,
            std: 0.7,
            cem: CemSettings {
                elite_fraction: 0.2,
                ..CemSettings::default()
            },
            fisher: FisherSettings {
                nuisance: false,
                ..FisherSettings::default()
            },
        }
    }
}

asid_core::register!(ExplorerEntry {
    name: "fisher-cem",
    about: "Fisher information, open-loop plans by the cross-entropy method",
    defaults: registry::defaults::<FisherCem>,
    meanings: registry::meanings::<FisherCem>,
    make: |s| {
        let explorer: FisherCem = registry::settings("explorer", s)?;
        explorer.check()?;
        Ok(Box::new(explorer))
    },
});

impl FisherCem {
    fn check(&self) -> Result<()> {
        for (key, value) in [
            ("iterations", self.iterations),
            ("population", self.population),
            ("prior_samples", self.prior_samples),
            ("hold", self.hold),
        ] {
            if value == 0 {
                return Err(Error::Config {
                    key: format!("explorer.{key}"),
                    message: "must be at least 1".into(),
                });
            }
        }
        require(self.std > 0.0, "explorer.std", self.std, "above 0")?;
        self.cem.check("explorer.cem")?;
        self.fisher.check()
    }

    fn open_loop(&self) -> OpenLoop {
        OpenLoop {
            hold: self.hold,
            std: self.std,
        }
    }
}

impl Planner for FisherCem {
    fn plan(&self, problem: &Problem<'_>, start: &[f64]) -> Result<(Vec<f64>, Vec<CurvePoint>)> {
        let protocol = problem.task.exploration();
        let mut cem = self.open_loop().search(protocol, self.cem.clone());
        let mut rng = problem.streams.stream("fisher-cem");
        let mut trials = Trials::new(self, problem, start)?;
        let mut curve = Vec::new();
        // The best of every iteration, compared at common draws at the end.
        let mut finalists: Vec<Vec<f64>> = Vec::new();
        let kept = (self.population / (FINAL * self.iterations)).max(1);
        problem.progress.begin(
            "explore: planning",
            ((self.iterations + 1) * protocol.horizon) as u64,
        );
        for iteration in 0..self.iterations {
            let candidates = cem.ask(self.population, &mut rng);
            let returns = trials.returns(&candidates, self.prior_samples, &mut rng)?;
            let costs: Vec<f64> = returns.iter().map(|r| -r).collect();
            cem.tell(&candidates, &costs);
            let mut order: Vec<usize> = (0..returns.len()).collect();
            order.retain(|&i| returns[i].is_finite());
            order.sort_by(|&i, &j| returns[j].total_cmp(&returns[i]));
            finalists.extend(order.iter().take(kept).map(|&i| candidates[i].clone()));
            curve.push(CurvePoint::of(iteration + 1, &returns));
        }
        finalists.push(cem.mean().to_vec());
        let finalists = latest(finalists, self.population);
        let samples = self.population * self.prior_samples / finalists.len();
        let returns = trials.returns(&finalists, samples.max(1), &mut rng)?;
        problem.progress.end();
        let best = (0..returns.len())
            .filter(|&i| returns[i].is_finite())
            .max_by(|&i, &j| returns[i].total_cmp(&returns[j]))
            .ok_or_else(|| Error::Failed("every exploration episode diverged".into()))?;
        Ok((trials.actions(&finalists[best]), curve))
    }
}

/// The final comparison simulates each plan at about this many times the search's prior samples; it
/// has correspondingly fewer plans.
const FINAL: usize = 4;

/// The last of some plans, `most` of them: the search improves from one iteration to the next.
fn latest(mut plans: Vec<Vec<f64>>, most: usize) -> Vec<Vec<f64>> {
    plans.drain(..plans.len().saturating_sub(most));
    plans
}

/// Simulates candidate plans.
struct Trials<'a> {
    explorer: &'a FisherCem,
    problem: &'a Problem<'a>,
    start: &'a [f64],
    batch: FisherBatch<'a>,
}

impl<'a> Trials<'a> {
    fn new(explorer: &'a FisherCem, problem: &'a Problem<'a>, start: &'a [f64]) -> Result<Self> {
        let episodes = explorer.population * explorer.prior_samples;
        Ok(Self {
            batch: FisherBatch::new(problem, &explorer.fisher, episodes)?,
            explorer,
            problem,
            start,
        })
    }

    fn actions(&self, candidate: &[f64]) -> Vec<f64> {
        let protocol = self.problem.task.exploration();
        self.explorer.open_loop().actions(protocol, candidate)
    }

    /// Mean return of each candidate over `samples` draws of the unknowns, the same draws for all.
    ///
    /// NaN where a simulation diverged: such a plan is not played on a machine, whatever it earned
    /// before.
    fn returns(
        &mut self,
        candidates: &[Vec<f64>],
        samples: usize,
        rng: &mut Rng,
    ) -> Result<Vec<f64>> {
        let protocol = self.problem.task.exploration();
        let (a, e) = (protocol.action.len(), self.batch.episodes());
        let plans: Vec<Vec<f64>> = candidates.iter().map(|c| self.actions(c)).collect();
        let prior = Posterior::prior(self.problem.parameters, samples, rng);
        // Surplus episodes repeat the last candidate and do not count.
        let of = |i: usize| (i / samples).min(candidates.len() - 1);
        let theta: Vec<f64> = (0..e)
            .flat_map(|i| prior.samples[i % samples].iter().copied())
            .collect();
        let mut readings = vec![0.0; e * self.batch.width()];
        let mut reward = vec![0.0; e];
        let mut actions = vec![0.0; e * a];
        self.batch
            .begin(&theta, &self.start.repeat(e), &mut readings)?;
        let mut returns = vec![0.0; e];
        for h in 0..protocol.horizon {
            for (i, row) in actions.chunks_exact_mut(a).enumerate() {
                row.copy_from_slice(&plans[of(i)][h * a..(h + 1) * a]);
            }
            self.batch.step(&actions, &mut readings, &mut reward)?;
            for (sum, r) in returns.iter_mut().zip(&reward) {
                *sum += r;
            }
            self.problem.progress.advance(1);
        }
        for (sum, alive) in returns.iter_mut().zip(self.batch.alive()) {
            *sum = if *alive { *sum } else { f64::NAN };
        }
        Ok(returns[..candidates.len() * samples]
            .chunks_exact(samples)
            .map(|c| c.iter().sum::<f64>() / samples as f64)
            .collect())
    }
}

impl Explorer for FisherCem {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let objective = self.fisher.describe();
        Planned::explored(self, problem, start, objective)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: with more iterations than plans in the final comparison, the last iterations and
    /// the mean of the search are never compared.
    #[test]
    fn the_final_comparison_has_the_latest_plans() {
        let plans: Vec<Vec<f64>> = (0..5).map(|i| vec![f64::from(i)]).collect();
        assert_eq!(latest(plans.clone(), 2), [[3.0], [4.0]]);
        assert_eq!(latest(plans.clone(), 8), plans);
    }
}
