//! Dense networks as plain numbers: layers `y = x W + b` with one activation function between them.
//!
//! Acting and estimating need only a few small matrix products. Trained networks are therefore
//! stored as numbers and not as handles of libtorch: they can be cloned, shared between threads and
//! used without libtorch.

use serde::{Deserialize, Serialize};

use crate::file::{Tensor, Tensors};

/// One layer, `y = x W + b`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Weights, `inputs x outputs`, row-major.
    pub weight: Vec<f32>,
    /// Biases, `outputs`.
    pub bias: Vec<f32>,
}

impl Layer {
    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.weight.len() / self.bias.len().max(1)
    }

    /// Computes `y = x W + b` row by row of `W`, so that the inner loop accesses contiguous memory.
    pub fn forward(&self, x: &[f32], y: &mut Vec<f32>) {
        y.clear();
        y.extend_from_slice(&self.bias);
        for (&x, row) in x.iter().zip(self.weight.chunks_exact(self.bias.len())) {
            for (y, w) in y.iter_mut().zip(row) {
                *y += x * w;
            }
        }
    }

    /// The layer as two tensors, `PREFIX.weight` and `PREFIX.bias`.
    pub(crate) fn to_tensors(&self, prefix: &str, tensors: &mut Tensors) {
        let weight = Tensor {
            shape: vec![self.inputs(), self.bias.len()],
            values: self.weight.clone(),
        };
        tensors.insert(format!("{prefix}.weight"), weight);
        let bias = Tensor::vector(self.bias.clone());
        tensors.insert(format!("{prefix}.bias"), bias);
    }

    /// Reads the layers `PREFIX.0`, `PREFIX.1` and so on.
    pub(crate) fn all_from_tensors(prefix: &str, tensors: &Tensors) -> Result<Vec<Self>, String> {
        let mut layers: Vec<Self> = Vec::new();
        while let (Some(weight), Some(bias)) = (
            tensors.get(&format!("{prefix}.{}.weight", layers.len())),
            tensors.get(&format!("{prefix}.{}.bias", layers.len())),
        ) {
            let outputs = bias.values.len();
            let fits = weight.shape.len() == 2
                && weight.shape[1] == outputs
                && layers
                    .last()
                    .is_none_or(|l| l.bias.len() == weight.shape[0]);
            if outputs == 0 || !fits {
                return Err(format!("the layers of `{prefix}` do not fit each other"));
            }
            layers.push(Self {
                weight: weight.values.clone(),
                bias: bias.values.clone(),
            });
        }
        if layers.is_empty() {
            return Err(format!("has no layer `{prefix}.0`"));
        }
        Ok(layers)
    }
}

/// A network of dense layers with tanh between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// The layers in order, at least one; the outputs of each are the inputs of the next.
    pub layers: Vec<Layer>,
}

impl Network {
    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.layers.first().map_or(0, Layer::inputs)
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |l| l.bias.len())
    }

    /// Outputs for one row of inputs.
    #[must_use]
    pub fn forward(&self, input: &[f32]) -> Vec<f32> {
        let mut x = input.to_vec();
        forward(&self.layers, &mut x, &mut Vec::new());
        x
    }
}

/// Replaces the inputs `x` by the outputs of layers with tanh between them; `y` is scratch.
pub(crate) fn forward(layers: &[Layer], x: &mut Vec<f32>, y: &mut Vec<f32>) {
    for (i, layer) in layers.iter().enumerate() {
        if i > 0 {
            x.iter_mut().for_each(|v| *v = v.tanh());
        }
        layer.forward(x, y);
        std::mem::swap(x, y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `y = 2 tanh(x0 - x1) + 0.5`, by hand.
    #[test]
    fn layers_compute_the_formula() {
        let network = Network {
            layers: vec![
                Layer {
                    weight: vec![1.0, -1.0],
                    bias: vec![0.0],
                },
                Layer {
                    weight: vec![2.0],
                    bias: vec![0.5],
                },
            ],
        };
        assert_eq!((network.inputs(), network.outputs()), (2, 1));
        let expected = 2.0 * (-0.2_f32).tanh() + 0.5;
        // Tolerance of single precision.
        assert!((network.forward(&[0.1, 0.3])[0] - expected).abs() < 1e-6);
    }
}
