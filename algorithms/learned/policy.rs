//! A trained policy as plain numbers.
//!
//! Acting needs three small matrix products, so a policy holds its weights itself and not a handle
//! of libtorch. It can be cloned, shared between threads and saved as a JSON file that holds
//! nothing but numbers.

use std::fs;
use std::path::Path;

use asid_core::{Error, Result};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::file::{Tensor, Tensors};
use crate::network::{Layer, forward};
use crate::normaliser::Normaliser;

/// A Gaussian policy: normaliser, tanh layers, and a standard deviation per action entry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Policy {
    schema: u32,
    normaliser: Normaliser,
    layers: Vec<Layer>,
    log_std: Vec<f32>,
}

/// Version of the file format.
const SCHEMA: u32 = 1;

impl Policy {
    /// Policy from layers that fit each other.
    #[must_use]
    pub fn new(normaliser: Normaliser, layers: Vec<Layer>, log_std: Vec<f32>) -> Self {
        Self {
            schema: SCHEMA,
            normaliser,
            layers,
            log_std,
        }
    }

    /// Policy of one layer without normaliser: `y = x W + b`.
    #[must_use]
    pub fn linear(inputs: usize, weight: Vec<f32>, bias: Vec<f32>) -> Self {
        let log_std = vec![0.0; bias.len()];
        let layers = vec![Layer { weight, bias }];
        Self::new(Normaliser::identity(inputs), layers, log_std)
    }

    /// Reads a policy from JSON, such as the `network` of an exported explorer.
    ///
    /// # Errors
    /// [`Error::Config`] where it is no valid policy.
    pub fn from_json(value: &serde_json::Value) -> Result<Self> {
        let wrong = |message: String| Error::Config {
            key: "network".to_owned(),
            message,
        };
        let policy = Self::deserialize(value).map_err(|e| wrong(e.to_string()))?;
        match policy.fault() {
            None => Ok(policy),
            Some(fault) => Err(wrong(format!("not a usable policy: {fault}"))),
        }
    }

    /// The policy as tensors, with names that begin with `prefix`.
    pub fn to_tensors(&self, prefix: &str, tensors: &mut Tensors) {
        let (count, mean, variance) = self.normaliser.moments();
        let single = |values: &[f64]| values.iter().map(|&x| x as f32).collect();
        for (name, values) in [
            ("count", &[count][..]),
            ("mean", mean),
            ("variance", variance),
        ] {
            let name = format!("{prefix}.normaliser.{name}");
            tensors.insert(name, Tensor::vector(single(values)));
        }
        for (i, layer) in self.layers.iter().enumerate() {
            layer.to_tensors(&format!("{prefix}.{i}"), tensors);
        }
        let log_std = Tensor::vector(self.log_std.clone());
        tensors.insert(format!("{prefix}.log_std"), log_std);
    }

    /// Reads the policy from the tensors whose names begin with `prefix`; an error says what is
    /// wrong.
    ///
    /// # Errors
    /// Where a tensor is missing or the numbers are no valid policy.
    pub fn from_tensors(prefix: &str, tensors: &Tensors) -> Result<Self, String> {
        let get = |name: &str| -> Result<Vec<f32>, String> {
            let name = format!("{prefix}.{name}");
            let tensor = tensors.get(&name);
            tensor
                .map(|t| t.values.clone())
                .ok_or_else(|| format!("has no tensor `{name}`"))
        };
        let double = |name: &str| -> Result<Vec<f64>, String> {
            Ok(get(name)?.into_iter().map(f64::from).collect())
        };
        let count = double("normaliser.count")?.first().copied().unwrap_or(0.0);
        let moments = (double("normaliser.mean")?, double("normaliser.variance")?);
        let normaliser = Normaliser::from_moments(count, moments.0, moments.1);
        let layers = Layer::all_from_tensors(prefix, tensors)?;
        let policy = Self::new(normaliser, layers, get("log_std")?);
        match policy.fault() {
            None => Ok(policy),
            Some(fault) => Err(format!("holds no usable policy: {fault}")),
        }
    }

    /// Number of entries of an observation.
    #[must_use]
    pub fn observation_len(&self) -> usize {
        self.normaliser.observation_len()
    }

    /// Number of entries of an action.
    #[must_use]
    pub fn action_len(&self) -> usize {
        self.log_std.len()
    }

    /// The scaling of observations, fixed at the end of training.
    #[must_use]
    pub fn normaliser(&self) -> &Normaliser {
        &self.normaliser
    }

    /// Writes the mean actions, `n x action_len`, of `n x observation_len`
    /// observations, clipped to `[-1, 1]`.
    ///
    /// # Errors
    /// [`Error::Shape`] where the arrays differ in their number of rows.
    pub fn act(&self, observation: &[f64], action: &mut [f64]) -> Result<()> {
        self.mean(observation, action)?;
        action.iter_mut().for_each(|a| *a = a.clamp(-1.0, 1.0));
        Ok(())
    }

    /// Writes sampled actions, with the shape and clipping of [`Self::act`].
    ///
    /// # Errors
    /// [`Error::Shape`] where the arrays differ in their number of rows.
    pub fn sample(
        &self,
        observation: &[f64],
        action: &mut [f64],
        rng: &mut impl Rng,
    ) -> Result<()> {
        self.mean(observation, action)?;
        for (a, log_std) in action.iter_mut().zip(self.log_std.iter().cycle()) {
            let noise: f64 = StandardNormal.sample(rng);
            *a = (*a + f64::from(*log_std).exp() * noise).clamp(-1.0, 1.0);
        }
        Ok(())
    }

