//! Residuals whitened with what predictions scatter by besides the sensors' noise.
//!
//! Scatter is correlated noise of low rank, `S = I + U L U'` in units of the noise. Some of it is each
//! episode's own (how a contact happens to go, where chaos leads). Some is one unknown number for
//! all: the share of an integrator's error that is proportional to its step, an engine's clock.
//! One number takes far less from the logs than one an episode would.

use nalgebra::DMatrix;

use crate::data::Logs;

/// Correlated noise of some residuals: `S^(-1/2) = I - U G U'`.
#[derive(Clone, Debug, Default)]
pub struct Whitening {
    /// Orthonormal directions.
    directions: Vec<Vec<f64>>,
    /// `1 - (1 + variance)^(-1/2)` of each.
    shrink: Vec<f64>,
    /// Whether next to nothing at the start makes a difference that sensors see.
    pub rough: bool,
    /// Residual from which on predictions tell nothing; `None` where all count.
    pub horizon: Option<usize>,
}

impl Whitening {
    /// From directions of scatter in units of the noise, each as long as its deviation:
    /// `S = I + sum v v'`.
    #[must_use]
    pub fn of(scatter: &[Vec<f64>]) -> Self {
        let m = scatter.len();
        if m == 0 {
            return Self::default();
        }
        let gram = DMatrix::from_fn(m, m, |i, j| {
            let pairs = scatter[i].iter().zip(&scatter[j]);
            pairs.map(|(a, b)| a * b).sum::<f64>()
        });
        let eigen = gram.symmetric_eigen();
        let mut whitening = Self::default();
        for (k, &variance) in eigen.eigenvalues.iter().enumerate() {
            if variance < 0.01 {
                continue;
            }
            let length = variance.sqrt();
            let mut direction = vec![0.0; scatter[0].len()];
            for (i, member) in scatter.iter().enumerate() {
                let weight = eigen.eigenvectors[(i, k)] / length;
                for (d, x) in direction.iter_mut().zip(member) {
                    *d += weight * x;
                }
            }
            whitening.directions.push(direction);
            whitening.shrink.push(1.0 - (1.0 + variance).powf(-0.5));
        }
        whitening
    }

    /// Whitens residuals in place; those beyond the horizon become zero.
    pub fn apply(&self, residuals: &mut [f64]) {
        if let Some(horizon) = self.horizon {
            residuals[horizon..].fill(0.0);
        }
        for (direction, shrink) in self.directions.iter().zip(&self.shrink) {
            let along: f64 = direction.iter().zip(&*residuals).map(|(d, r)| d * r).sum();
            if along.is_finite() {
                for (r, d) in residuals.iter_mut().zip(direction) {
                    *r -= shrink * along * d;
                }
            }
        }
    }

    /// Sum of the variances of all directions, in units of the noise.
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.shrink.iter().map(|&s| variance(s)).sum()
    }

    /// The directions of scatter that make it, each as long as its deviation.
    fn scatter(&self) -> Vec<Vec<f64>> {
        let pairs = self.directions.iter().zip(&self.shrink);
        let long = |(d, &s): (&Vec<f64>, &f64)| {
            let length = variance(s).sqrt();
            d.iter().map(|x| length * x).collect()
        };
        pairs.map(long).collect()
    }

    /// Number of directions in which predictions scatter.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.shrink.len()
    }

    /// Number of directions that tell next to nothing: scatter beyond three times the noise.
    #[must_use]
    pub fn lost(&self) -> usize {
        self.shrink.iter().filter(|s| **s > 0.68).count()
    }
}

/// Variance of a direction that is shrunk by a share.
fn variance(shrink: f64) -> f64 {
    (1.0 - shrink).powi(-2) - 1.0
}

/// What the predictions of some logs scatter by: each episode on its own, and all of them
/// together.
#[derive(Clone, Debug, Default)]
pub struct Scattering {
    /// One an episode; none for noise alone.
    pub episodes: Vec<Whitening>,
    /// Of what is the same for all episodes, over their whitened residuals one after the other.
    shared: Whitening,
}

impl Scattering {
    /// Of episodes that scatter on their own, and of directions over the plain residuals of all
    /// `logs` that have one coefficient in all of them.
    #[must_use]
    pub fn new(logs: &Logs, episodes: Vec<Whitening>, shared: Vec<Vec<f64>>) -> Self {
        let mut all = Self {
            episodes,
            shared: Whitening::default(),
        };
        let whitened = shared.into_iter().map(|mut direction| {
            all.apply(logs, &mut direction);
            direction
        });
        all.shared = Whitening::of(&whitened.collect::<Vec<_>>());
        all
    }

    /// Whitens the residuals of all episodes in place.
    pub fn apply(&self, logs: &Logs, residuals: &mut [f64]) {
        for (e, whitening) in self.episodes.iter().enumerate() {
            whitening.apply(&mut residuals[logs.offset(e)..logs.offset(e + 1)]);
        }
        self.shared.apply(residuals);
    }

