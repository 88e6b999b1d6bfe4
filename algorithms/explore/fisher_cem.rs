//! The Fisher objective with the cross-entropy method over open-loop action
//! sequences: the planner without a network.
//!
//! It plans when the episode begins, for the start pose that the first reading
//! shows. Every candidate is simulated at several values of the unknowns, drawn
//! from the prior, and judged by its mean return.

use asid_core::explore::{CurvePoint, Explored, Explorer, Policy};
use asid_core::fisher::{FisherBatch, FisherSettings};
use asid_core::registry::{self, ExplorerEntry};
use asid_core::{Error, Posterior, Problem, Result};
use serde::{Deserialize, Serialize};

use crate::optimise::{Cem, CemSettings, require};

/// Settings of the planner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FisherCem {
    /// Refits of the distribution.
    pub iterations: usize,
    /// Action sequences a refit.
    pub population: usize,
    /// Values of the unknowns that each sequence is tried at.
    pub prior_samples: usize,
    /// Control steps that share an action: fewer numbers to search for.
    pub hold: usize,
    /// First deviation of an action, as a fraction of half its range.
    pub std: f64,
    /// Search distribution.
    pub cem: CemSettings,
    /// Objective.
    pub fisher: FisherSettings,
}

impl Default for FisherCem {
    fn default() -> Self {
        Self {
            iterations: 6,
            population: 24,
            prior_samples: 2,
            hold: 2,
            std: 0.7,
            cem: CemSettings {
                elite_fraction: 0.2,
                ..CemSettings::default()
            },
            fisher: FisherSettings::default(),
        }
    }
}

inventory::submit! {
    ExplorerEntry {
        name: "fisher-cem",
        about: "Fisher information, open-loop plans by the cross-entropy method",
        defaults: registry::defaults::<FisherCem>,
        make: |s| {
            let explorer: FisherCem = registry::settings("explorer", s)?;
            explorer.check()?;
            Ok(Box::new(explorer))
        },
    }
}

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

    /// The best open-loop actions (`horizon x action`, in the task's units) for a
    /// start pose, and the mean return over the search.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn plan(
        &self,
        problem: &Problem<'_>,
        start: &[f64],
    ) -> Result<(Vec<f64>, Vec<CurvePoint>)> {
        let protocol = problem.task.exploration();
        let (a, horizon) = (protocol.action.len(), protocol.horizon);
        let knots = horizon.div_ceil(self.hold);
        let n = knots * a;
        let (low, high) = (vec![-1.0; n], vec![1.0; n]);
        let mut cem = Cem::new(
            self.cem.clone(),
            &vec![0.0; n],
            &vec![self.std; n],
            &low,
            &high,
        );
        let mut rng = problem.streams.stream("fisher-cem");
        let samples = self.prior_samples;
        let mut batch = FisherBatch::new(problem, &self.fisher, self.population * samples)?;
        let (e, width) = (batch.episodes(), batch.width());
        let starts = start.repeat(e);
        let mut readings = vec![0.0; e * width];
        let mut reward = vec![0.0; e];
        let mut actions = vec![0.0; e * a];
        let mut curve = Vec::new();
        problem
            .progress
            .begin("explore: planning", (self.iterations * horizon) as u64);
        for iteration in 0..self.iterations {
            let candidates = cem.ask(self.population, &mut rng);
            let prior = Posterior::prior(problem.parameters, samples, &mut rng);
            let theta: Vec<f64> = (0..self.population)
                .flat_map(|_| prior.samples.iter().flatten().copied())
                .collect();
            batch.begin(&theta, &starts, &mut readings)?;
            let mut returns = vec![0.0; e];
            for h in 0..horizon {
                for (i, row) in actions.chunks_exact_mut(a).enumerate() {
                    let knot = &candidates[i / samples][h / self.hold * a..][..a];
                    for ((x, u), c) in row.iter_mut().zip(knot).zip(&protocol.action) {
                        *x = c.at((u + 1.0) / 2.0);
                    }
                }
                batch.step(&actions, &mut readings, &mut reward)?;
                for (sum, r) in returns.iter_mut().zip(&reward) {
                    *sum += r;
                }
                problem.progress.advance(1);
            }
            let mean_returns: Vec<f64> = returns
                .chunks_exact(samples)
                .map(|c| c.iter().sum::<f64>() / samples as f64)
                .collect();
            let costs: Vec<f64> = mean_returns.iter().map(|r| -r).collect();
            cem.tell(&candidates, &costs);
            let mean = mean_returns.iter().sum::<f64>() / mean_returns.len() as f64;
            let variance = mean_returns.iter().map(|r| (r - mean).powi(2)).sum::<f64>()
                / mean_returns.len() as f64;
            curve.push(CurvePoint {
                x: (iteration + 1) as f64,
                mean,
                std: variance.sqrt(),
            });
        }
        problem.progress.end();
        let (best, _) = cem
            .best()
            .ok_or_else(|| Error::Failed("every exploration episode diverged".into()))?;
        let plan = (0..horizon)
            .flat_map(|h| {
                best[h / self.hold * a..][..a]
                    .iter()
                    .zip(&protocol.action)
                    .map(|(u, c)| c.at((u + 1.0) / 2.0))
                    .collect::<Vec<_>>()
            })
            .collect();
        Ok((plan, curve))
    }
}

/// A plan made for the start pose of the episode.
struct PlannedPolicy<'a> {
    explorer: &'a FisherCem,
    problem: &'a Problem<'a>,
    plan: Vec<f64>,
    curve: Vec<CurvePoint>,
    planned_for: Option<Vec<f64>>,
}

impl Policy for PlannedPolicy<'_> {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        if self.planned_for.is_none() {
            let start = self.problem.task.locate(reading);
            (self.plan, self.curve) = self.explorer.plan(self.problem, &start)?;
            self.planned_for = Some(start);
        }
        let a = action.len();
        action.copy_from_slice(&self.plan[step * a..(step + 1) * a]);
        Ok(())
    }

    fn take_curve(&mut self) -> Vec<CurvePoint> {
        std::mem::take(&mut self.curve)
    }

    fn export(&self) -> serde_json::Value {
        let a = self.problem.task.exploration().action.len();
        let actions: Vec<&[f64]> = self.plan.chunks_exact(a).collect();
        serde_json::json!({"kind": "open-loop", "start": self.planned_for, "actions": actions})
    }
}

impl Explorer for FisherCem {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let (plan, curve) = match start {
            Some(start) => self.plan(problem, start)?,
            None => (Vec::new(), Vec::new()),
        };
        Ok(Explored {
            policy: Box::new(PlannedPolicy {
                explorer: self,
                problem,
                plan,
                curve: Vec::new(),
                planned_for: start.map(<[f64]>::to_vec),
            }),
            curve,
            curve_label: "iteration",
            objective: format!(
                "{} ({} form{})",
                self.fisher.objective.name(),
                self.fisher.form.name(),
                if self.fisher.nuisance {
                    ", start pose co-estimated"
                } else {
                    ""
                }
            ),
        })
    }
}
