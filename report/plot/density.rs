//! Densities of weighted samples.

/// Samples with weights; non-finite ones and those without weight are dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Weighted {
    /// `(value, weight)` by increasing value; the weights sum to 1.
    sorted: Vec<(f64, f64)>,
}

impl Weighted {
    /// Weights are equal if `weights` is empty; `None` if nothing usable is left.
    #[must_use]
    pub fn new(samples: &[f64], weights: &[f64]) -> Option<Self> {
        let weight = |i: usize| {
            if weights.is_empty() {
                1.0
            } else {
                weights.get(i).copied().unwrap_or(0.0)
            }
        };
        let mut sorted: Vec<(f64, f64)> = samples
            .iter()
            .enumerate()
            .map(|(i, &value)| (value, weight(i)))
            .filter(|(value, weight)| value.is_finite() && weight.is_finite() && *weight > 0.0)
            .collect();
        let total: f64 = sorted.iter().map(|s| s.1).sum();
        if sorted.is_empty() || !total.is_finite() || total <= 0.0 {
            return None;
        }
        sorted.iter_mut().for_each(|s| s.1 /= total);
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Self { sorted })
    }

    /// The value below which a share `p` of the weight lies.
    #[must_use]
    pub fn quantile(&self, p: f64) -> f64 {
        let mut sum = 0.0;
        for (value, weight) in &self.sorted {
            sum += weight;
            if sum >= p - 1e-12 {
                return *value;
            }
        }
        self.sorted.last().map_or(f64::NAN, |s| s.0)
    }

    /// Weighted mean.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sorted.iter().map(|(v, w)| v * w).sum()
    }

    /// Weighted standard deviation.
    #[must_use]
    pub fn std(&self) -> f64 {
        let mean = self.mean();
        self.sorted
            .iter()
            .map(|(v, w)| w * (v - mean).powi(2))
            .sum::<f64>()
            .max(0.0)
            .sqrt()
    }

    /// Kernel density with Silverman's bandwidth (1986, eq. 3.31) at the effective number of
    /// samples.
    ///
    /// Kernel mass outside `bounds` is reflected back inside. A density that ends at a bound of the
    /// prior is then not drawn as if it faded out there.
    #[must_use]
    pub fn density(&self, bounds: [f64; 2]) -> Density {
        let effective = 1.0 / self.sorted.iter().map(|s| s.1 * s.1).sum::<f64>();
        let quartiles = (self.quantile(0.75) - self.quantile(0.25)) / 1.34;
        let std = self.std();
        let spread = if quartiles > 0.0 {
            std.min(quartiles)
        } else {
            std
        };
        let smallest = 1e-4
            * if bounds[1] > bounds[0] {
                bounds[1] - bounds[0]
            } else {
                self.mean().abs().max(1e-9)
            };
        let bandwidth = (0.9 * spread * effective.powf(-0.2)).max(smallest);
        Density {
            samples: self.sorted.clone(),
            bandwidth,
            bounds,
        }
    }
}

/// A kernel density.
#[derive(Clone, Debug, PartialEq)]
pub struct Density {
    samples: Vec<(f64, f64)>,
    bandwidth: f64,
    bounds: [f64; 2],
}

impl Density {
    /// The density at `x`; zero outside the bounds.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        let [low, high] = self.bounds;
        if low < high && !(low..=high).contains(&x) {
            return 0.0;
        }
        let kernel = |d: f64| (-0.5 * (d / self.bandwidth).powi(2)).exp();
        let mut sum = 0.0;
        for (value, weight) in &self.samples {
            let mut mass = kernel(x - value);
            if low < high {
                mass += kernel(x - (2.0 * low - value)) + kernel(x - (2.0 * high - value));
            }
            sum += weight * mass;
        }
        sum / (self.bandwidth * (2.0 * std::f64::consts::PI).sqrt())
    }

    /// `count` points `[x, density]` over `domain`.
    #[must_use]
    pub fn points(&self, domain: [f64; 2], count: usize) -> Vec<[f64; 2]> {
        grid(domain, count).map(|x| [x, self.at(x)]).collect()
    }
}

/// `count` evenly spaced values over `domain`, including both ends.
pub(crate) fn grid(domain: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let last = count.max(2) - 1;
    (0..=last).map(move |i| domain[0] + (domain[1] - domain[0]) * i as f64 / last as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_density_has_mass_one_even_at_a_bound() {
        let samples: Vec<f64> = (0..200)
            .map(|i| 0.1 * (f64::from(i) / 200.0).powi(3))
            .collect();
        let density = Weighted::new(&samples, &[]).unwrap().density([0.0, 0.1]);
        let points = density.points([0.0, 0.1], 4001);
        let mass: f64 = points
            .windows(2)
            .map(|p| 0.5 * (p[0][1] + p[1][1]) * (p[1][0] - p[0][0]))
            .sum();
        // Trapezoidal error at this step is far below a part in a thousand.
        assert!((mass - 1.0).abs() < 1e-3, "{mass}");
    }

    #[test]
    fn weights_count() {
        let weighted = Weighted::new(&[1.0, 2.0, f64::NAN, 9.0], &[3.0, 1.0, 1.0, 0.0]).unwrap();
        assert!((weighted.mean() - 1.25).abs() < 1e-12);
        assert_eq!(weighted.quantile(0.5), 1.0);
        assert!((weighted.std() - 0.1875f64.sqrt()).abs() < 1e-12);
        assert!(Weighted::new(&[f64::NAN], &[]).is_none());
    }

    #[test]
    fn equal_samples_give_a_finite_peak() {
        let density = Weighted::new(&[0.05; 10], &[])
            .unwrap()
            .density([-0.1, 0.1]);
        assert!(density.at(0.05).is_finite() && density.at(0.05) > density.at(0.06));
    }
}
