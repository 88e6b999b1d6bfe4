//! Training of MaxMI's predictor, which continues from its present weights; its claims are
//! calibrated on episodes that it did not learn from.
//!
//! The policy's reward is computed from the predictor's claims, so an overconfident predictor would
//! be exploited. A share of the episodes is therefore held out: a training step that does not help
//! on these is undone, and the standard deviations are calibrated on them. An uninformative history
//! then earns nothing.

use std::sync::Arc;

use asid_core::{Error, Parameter, Result};
use asid_learned::Dataset;
use asid_learned::inference::Inference;
use asid_learned::maxmi::PredictorSettings;
use rand::{Rng as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tch::Tensor;

use crate::estimator::keep;
use crate::posterior_net::{PosteriorNet, Rows};

/// Steps of Adam between two evaluations on the held-out episodes.
const LOOK: usize = 10;

/// Evaluations without a gain after which a training ends.
const PATIENCE: usize = 10;

/// The predictor, with the episodes that it learns from.
pub struct Predictor<'a> {
    settings: &'a PredictorSettings,
    parameters: &'a [Parameter],
    /// Whole episodes to learn from.
    training: Dataset,
    /// Held-out episodes that stop and calibrate; each is stored whole and up to a random mark.
    held_out: Dataset,
    /// Number of episodes so far.
    seen: usize,
    /// Number of training episodes at the latest training from scratch.
    begun_with: usize,
    net: Option<PosteriorNet>,
    rng: ChaCha8Rng,
}

