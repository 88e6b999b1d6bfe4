//! Belief about one unknown: a Gaussian truncated to the prior's box, or the log-odds of a binary
//! unknown.

use asid_core::Parameter;
use asid_core::rng::Rng;
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

/// Belief about one unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Belief {
    /// A Gaussian, prior-scaled; mean and standard deviation are those before truncation to the
    /// prior's box.
    Gaussian {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
    },
    /// Log-odds that a binary unknown is 1.
    Binary {
        /// Logarithm of the odds.
        logit: f64,
    },
}

/// Distribution function of the standard normal.
fn phi(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

impl Belief {
    /// Log density at a prior-scaled value (log probability for a binary unknown) minus that of the
    /// prior, in nats.
    #[must_use]
    pub fn log_ratio(self, z: f64) -> f64 {
        match self {
            Self::Gaussian { mean, std } => {
                let b = Parameter::scaled_bound();
                let inside = phi((b - mean) / std) - phi((-b - mean) / std);
                let density =
                    -0.5 * ((z - mean) / std).powi(2) - std.ln() - 0.5 * std::f64::consts::TAU.ln();
                density - inside.ln() + (2.0 * b).ln()
            }
            Self::Binary { logit } => {
                let towards = if z > 0.0 { logit } else { -logit };
                -(-towards).exp().ln_1p() + std::f64::consts::LN_2
            }
        }
    }

    /// Draws a value, prior-scaled.
    pub fn sample(self, rng: &mut Rng) -> f64 {
        match self {
            Self::Gaussian { mean, std } => {
                let b = Parameter::scaled_bound();
                // The mean lies in the box. Of the widest Gaussian, 10 times the largest factor of
                // a calibration, one draw in 54 does too, and a thousand fail once in 10^8.
                for _ in 0..1000 {
                    let normal: f64 = StandardNormal.sample(rng);
                    let z = mean + std * normal;
                    if z.abs() <= b {
                        return z;
                    }
                }
                mean.clamp(-b, b)
            }
            Self::Binary { logit } => {
                let one = rng.random::<f64>() < 1.0 / (1.0 + (-logit).exp());
                if one { 1.0 } else { -1.0 }
            }
        }
    }

    /// Whether a prior-scaled value lies in the central 95 %; for a binary unknown, whether it is
    /// the more probable value.
    #[must_use]
    pub fn covers(self, z: f64) -> bool {
        match self {
            Self::Gaussian { mean, std } => {
                let b = Parameter::scaled_bound();
                let [low, at, high] = [-b, z, b].map(|x| phi((x - mean) / std));
                (0.025..=0.975).contains(&((at - low) / (high - low)))
            }
            Self::Binary { logit } => logit * z > 0.0,
        }
    }

    /// Mean after truncation, prior-scaled.
    #[must_use]
    pub fn mean(self) -> f64 {
        match self {
            Self::Gaussian { mean, std } => {
                let b = Parameter::scaled_bound();
                let (low, high) = ((-b - mean) / std, (b - mean) / std);
                let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
                let cut = mean + std * (density(low) - density(high)) / (phi(high) - phi(low));
                cut.clamp(-b, b)
            }
            Self::Binary { logit } => (0.5 * logit).tanh(),
        }
    }

    /// Combined belief from two independent episodes: the product of the likelihoods under one
    /// prior.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Gaussian { mean: m, std: s }, Self::Gaussian { mean: n, std: t }) => {
                let (p, q) = (s.powi(-2), t.powi(-2));
                Self::Gaussian {
                    mean: (m * p + n * q) / (p + q),
                    std: (p + q).powf(-0.5),
                }
            }
            (Self::Binary { logit: a }, Self::Binary { logit: b }) => Self::Binary { logit: a + b },
            (first, _) => first,
        }
    }

    /// The belief with its standard deviation (or the temperature of its log-odds) multiplied by
    /// `factor`.
    #[must_use]
    pub fn widened(self, factor: f64) -> Self {
        match self {
            Self::Gaussian { mean, std } => Self::Gaussian {
                mean,
                std: std * factor,
            },
            Self::Binary { logit } => Self::Binary {
                logit: logit / factor,
            },
        }
    }
}