    /// Mean actions before clipping.
    fn mean(&self, observation: &[f64], action: &mut [f64]) -> Result<()> {
        let (inputs, outputs) = (self.observation_len(), self.action_len());
        let n = action.len() / outputs;
        if observation.len() != n * inputs || action.len() != n * outputs {
            return Err(Error::Shape(format!(
                "policy: {} observation entries for {} action entries, where a row has {inputs} and {outputs}",
                observation.len(),
                action.len()
            )));
        }
        let mut x = vec![0.0_f32; inputs];
        let mut y = Vec::new();
        let rows = observation.chunks_exact(inputs);
        for (row, out) in rows.zip(action.chunks_exact_mut(outputs)) {
            x.resize(inputs, 0.0);
            self.normaliser.normalise(row, &mut x);
            forward(&self.layers, &mut x, &mut y);
            for (a, &v) in out.iter_mut().zip(&x) {
                *a = f64::from(v);
            }
        }
        Ok(())
    }

    /// Writes the policy as JSON.
    ///
    /// # Errors
    /// [`Error::File`] where the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string(self).map_err(|e| file_error(path, e))?;
        fs::write(path, text).map_err(|e| file_error(path, e))
    }

    /// Reads a file that [`Self::save`] wrote.
    ///
    /// # Errors
    /// [`Error::File`] where the file cannot be read or is no valid policy.
    pub fn load(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).map_err(|e| file_error(path, e))?;
        let policy: Self = serde_json::from_str(&text).map_err(|e| file_error(path, e))?;
        match policy.fault() {
            None => Ok(policy),
            Some(fault) => Err(file_error(path, format!("not a usable policy: {fault}"))),
        }
    }

    /// What is wrong with the numbers, if anything.
    fn fault(&self) -> Option<&'static str> {
        if self.schema != SCHEMA {
            return Some("its schema is not 1");
        }
        let mut inputs = self.observation_len();
        if inputs == 0 || self.log_std.is_empty() || self.layers.is_empty() {
            return Some("it has no inputs, layers or outputs");
        }
        for layer in &self.layers {
            if layer.bias.is_empty() || layer.weight.len() != inputs * layer.bias.len() {
                return Some("its layers do not fit each other");
            }
            inputs = layer.bias.len();
        }
        if inputs != self.log_std.len() {
            return Some("its last layer does not fit log_std");
        }
        let numbers = self
            .layers
            .iter()
            .flat_map(|l| l.weight.iter().chain(&l.bias));
        let finite = numbers.chain(&self.log_std).all(|x| x.is_finite());
        if !finite || !self.normaliser.is_sound() {
            return Some("a number in it is not finite");
        }
        None
    }
}

fn file_error(path: &Path, message: impl ToString) -> Error {
    Error::File {
        path: path.to_owned(),
        message: message.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// `a = 2 tanh(x0 - x1) + 0.5` with a standard deviation of 0.1.
    fn by_hand() -> Policy {
        let layers = vec![
            Layer {
                weight: vec![1.0, -1.0],
                bias: vec![0.0],
            },
            Layer {
                weight: vec![2.0],
                bias: vec![0.5],
            },
        ];
        Policy::new(Normaliser::identity(2), layers, vec![0.1_f32.ln()])
    }

    #[test]
    fn it_computes_the_formula_and_clips() {
        let mut action = [0.0; 2];
        by_hand().act(&[0.1, 0.3, 5.0, 0.0], &mut action).unwrap();
        let expected = 2.0 * (-0.2_f64).tanh() + 0.5;
        // Tolerance of single precision.
        assert!((action[0] - expected).abs() < 1e-6);
        assert_eq!(action[1], 1.0);
    }

    /// 10000 samples: the standard error of the mean is 0.001, that of the standard deviation
    /// 0.0007.
    #[test]
    fn samples_have_the_mean_and_the_deviation() {
        let policy = by_hand();
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut action = vec![0.0; 10_000];
        let observation = [0.1, 0.3].repeat(10_000);
        policy.sample(&observation, &mut action, &mut rng).unwrap();
        let mean = action.iter().sum::<f64>() / 1e4;
        let variance = action.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / 1e4;
        assert!((mean - (2.0 * (-0.2_f64).tanh() + 0.5)).abs() < 4e-3);
        assert!((variance.sqrt() - 0.1).abs() < 3e-3);
    }

    #[test]
    fn a_file_gives_back_the_same_policy_and_a_broken_one_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("policy.json");
        by_hand().save(&path).unwrap();
        assert_eq!(Policy::load(&path).unwrap(), by_hand());

        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("[1.0,-1.0]", "[1.0]")).unwrap();
        let message = Policy::load(&path).unwrap_err().to_string();
        assert!(message.contains("layers do not fit"), "{message}");
        fs::write(&path, text.replace("\"schema\":1", "\"schema\":2")).unwrap();
        assert!(
            Policy::load(&path)
                .unwrap_err()
                .to_string()
                .contains("schema")
        );
        assert!(Policy::load(&folder.path().join("none")).is_err());
    }

    #[test]
    fn arrays_that_do_not_fit_are_an_error() {
        let error = by_hand().act(&[0.0; 3], &mut [0.0; 2]).unwrap_err();
        assert!(matches!(error, Error::Shape(_)));
    }

    #[test]
    fn it_can_be_shared_between_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<Policy>();
    }
}
