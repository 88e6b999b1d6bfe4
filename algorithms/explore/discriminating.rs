//! Exploration that discriminates between rival models: open-loop actions for which the rivals'
//! simulators predict the most different readings.
//!
//! Box and Hill (1967) choose the experiment with the largest expected divergence between rival
//! models, weighted by their probabilities. With Gaussian trackers the divergence of two
//! predictions is half their squared distance in units of the noise. Contact can make a prediction
//! chaotic: a tiny change of the start changes it a lot, and distance then discriminates nothing.
//! The difference between two copies of one rival with starts `HAIR` apart therefore counts as
//! additional noise.

use asid_core::explore::{CurvePoint, Explored, Explorer};
use asid_core::layout::Recording;
use asid_core::problem::Batch;
use asid_core::simulator::{Control, Rollout};
use asid_core::{Error, Model, Parameter, Problem, Result};
use asid_readings::SignalSet;

use super::open_loop::{OpenLoop, Planned, Planner};
use crate::optimise::CemSettings;

/// A rival model: a simulator with its fitted values.
#[derive(Clone)]
pub struct Rival {
    /// Its label.
    pub label: String,
    /// Its simulator.
    pub model: std::sync::Arc<dyn Model>,
    /// The parameters that are set in it.
    pub parameters: Vec<Parameter>,
    /// Values of the parameters, in their units.
    pub theta: Vec<f64>,
    /// Its probability.
    pub weight: f64,
}

/// Plans the actions that discriminate best between rivals.
pub struct Discriminating {
    /// The rival models, at least two.
    pub rivals: Vec<Rival>,
    /// Refits of the search distribution.
    pub iterations: usize,
    /// Action sequences per refit.
    pub population: usize,
    /// How a sequence of actions is written as numbers to search for.
    pub open_loop: OpenLoop,
}

/// Shift of a start coordinate that shows how predictions scatter, m or rad.
const HAIR: f64 = 1e-6;

impl Discriminating {
    /// Planner for these rivals, with the search effort of `fisher-cem`'s defaults.
    ///
    /// # Errors
    /// With fewer than two rivals.
    pub fn new(rivals: Vec<Rival>) -> Result<Self> {
        if rivals.len() < 2 {
            return Err(Error::Shape(format!(
                "{} explanations cannot be told apart; at least two are needed",
                rivals.len()
            )));
        }
        Ok(Self {
            rivals,
            iterations: 5,
            population: 32,
            open_loop: OpenLoop { hold: 5, std: 0.7 },
        })
    }

    /// Expected divergence between the rivals, nats, for each sequence of actions (`horizon x
    /// action`, in the task's units) from a start pose.
    ///
    /// # Errors
    /// When an engine fails.
    pub fn divergence(
        &self,
        problem: &Problem<'_>,
        start: &[f64],
        plans: &[Vec<f64>],
    ) -> Result<Vec<f64>> {
        let mut told = Vec::with_capacity(self.rivals.len());
        for rival in &self.rivals {
            told.push(Prediction::of(rival, problem, start, plans)?);
        }
        let total: f64 = self.rivals.iter().map(|r| r.weight).sum();
        let mut all = vec![0.0; plans.len()];
        for (i, a) in told.iter().enumerate() {
            for (j, b) in told.iter().enumerate().skip(i + 1) {
                let weight = self.rivals[i].weight * self.rivals[j].weight / (total * total);
                for (k, sum) in all.iter_mut().enumerate() {
                    *sum += weight * a.apart(b, k);
                }
            }
        }
        Ok(all)
    }
}

/// What a rival predicts for each of some plans.
struct Prediction {
    signals: SignalSet,
    /// Readings of each plan, `frames x width`.
    readings: Vec<Vec<f64>>,
    /// Squared change of each reading by the start shift `HAIR`, in units of the noise.
    scatter: Vec<Vec<f64>>,
}

/// Whitened differences between two episodes' readings, over all frames.
fn differences(signals: &SignalSet, a: &[f64], b: &[f64]) -> Vec<f64> {
    let (width, rows) = (signals.width(), signals.whitened_len());
    let mut all = vec![0.0; a.len() / width * rows];
    let frames = a.chunks_exact(width).zip(b.chunks_exact(width));
    for ((a, b), to) in frames.zip(all.chunks_exact_mut(rows)) {
        signals.difference(a, b, to);
    }
    all
}