    /// That of some episodes of `logs`.
    #[must_use]
    pub fn some(&self, logs: &Logs, which: &[usize]) -> Self {
        if self.episodes.is_empty() {
            return Self::default();
        }
        let part = |direction: Vec<f64>| -> Vec<f64> {
            let own = which.iter().map(|&e| logs.offset(e)..logs.offset(e + 1));
            own.flat_map(|range| direction[range].to_vec()).collect()
        };
        let shared: Vec<Vec<f64>> = self.shared.scatter().into_iter().map(part).collect();
        Self {
            episodes: which.iter().map(|&e| self.episodes[e].clone()).collect(),
            shared: Whitening::of(&shared),
        }
    }

    /// Sum of the variances of all directions, in units of the noise.
    #[must_use]
    pub fn variance(&self) -> f64 {
        let own: f64 = self.episodes.iter().map(Whitening::variance).sum();
        own + self.shared.variance()
    }

    /// Whether next to nothing at the start makes a difference in some episode.
    #[must_use]
    pub fn is_rough(&self) -> bool {
        self.episodes.iter().any(|w| w.rough)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitened_residuals_have_the_identity_for_covariance() {
        // S = I + (8 + 8) u u'.
        let u = [0.6, 0.8, 0.0];
        let member = |s: f64| u.iter().map(|x| s * x).collect::<Vec<f64>>();
        let along = 8.0_f64.sqrt();
        let whitening = Whitening::of(&[member(along), member(-along)]);
        assert_eq!(whitening.rank(), 1);
        let mut along = u;
        whitening.apply(&mut along);
        let length = along.iter().map(|x| x * x).sum::<f64>();
        assert!((length - 1.0 / 17.0).abs() < 1e-12, "{length}");
        let mut across = [-0.8, 0.6, 2.0];
        whitening.apply(&mut across);
        assert!((across[0] + 0.8).abs() < 1e-12 && across[2] == 2.0);
    }

    #[test]
    fn residuals_beyond_the_horizon_do_not_count() {
        let mut whitening = Whitening::of(&[vec![3.0, 0.0, 0.0, 0.0]]);
        whitening.horizon = Some(2);
        let mut residuals = [1.0, 2.0, 300.0, 400.0];
        whitening.apply(&mut residuals);
        assert!((residuals[0] - 0.1_f64.sqrt()).abs() < 1e-12);
        assert_eq!(residuals[1..], [2.0, 0.0, 0.0]);
    }

    #[test]
    fn one_number_for_all_episodes_leaves_what_differs_between_them() {
        // Two episodes of two readings, which an error moves along (3, 4) in either.
        let [error, none] = [[30.0, 40.0], [0.0; 2]];
        let own = [
            Whitening::of(&[error.to_vec()]),
            Whitening::of(&[error.to_vec()]),
        ];
        let shared = Whitening::of(&[[error, error].concat()]);
        let differs = [error, error.map(|x: f64| -x)].concat();
        let mut left = differs.clone();
        own[0].apply(&mut left[..2]);
        own[1].apply(&mut left[2..]);
        let square = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>();
        assert!(square(&left) < 2.0);
        let mut left = differs.clone();
        shared.apply(&mut left);
        assert_eq!(left, differs);
        let mut left = [error, none].concat();
        shared.apply(&mut left);
        // Half of it is common to both, half is not.
        assert!((square(&left) / 1250.0 - 1.0).abs() < 1e-3, "{left:?}");
    }

    #[test]
    fn parts_of_a_scatter_are_the_scatter_of_parts() {
        let whitening = Whitening::of(&[vec![1.0, 2.0, -1.0], vec![0.5, 0.0, 3.0]]);
        let again = Whitening::of(&whitening.scatter());
        let (mut a, mut b) = ([1.0, -2.0, 0.3], [1.0, -2.0, 0.3]);
        whitening.apply(&mut a);
        again.apply(&mut b);
        for (x, y) in a.iter().zip(&b) {
            assert!((x - y).abs() < 1e-12, "{a:?} {b:?}");
        }
        // Covariance of the second and third alone: [1 + 4, -2; -2, 1 + 1 + 9].
        let cut: Vec<Vec<f64>> = whitening
            .scatter()
            .iter()
            .map(|d| d[1..].to_vec())
            .collect();
        let part = Whitening::of(&cut);
        let mut r = [1.0, 1.0];
        part.apply(&mut r);
        let square = r[0] * r[0] + r[1] * r[1];
        // (1, 1) S^-1 (1, 1)' with determinant 51.
        assert!(
            (square - (11.0 + 5.0 + 4.0) / 51.0).abs() < 1e-12,
            "{square}"
        );
    }
}
