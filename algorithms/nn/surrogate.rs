//! The clipped surrogate objective (Schulman et al. 2017, "Proximal policy
//! optimization algorithms", equation 7), as a loss to minimise.
//!
//! ```text
//! r    = pi(a | s) / pi_old(a | s)
//! L    = -mean(min(r A, clip(r, 1 - eps, 1 + eps) A))
//! ```
//!
//! A sample whose ratio has left the interval in the direction that its advantage favours has no
//! gradient. On the other side it is pulled back.

use tch::{Kind, Tensor};

/// Loss with the gradient of the surrogate objective; scalar.
///
/// `log_prob`, `old_log_prob` and `advantage` have one entry per sample.
pub fn clipped_surrogate_loss(
    log_prob: &Tensor,
    old_log_prob: &Tensor,
    advantage: &Tensor,
    clip: f64,
) -> Tensor {
    let ratio = (log_prob - old_log_prob).exp();
    let clipped = ratio.clamp(1.0 - clip, 1.0 + clip);
    -(ratio * advantage)
        .minimum(&(clipped * advantage))
        .mean(None::<Kind>)
}

/// Shift of a policy relative to the one that collected the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Estimate of KL(old, new): mean of `(r - 1) - log r`, which is never negative.
    pub approx_kl: f64,
    /// Share of the samples with a ratio outside the clipping interval.
    pub clip_fraction: f64,
}

/// Measures the shift between two policies on samples of the older.
#[must_use]
pub fn shift(log_prob: &Tensor, old_log_prob: &Tensor, clip: f64) -> Shift {
    let log_ratio = log_prob - old_log_prob;
    let off: Tensor = log_ratio.exp() - 1.0;
    let kl: Tensor = (&off - &log_ratio).mean(Kind::Double);
    let outside = off.abs().gt(clip).to_kind(Kind::Double);
    Shift {
        approx_kl: kl.double_value(&[]),
        clip_fraction: outside.mean(Kind::Double).double_value(&[]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATE: [f64; 4] = [1.0, -0.5, 2.0, 0.25];
    const ACTION: [f64; 4] = [0.9, 0.3, -0.4, 0.1];
    const SIGMA: f64 = 0.5;
    const CLIP: f64 = 0.2;

    /// log N(a; w s, sigma), without its constant, which cancels in the ratio.
    fn log_prob(weight: f64, i: usize) -> f64 {
        -0.5 * ((ACTION[i] - weight * STATE[i]) / SIGMA).powi(2)
    }

    /// Gradient of the loss with respect to `weight`: by libtorch and by hand.
    fn gradients(weight: f64, old_weight: f64, advantage: &[f64; 4]) -> (f64, f64) {
        let w = Tensor::from(weight).set_requires_grad(true);
        let off: Tensor = (Tensor::from_slice(&ACTION) - &w * Tensor::from_slice(&STATE)) / SIGMA;
        let new: Tensor = off.square() * -0.5;
        let old: Vec<f64> = (0..4).map(|i| log_prob(old_weight, i)).collect();
        let advantages = Tensor::from_slice(advantage);
        clipped_surrogate_loss(&new, &Tensor::from_slice(&old), &advantages, CLIP).backward();

        // d/dw of -mean(r A) over the samples that are not clipped:
        // dr/dw = r (a - w s) s / sigma^2.
        let mut by_hand = 0.0;
        for i in 0..4 {
            let ratio = (log_prob(weight, i) - old[i]).exp();
            let clipped = (advantage[i] > 0.0 && ratio > 1.0 + CLIP)
                || (advantage[i] < 0.0 && ratio < 1.0 - CLIP);
            if !clipped {
                let score = (ACTION[i] - weight * STATE[i]) * STATE[i] / SIGMA.powi(2);
                by_hand -= advantage[i] * ratio * score / 4.0;
            }
        }
        (w.grad().double_value(&[]), by_hand)
    }

    /// At the old policy no sample is clipped, and the gradient is the policy gradient: with the
    /// scores 2.4, -0.9, -8 and 0.025 it is -(2.4 + 1.8 - 4 + 0.0375) / 4.
    #[test]
    fn at_the_old_policy_the_gradient_is_the_policy_gradient() {
        let (torch, by_hand) = gradients(0.3, 0.3, &[1.0, -2.0, 0.5, 1.5]);
        assert!((torch - by_hand).abs() < 1e-12, "{torch} {by_hand}");
        assert!((by_hand + 0.059375).abs() < 1e-12, "{by_hand}");
    }

    /// The ratios of these samples are 1.90, 0.64, 0.01 and 0.99 (w from 0.3 to 0.7), so every sign
    /// of the advantage is tested on every side of the interval.
    #[test]
    fn a_sample_is_clipped_only_on_the_side_it_is_pushed_to() {
        for signs in 0..16_u32 {
            let advantage = std::array::from_fn(|i| {
                let sign = if signs >> i & 1 == 1 { 1.0 } else { -1.0 };
                sign * (1.0 + i as f64)
            });
            let (torch, by_hand) = gradients(0.7, 0.3, &advantage);
            assert!(
                (torch - by_hand).abs() < 1e-12,
                "{advantage:?}: {torch} {by_hand}"
            );
        }
    }

    /// Ratios 1, 2 and 1/2: KL by hand; two of three lie outside 0.8 to 1.2.
    #[test]
    fn the_shift_is_that_of_the_ratios() {
        let old = Tensor::from_slice(&[0.0, 0.0, 0.0]);
        let new = Tensor::from_slice(&[0.0, 2_f64.ln(), 0.5_f64.ln()]);
        let shift = shift(&new, &old, CLIP);
        let kl = ((1.0 - 2_f64.ln()) + (-0.5 + 2_f64.ln())) / 3.0;
        assert!((shift.approx_kl - kl).abs() < 1e-12);
        assert!((shift.clip_fraction - 2.0 / 3.0).abs() < 1e-12);
    }
}
