//! Trains the identifier `estimator`; its settings and use are in [`asid_learned::estimator`].

use asid_core::progress::Progress;
use asid_core::{Error, Parameter, Result};
use asid_learned::estimator::Fitted;
use asid_learned::tensorboard::Scalars;
use asid_learned::{Dataset, Estimator, EstimatorTrainer, Inference};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tch::Tensor;

use crate::posterior_net::{PosteriorNet, Rows};
use crate::training::wall_time;

inventory::submit! {
    EstimatorTrainer { fit }
}

/// Trains on the first dataset and keeps the epoch that is best on the second.
fn fit(
    settings: &Estimator,
    parameters: &[Parameter],
    [training, validation]: [&Dataset; 2],
    seed: u64,
    progress: &dyn Progress,
) -> Result<Fitted> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let marks = training.marks;
    let rates = (settings.learning_rate, settings.weight_decay);
    let mut net = PosteriorNet::new(training, parameters, &settings.hidden, rates, &mut rng)?;
    let (rows, held_out) = (net.rows(training), net.rows(validation));
    let n = training.episodes();
    let mut order: Vec<i64> = (0..n as i64).collect();
    let mut best: Option<(f64, Inference)> = None;
    let mut events = Vec::new();
    progress.begin("estimator: network", settings.epochs as u64);
    for epoch in 0..settings.epochs {
        let left = 1.0 - epoch as f64 / settings.epochs as f64;
        net.set_learning_rate(settings.learning_rate * left);
        order.shuffle(&mut rng);
        let (mut sum, mut batches) = (0.0, 0.0);
        for part in order.chunks(settings.minibatch) {
            let index = Tensor::from_slice(part);
            let some = Rows {
                input: rows.input.index_select(0, &index),
                truth: rows.truth.index_select(0, &index),
            };
            let keep = keep(part.len(), marks, &mut rng, |rng, _| {
                rng.random::<f64>() >= settings.missing
            });
            sum += net.step(&some, Some(&keep));
            batches += 1.0;
        }
        let loss = tch::no_grad(|| net.loss(&held_out)).double_value(&[]);
        if loss.is_finite() && best.as_ref().is_none_or(|(b, _)| loss < *b) {
            best = Some((loss, net.plain()));
        }
        events.push(Scalars {
            step: epoch as i64 + 1,
            wall_time: wall_time(),
            values: vec![
                ("losses/training", (sum / batches) as f32),
                ("losses/held_out", loss as f32),
                (
                    "charts/learning_rate",
                    (settings.learning_rate * left) as f32,
                ),
            ],
        });
        progress.note(&format!("information {:.2} nats", -loss));
        progress.advance(1);
    }
    progress.end();
    let Some((_, inference)) = best else {
        let message = "the training of the estimator diverged; lower identifier.learning_rate";
        return Err(Error::Failed(message.into()));
    };
    Ok(Fitted { inference, events })
}

/// Random mask of the marks that are shown, `rows x marks` of 0 and 1.
pub fn keep(
    rows: usize,
    marks: usize,
    rng: &mut ChaCha8Rng,
    mut shown: impl FnMut(&mut ChaCha8Rng, usize) -> bool,
) -> Tensor {
    let mut all: Vec<f32> = Vec::with_capacity(rows * marks);
    for i in 0..rows * marks {
        all.push(f32::from(u8::from(shown(rng, i % marks))));
    }
    Tensor::from_slice(&all).view([rows as i64, marks as i64])
}

#[cfg(test)]
mod tests {
    use asid_core::Streams;
    use asid_core::parameter::Scale;
    use asid_core::progress::Silent;
    use asid_learned::estimator::score;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn parameter(scale: Scale) -> Parameter {
        Parameter {
            name: "p".into(),
            targets: vec!["geom/a/friction/0".parse().unwrap()],
            range: [0.0, 1.0],
            scale,
            unit: String::new(),
        }
    }

    /// Episodes of `marks` marks, each with a reading of `z` with noise `sigma` and a reading of
    /// pure noise.
    fn episodes(n: usize, marks: usize, sigma: f64, prior: &Parameter, seed: u64) -> Dataset {
        let mut rng = Streams::new(seed).stream("toy");
        let mut data = Dataset {
            len: 3 * marks,
            entries: 2 * marks,
            marks,
            ..Dataset::default()
        };
        for _ in 0..n {
            let z = prior.to_scaled(prior.sample(&mut rng));
            data.truths.push(z);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            for _ in 0..marks {
                let reading = z + sigma * normal();
                // In an arbitrary unit and from an arbitrary origin.
                data.histories.extend([5.0 + 0.01 * reading, normal()]);
            }
            data.histories.extend(vec![1.0; marks]);
        }
        data
    }