impl Prediction {
    fn of(rival: &Rival, problem: &Problem<'_>, start: &[f64], plans: &[Vec<f64>]) -> Result<Self> {
        let protocol = problem.task.exploration();
        let layout = rival.model.layout();
        let signals = SignalSet::new(layout, problem.signals)?;
        let names: Vec<String> = problem.signals.iter().map(|s| s.sensor.clone()).collect();
        let recording: Recording = layout.recording(&names)?;
        let own = Problem {
            model: &*rival.model,
            parameters: &rival.parameters,
            ..*problem
        };
        // Two copies of each plan, their starts shifted by HAIR against each other.
        let n = 2 * plans.len();
        let sims: Vec<usize> = (0..n).collect();
        let mut batch: Batch = own.batch(n)?;
        let before = batch.simulator.steps_taken();
        batch.set_parameters(&sims, &rival.theta.repeat(n))?;
        let beside: Vec<f64> = start.iter().map(|x| x + HAIR).collect();
        let starts: Vec<f64> = plans
            .iter()
            .flat_map(|_| [start, &beside].concat())
            .collect();
        batch.place(problem.task, &sims, &starts)?;
        let (frames, nu, width) = (protocol.frames(), layout.nu(), recording.width());
        let mut control = Vec::with_capacity(n * frames * nu);
        let mut ctrl = vec![0.0; protocol.frames_per_step * nu];
        for plan in plans {
            let mut commander = problem.task.commander()?;
            commander.reset();
            let from = control.len();
            for action in plan.chunks_exact(protocol.action.len()) {
                commander.commands(action, &mut ctrl);
                control.extend_from_slice(&ctrl);
            }
            control.extend_from_within(from..);
        }
        let substeps = own.substeps(protocol.frame_period)?;
        let all = Control::PerSimulation(&control);
        let rollout = Rollout::new(&sims, frames, substeps, all, &recording);
        let mut out = vec![0.0; n * frames * width];
        batch.simulator.rollout(&rollout, &mut out)?;
        own.count_physics(&batch, before);
        let mut readings = Vec::with_capacity(plans.len());
        let mut scatter = Vec::with_capacity(plans.len());
        for pair in out.chunks_exact(2 * frames * width) {
            let (one, other) = pair.split_at(frames * width);
            let apart = differences(&signals, one, other);
            scatter.push(apart.iter().map(|x| x * x).collect());
            readings.push(one.to_vec());
        }
        Ok(Self {
            signals,
            readings,
            scatter,
        })
    }

    /// Divergence of two predictions of a plan, nats; 0 where one of the simulations diverged.
    fn apart(&self, other: &Self, plan: usize) -> f64 {
        let apart = differences(&self.signals, &self.readings[plan], &other.readings[plan]);
        let scatter = self.scatter[plan].iter().zip(&other.scatter[plan]);
        let sum: f64 = apart
            .iter()
            .zip(scatter)
            .map(|(d, (s, t))| 0.5 * d * d / (1.0 + s.max(*t)))
            .sum();
        if sum.is_finite() { sum } else { 0.0 }
    }
}

impl Planner for Discriminating {
    fn plan(&self, problem: &Problem<'_>, start: &[f64]) -> Result<(Vec<f64>, Vec<CurvePoint>)> {
        let protocol = problem.task.exploration();
        let mut cem = self.open_loop.search(
            protocol,
            CemSettings {
                elite_fraction: 0.2,
                ..CemSettings::default()
            },
        );
        let mut rng = problem.streams.stream("discriminating");
        let mut curve = Vec::new();
        let mut best: Option<(f64, Vec<f64>)> = None;
        problem
            .progress
            .begin("explore: telling apart", self.iterations as u64);
        for iteration in 0..self.iterations {
            let candidates = cem.ask(self.population, &mut rng);
            let plans: Vec<Vec<f64>> = candidates
                .iter()
                .map(|c| self.open_loop.actions(protocol, c))
                .collect();
            let returns = self.divergence(problem, start, &plans)?;
            let costs: Vec<f64> = returns.iter().map(|r| -r).collect();
            cem.tell(&candidates, &costs);
            for (plan, &r) in plans.iter().zip(&returns) {
                if best.as_ref().is_none_or(|(b, _)| r > *b) {
                    best = Some((r, plan.clone()));
                }
            }
            curve.push(CurvePoint::of(iteration + 1, &returns));
            problem.progress.advance(1);
        }
        problem.progress.end();
        let (_, plan) = best.ok_or_else(|| Error::Failed("no plan was tried".into()))?;
        Ok((plan, curve))
    }
}

impl Explorer for Discriminating {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let labels: Vec<&str> = self.rivals.iter().map(|r| &*r.label).collect();
        let objective = format!("expected divergence between {}", labels.join(", "));
        Planned::explored(self, problem, start, objective)
    }
}