impl<'a> Predictor<'a> {
    /// Predictor for histories with the layout of `shape`, which holds no episode.
    pub fn new(
        settings: &'a PredictorSettings,
        parameters: &'a [Parameter],
        shape: &Dataset,
        seed: u64,
    ) -> Self {
        let (training, held_out) = (shape.split(0).0, shape.split(0).0);
        Self {
            settings,
            parameters,
            training,
            held_out,
            seen: 0,
            begun_with: 0,
            net: None,
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Stores an episode, to learn from or to be held out.
    pub fn remember(&mut self, history: &[f64], truth: &[f64]) {
        // Held-out episodes are evenly spaced; the first one is held out.
        let due = |n: usize| (n as f64 * self.settings.held_out).ceil();
        let holds_out = due(self.seen + 1) > due(self.seen);
        self.seen += 1;
        let data = if holds_out {
            let shown = self.rng.random_range(1..=self.training.marks);
            let mut part = history.to_vec();
            cut(&mut part, &self.held_out, shown);
            self.held_out.histories.extend(part);
            self.held_out.truths.extend_from_slice(truth);
            &mut self.held_out
        } else {
            &mut self.training
        };
        data.histories.extend_from_slice(history);
        data.truths.extend_from_slice(truth);
    }

    /// Whether the first episodes, which are rewarded for motion, are over.
    pub fn is_warm(&self) -> bool {
        self.seen >= self.settings.warm_up
    }

    /// Learns from the stored episodes; returns the predictor with its present claims.
    ///
    /// # Errors
    /// Those of libtorch, and where fewer than two episodes are stored.
    pub fn learn(&mut self) -> Result<Arc<Inference>> {
        forget(&mut self.training, self.settings.memory);
        // Each is stored twice: whole and in part.
        forget(&mut self.held_out, 2 * self.settings.judges);
        let n = self.training.episodes();
        if n == 0 || self.held_out.episodes() == 0 {
            return Err(Error::Failed("a predictor needs two episodes".into()));
        }
        let mut net = match self.net.take() {
            Some(mut net) => {
                self.improve(&mut net, self.settings.steps);
                net
            }
            None => self.begin()?,
        };
        if n >= 2 * self.begun_with {
            // The input scales are those of the episodes at the beginning, and an improving policy
            // moves objects further. Twice as many episodes justify a new training from scratch.
            let mut other = self.begin()?;
            let loss = self.improve(&mut other, self.settings.begin_steps);
            if loss < held_out_loss(&net, &net.rows(&self.held_out)) {
                net = other;
            }
            self.begun_with = n;
        }
        let mut plain = net.plain();
        let held_out = &self.held_out;
        plain.calibrate(&held_out.histories, held_out.len, &held_out.truths);
        self.net = Some(net);
        Ok(Arc::new(plain))
    }

    /// A new, untrained network.
    fn begin(&mut self) -> Result<PosteriorNet> {
        let settings = self.settings;
        let rates = (settings.learning_rate, settings.weight_decay);
        let hidden = &settings.hidden;
        PosteriorNet::new(
            &self.training,
            self.parameters,
            hidden,
            rates,
            &mut self.rng,
        )
    }

    /// Trains for at most `steps` steps of Adam and returns the loss on the held-out episodes.
    ///
    /// The weights that are best on the held-out episodes are kept; these may be the initial ones.
    fn improve(&mut self, net: &mut PosteriorNet, steps: usize) -> f64 {
        let (rows, held_out) = (net.rows(&self.training), net.rows(&self.held_out));
        let (n, marks) = (self.training.episodes(), self.training.marks);
        let size = self.settings.minibatch.min(n);
        let mut best = (held_out_loss(net, &held_out), net.weights());
        let mut without_gain = 0;
        for step in 1..=steps {
            let picked: Vec<i64> = (0..size)
                .map(|_| self.rng.random_range(0..n as i64))
                .collect();
            let index = Tensor::from_slice(&picked);
            let some = Rows {
                input: rows.input.index_select(0, &index),
                truth: rows.truth.index_select(0, &index),
            };
            // Each episode is shown up to its own random mark.
            let mut last = 0;
            let keep = keep(size, marks, &mut self.rng, |rng, mark| {
                if mark == 0 {
                    last = rng.random_range(0..marks);
                }
                mark <= last
            });
            net.step(&some, Some(&keep));
            if step % LOOK == 0 || step == steps {
                let loss = held_out_loss(net, &held_out);
                if loss < best.0 {
                    best = (loss, net.weights());
                    without_gain = 0;
                } else {
                    without_gain += 1;
                }
                if without_gain == PATIENCE {
                    break;
                }
            }
        }
        net.set_weights(&best.1);
        best.0
    }
}

fn held_out_loss(net: &PosteriorNet, rows: &Rows) -> f64 {
    tch::no_grad(|| net.loss(rows)).double_value(&[])
}

/// Drops the oldest episodes.
fn forget(data: &mut Dataset, most: usize) {
    let over = data.episodes().saturating_sub(most);
    if over > 0 {
        *data = data.split(over).1;
    }
}

/// Sets all but the first `shown` marks of a history to unknown.
fn cut(history: &mut [f64], shape: &Dataset, shown: usize) {
    let (entries, masks) = history.split_at_mut(shape.entries);
    let from = |len: usize| len / shape.marks * shown;
    entries[from(shape.entries)..].fill(f64::NAN);
    let unseen = from(masks.len());
    masks[unseen..].fill(0.0);
}

#[cfg(test)]
mod tests {
    use asid_core::Streams;
    use asid_learned::estimator::score;

    use super::*;

    const MARKS: usize = 5;

    fn prior() -> Parameter {
        Parameter {
            name: "p".into(),
            targets: vec!["geom/a/friction/0".parse().unwrap()],
            range: [0.0, 1.0],
            scale: asid_core::parameter::Scale::Linear,
            unit: String::new(),
        }
    }

    fn shape() -> Dataset {
        Dataset {
            len: 2 * MARKS,
            entries: MARKS,
            marks: MARKS,
            ..Dataset::default()
        }
    }

    /// Returns the predictor after 20 batches of 64 episodes, and 500 new episodes.
    ///
    /// Each reading is `gain` times the unknown, with noise that shrinks from mark to mark.
    fn learned(gain: f64, hidden: usize) -> (Arc<Inference>, Vec<(Vec<f64>, f64)>) {
        let parameters = [prior()];
        let settings = PredictorSettings {
            hidden: vec![hidden],
            ..PredictorSettings::default()
        };
        let mut rng = Streams::new(5).stream("toy");
        let mut episode = || {
            let z = parameters[0].to_scaled(parameters[0].sample(&mut rng));
            let mut history: Vec<f64> = (0..MARKS)
                .map(|k| gain * z + (2.0 - 0.4 * k as f64) * rng.random_range(-1.0..1.0))
                .collect();
            history.resize(2 * MARKS, 1.0);
            (history, z)
        };
        let mut predictor = Predictor::new(&settings, &parameters, &shape(), 1);
        let mut inference = None;
        for _ in 0..20 {
            for _ in 0..64 {
                let (history, z) = episode();
                predictor.remember(&history, &[z]);
            }
            inference = Some(predictor.learn().unwrap());
        }
        (inference.unwrap(), (0..500).map(|_| episode()).collect())
    }

    fn shown(fresh: &[(Vec<f64>, f64)], marks: usize) -> Dataset {
        let mut data = shape();
        for (history, z) in fresh {
            let mut history = history.clone();
            cut(&mut history, &shape(), marks);
            data.histories.extend(history);
            data.truths.push(*z);
        }
        data
    }

    /// The final error on new episodes is below half of that of the prior's mean, and it decreases
    /// with the number of marks seen.
    #[test]
    fn the_predictor_beats_the_priors_mean_by_a_factor() {
        let (inference, fresh) = learned(1.0, 32);
        let errors =
            [1, 3, 5].map(|marks| score(&inference, &shown(&fresh, marks), 0, 1).error_over_prior);
        assert!(
            errors[2] < 0.5 && errors.is_sorted_by(|a, b| a > b),
            "{errors:?}"
        );
    }

    /// Readings of pure noise, and a network large enough to memorise them: it claims the prior.
    /// With 500 episodes error and information have a standard error of about 0.01.
    #[test]
    fn of_noise_it_claims_nothing() {
        let (inference, fresh) = learned(0.0, 512);
        for marks in [1, MARKS] {
            let found = score(&inference, &shown(&fresh, marks), 0, 1);
            assert!(found.error_over_prior < 1.02, "{found:?}");
            assert!(found.information.abs() < 0.02, "{found:?}");
        }
    }

    /// Of 100 episodes 20 are held out, whole and in part; the oldest of both sets are dropped.
    #[test]
    fn a_share_is_held_out_and_the_oldest_go() {
        let parameters = [prior()];
        let settings = PredictorSettings {
            memory: 50,
            judges: 8,
            hidden: vec![4],
            ..PredictorSettings::default()
        };
        let mut predictor = Predictor::new(&settings, &parameters, &shape(), 1);
        for i in 0..100 {
            predictor.remember(&[1.0; 2 * MARKS], &[f64::from(i) / 100.0]);
        }
        assert_eq!(predictor.training.episodes(), 80);
        assert_eq!(predictor.held_out.episodes(), 40);
        predictor.learn().unwrap();
        assert_eq!(predictor.training.episodes(), 50);
        assert_eq!(predictor.held_out.episodes(), 16);
        assert_eq!(predictor.training.truths.last(), Some(&0.99));
    }
}