    fn fitted(prior: Parameter, sigma: f64) -> (Inference, Dataset) {
        let settings = Estimator {
            hidden: vec![32],
            epochs: 30,
            ..Estimator::default()
        };
        let training = episodes(settings.episodes, 4, sigma, &prior, 1);
        let validation = episodes(500, 4, sigma, &prior, 2);
        let parameters = [prior.clone()];
        let found = fit(&settings, &parameters, [&training, &validation], 7, &Silent).unwrap();
        let mut inference = found.inference;
        inference.calibrate(&validation.histories, validation.len, &validation.truths);
        (inference, episodes(1000, 4, sigma, &prior, 3))
    }

    /// Linear and Gaussian case: the posterior of four readings of noise 0.6 is N(mean of the
    /// readings, 0.3^2), truncated to the prior's box. Tolerances: information and error within 5 %
    /// of the exact posterior's, standard deviation within 10 % in the median. Of 1000 intervals of
    /// 95 %, 950 hold the truth, plus or minus 7 (one standard deviation).
    #[test]
    fn it_is_calibrated_where_the_posterior_is_known() {
        let (inference, data) = fitted(parameter(Scale::Linear), 0.6);
        let found = score(&inference, &data, 0, 1);
        assert!((0.93..=0.97).contains(&found.coverage95), "{found:?}");
        let (mut error, mut prior, mut information) = (0.0, 0.0, 0.0);
        let mut ratios = Vec::new();
        for (history, &z) in data.histories.chunks_exact(data.len).zip(&data.truths) {
            let readings = (0..4).map(|k| (history[2 * k] - 5.0) / 0.01);
            let bound = Parameter::scaled_bound();
            let exact = asid_learned::Belief::Gaussian {
                mean: readings.sum::<f64>() / 4.0,
                std: 0.3,
            };
            error += (exact.mean() - z).powi(2);
            prior += z * z;
            information += exact.log_ratio(z) / data.episodes() as f64;
            let asid_learned::Belief::Gaussian { mean, std } = inference.beliefs(history)[0] else {
                panic!("a Gaussian");
            };
            // Near the edge different truncated Gaussians are nearly alike.
            if mean.abs() < bound - 0.9 {
                ratios.push(std / 0.3);
            }
        }
        let ratio = found.error_over_prior / (error / prior).sqrt();
        assert!(ratio < 1.05, "{ratio} {found:?} {information}");
        assert!(
            found.information > 0.95 * information,
            "{found:?} {information}"
        );
        ratios.sort_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        assert!((0.9..=1.1).contains(&median), "{median}");
    }

    /// Two models at -1 and 1: with four readings of noise 2 the log-odds are exactly twice their
    /// mean. The true model is the more probable one with probability Phi(1) = 0.841.
    #[test]
    fn a_binary_unknown_has_log_odds() {
        let (inference, data) = fitted(parameter(Scale::Binary([0.0, 1.0])), 2.0);
        let found = score(&inference, &data, 0, 1);
        // 1000 episodes: one standard deviation is 0.012.
        assert!((found.coverage95 - 0.841).abs() < 0.04, "{found:?}");
        let mut off = 0.0;
        for history in data.histories.chunks_exact(data.len) {
            let readings = (0..4).map(|k| (history[2 * k] - 5.0) / 0.01);
            let exact = 2.0 * readings.sum::<f64>() / 4.0;
            let asid_learned::Belief::Binary { logit } = inference.beliefs(history)[0] else {
                panic!("binary");
            };
            off += (logit - exact).abs() / data.episodes() as f64;
        }
        assert!(off < 0.5, "{off}");
    }

    #[test]
    fn the_same_seed_gives_the_same_network() {
        let prior = parameter(Scale::Linear);
        let settings = Estimator {
            hidden: vec![8],
            epochs: 2,
            ..Estimator::default()
        };
        let data = episodes(200, 2, 0.5, &prior, 1);
        let parameters = [prior];
        let once = || {
            fit(&settings, &parameters, [&data, &data], 7, &Silent)
                .unwrap()
                .inference
        };
        assert_eq!(once(), once());
    }

    /// Symptom: a training whose first epoch diverged gave a network of NaN, in a file that could
    /// not be read back. Cause: no later loss is below NaN.
    #[test]
    fn a_training_that_diverges_says_so() {
        let prior = parameter(Scale::Linear);
        let settings = Estimator {
            hidden: vec![8],
            epochs: 2,
            minibatch: 16,
            learning_rate: 1e30,
            ..Estimator::default()
        };
        let data = episodes(200, 2, 0.5, &prior, 1);
        let found = fit(&settings, &[prior], [&data, &data], 7, &Silent);
        let message = found.err().unwrap().to_string();
        assert!(message.contains("identifier.learning_rate"), "{message}");
    }
}
