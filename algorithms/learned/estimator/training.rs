//! Training of an estimator: collects episodes, fits a network to most of them, calibrates its
//! standard deviations on others, and scores it on the rest.

use std::time::Instant;

use asid_core::progress::Progress;
use asid_core::{Error, Explorer, Parameter, Problem, Result};

use super::{Estimator, NAME, NETWORK};
use crate::collect::{Dataset, collect};
use crate::file::{Description, Saved, Tensors};
use crate::inference::Inference;
use crate::tensorboard::Scalars;

/// Result of fitting a network to episodes.
pub struct Fitted {
    /// The network, not yet calibrated.
    pub inference: Inference,
    /// Losses by epoch.
    pub events: Vec<Scalars>,
}

/// Fits networks; a crate that can train submits one through `inventory`.
#[allow(clippy::type_complexity)] // its arguments are what it is
pub struct EstimatorTrainer {
    /// Fits to the first dataset and keeps the epoch that is best on the second.
    pub fit: fn(
        settings: &Estimator,
        parameters: &[Parameter],
        data: [&Dataset; 2],
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Fitted>,
}

inventory::collect!(EstimatorTrainer);

/// Whether this program can train an estimator.
#[must_use]
pub fn can_train() -> bool {
    inventory::iter::<EstimatorTrainer>().next().is_some()
}

impl Estimator {
    /// Trains on episodes of an explorer.
    pub(super) fn learn(
        &self,
        problem: &Problem<'_>,
        explorer: &dyn Explorer,
    ) -> Result<(Saved, Vec<Scalars>)> {
        let Some(trainer) = inventory::iter::<EstimatorTrainer>().next() else {
            return Err(self.missing(problem, "training is asked for"));
        };
        let clock = Instant::now();
        let data = collect(problem, explorer, self.episodes)?;
        let seed = rand::Rng::random(&mut problem.streams.stream("estimator network"));
        let (inference, figures, events) = self.fitted(trainer, problem, &data, seed)?;
        let mut tensors = Tensors::new();
        inference.to_tensors(NETWORK, &mut tensors);
        let settings = Self {
            network: String::new(),
            ..self.clone()
        };
        let settings =
            serde_json::to_value(&settings).map_err(|e| Error::Failed(format!("settings: {e}")))?;
        let horizon = problem.task.exploration().horizon;
        let saved = Saved {
            description: Description {
                explorer: self.explorer.clone(),
                observation: self.observation(problem)?,
                training_steps: (data.episodes() * horizon) as u64,
                seconds: clock.elapsed().as_secs_f64(),
                figures: figures.into_iter().collect(),
                ..Description::new(NAME, problem, settings)
            },
            tensors,
        };
        Ok((saved, events))
    }

    /// Fits, calibrates and scores a network.
    #[allow(clippy::type_complexity)]
    fn fitted(
        &self,
        trainer: &EstimatorTrainer,
        problem: &Problem<'_>,
        data: &Dataset,
        seed: u64,
    ) -> Result<(Inference, Vec<(String, f64)>, Vec<Scalars>)> {
        let held_out = ((data.episodes() as f64 * self.held_out) as usize).max(1);
        let (scored, rest) = data.split(held_out);
        let (calibrating, training) = rest.split(held_out);
        let fitted = (trainer.fit)(
            self,
            problem.parameters,
            [&training, &calibrating],
            seed,
            problem.progress,
        )?;
        let mut inference = fitted.inference;
        inference.calibrate(&calibrating.histories, data.len, &calibrating.truths);
        let mut figures = Vec::new();
        for (i, p) in problem.parameters.iter().enumerate() {
            let score = score(&inference, &scored, i, problem.parameters.len());
            let named = |name: &str, value: f64| (format!("{}.{name}", p.name), value);
            figures.extend([
                named("error_over_prior", score.error_over_prior),
                named("coverage95", score.coverage95),
                named("information_nats", score.information),
            ]);
        }
        Ok((inference, figures, fitted.events))
    }
}

/// Quality of a network's belief about one unknown, on episodes that it was not trained on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Root mean square error over that of the prior's mean.
    pub error_over_prior: f64,
    /// Share of the truths inside the central 95 % (for a binary unknown: guessed correctly).
    pub coverage95: f64,
    /// Mean of `log q(truth) - log prior(truth)`, nats.
    pub information: f64,
}

/// Scores a network at unknown `i` of `d`.
#[must_use]
pub fn score(inference: &Inference, data: &Dataset, i: usize, d: usize) -> Score {
    let rows = data.histories.chunks_exact(data.len.max(1));
    let truths: Vec<f64> = data.truths.iter().skip(i).step_by(d).copied().collect();
    let (mut square, mut prior, mut inside, mut told) = (0.0, 0.0, 0.0, 0.0);
    for (row, &z) in rows.zip(&truths) {
        let belief = inference.beliefs(row)[i];
        square += (belief.mean() - z).powi(2);
        prior += z * z;
        inside += f64::from(u8::from(belief.covers(z)));
        told += belief.log_ratio(z);
    }
    let n = truths.len().max(1) as f64;
    Score {
        error_over_prior: (square / prior.max(f64::MIN_POSITIVE)).sqrt(),
        coverage95: inside / n,
        information: told / n,
    }
}
