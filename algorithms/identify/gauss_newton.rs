//! Identification by Gauss-Newton: damped least squares from several starts in the prior, slopes by
//! batched central differences, and a posterior from the normal matrix.
//!
//! The result names what the readings do not see. A direction of the unknowns is *unseen* where the
//! readings alone leave it a standard deviation as wide as the prior's range. This is an
//! information below 1/12 in prior standard deviations, since the range is sqrt(12) of them wide.
//! Along an unseen direction the posterior is the prior.

use asid_core::identify::{Assumptions, Identified, Identifier, IterationSummary};
use asid_core::posterior::Direction;
use asid_core::registry;
use asid_core::rng::Rng;
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Error, Parameter, Posterior, Problem, Result};
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Likelihood;
use super::beyond;
use super::evidence::Evidence;
use super::models;
use super::sampling;
use super::walk::{self, Walk};
use crate::optimise::GaussNewtonSettings;
use crate::optimise::gauss_newton::{Fit, Space, minimise};
use crate::optimise::require;

/// Information, in prior standard deviations, below which a direction is unseen; see the module
/// documentation.
const UNSEEN: f64 = 1.0 / 12.0;

/// Smallest weight of an unknown that is listed in the name of a direction.
const NAMED: f64 = 0.1;

/// Settings of identification by Gauss-Newton.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GaussNewtonIdentifier {
    /// Settings of the search and of the fits at its end.
    pub gauss_newton: GaussNewtonSettings,
    /// Standard deviations of the trackers' systematic errors, which are integrated out.
    pub tracker: TrackerPrior,
    /// Number of posterior samples that are kept.
    pub samples: usize,
    /// How far the search continues past an end of a prior's range where the posterior piles up, in
    /// widths of the range; 0 keeps it inside.
    pub beyond: f64,
}

impl Default for GaussNewtonIdentifier {
    fn default() -> Self {
        Self {
            gauss_newton: GaussNewtonSettings::default(),
            tracker: TrackerPrior::default(),
            samples: 1000,
            beyond: 1.0,
        }
    }
}

asid_core::register!(IdentifierEntry {
    name: "gauss-newton",
    about: "damped least squares from several starts, posterior from the normal matrix",
    defaults: registry::defaults::<GaussNewtonIdentifier>,
    meanings: registry::meanings::<GaussNewtonIdentifier>,
    make: |s| {
        let identifier: GaussNewtonIdentifier = registry::settings("identifier", s)?;
        identifier.gauss_newton.check("identifier.gauss_newton")?;
        identifier.tracker.check("identifier.tracker")?;
        let samples = identifier.samples;
        let key = "identifier.samples";
        require(samples > 1, key, samples as f64, "at least 2")?;
        let beyond = identifier.beyond;
        let key = "identifier.beyond";
        require(
            beyond >= 0.0 && beyond.is_finite(),
            key,
            beyond,
            "at least 0",
        )?;
        Ok(Box::new(identifier))
    },
});

impl Identifier for GaussNewtonIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let limits = beyond::Limits {
            most: self.beyond,
            correlated: self.gauss_newton.correlated,
        };
        beyond::identify(problem, limits, |problem| self.within(problem, episodes))
    }

    fn assumes(&self) -> Assumptions {
        Assumptions {
            correlated: self.gauss_newton.correlated,
            tracker: self.tracker,
            // Its descent takes differences of single simulations.
            scatter: false,
        }
    }
}

impl GaussNewtonIdentifier {
    /// Identifies within the ranges of the problem's unknowns.
    fn within(
        &self,
        problem: &Problem<'_>,
        episodes: &[Episode],
    ) -> Result<(Identified, Evidence)> {
        let starts = problem.task.exploration().start.len() * episodes.len();
        let settings = &self.gauss_newton;
        let size = settings.batch(problem.parameters.len() + starts);
        let mut likelihood = Likelihood::new(problem, episodes, size)?.with_tracker(self.tracker);
        let models = models::all(problem.parameters)?;
        let units = (settings.iterations + settings.rounds) * models.len();
        problem.progress.begin("identify", units as u64);
        let mut found = Vec::with_capacity(models.len());
        for model in models {
            likelihood.hold(&model);
            found.extend(self.of_model(problem, &mut likelihood, episodes.len())?);
        }
        problem.progress.end();
        if found.is_empty() {
            let message = "nearly every simulation of the episode diverged";
            return Err(Error::Failed(message.into()));
        }
        models::average(problem.parameters, found, settings.correlated)
    }

    /// Fits one model; `None` where nearly every simulation diverged.
    fn of_model(
        &self,
        problem: &Problem<'_>,
        likelihood: &mut Likelihood<'_>,
        episodes: usize,
    ) -> Result<Option<(Identified, Evidence)>> {
        let (low, high) = likelihood.bounds();
        let sought = likelihood.sought();
        let space = Space {
            low: &low,
            high: &high,
            sought,
            readings: likelihood.present(),
        };
        // The same draws for every model, so that models which the data cannot distinguish compare
        // as equal.
        let mut rng = problem.streams.stream("identify");
        let fit = minimise(
            &self.gauss_newton,
            &mut |points| likelihood.residuals(points),
            space,
            &mut rng,
            || problem.progress.advance(1),
        )?;
        let Some(fit) = fit else { return Ok(None) };
        let seen = Seen::new(&fit, sought);
        let drawn = seen.sample(self.samples, &mut rng);
        let values: Vec<Vec<f64>> = drawn.iter().map(|z| likelihood.parameters(z)).collect();
        let narrowing = (0..sought).map(|i| walk::deviation(&drawn, i).clamp(1e-9, 1.0).ln());
        let evidence = Evidence {
            residual: fit.left.as_slice().to_vec(),
            present: space.readings,
            roughness: fit.luck.clone(),
            scatter: fit.scatter,
            narrowing: narrowing.sum(),
        };
        let names: Vec<&str> = likelihood.names();
        let weights = vec![1.0; drawn.len()];
        let posterior = Posterior::from_samples(problem.parameters, values, &weights)
            .with_unseen(seen.unseen(&names));
        let course = fit.course.iter();
        let iterations: Vec<IterationSummary> = course
            .map(|(best, points)| sampling::summary(likelihood, points, *best))
            .chain([sampling::summary(
                likelihood,
                &drawn,
                fit.course.last().map_or(fit.loss(), |c| c.0),
            )])
            .collect();
        let identified = Identified {
            posterior,
            starts: (0..episodes)
                .map(|k| likelihood.start(&fit.point, k))
                .collect(),
            iterations,
            residual: fit.residual,
            misfit: Some(fit.misfit),
            roughness: fit.roughness,
        };
        Ok(Some((identified, evidence)))
    }
}

/// The posterior of a fit, as `count` draws; the fit's leading entries are these parameters in
/// prior standard deviations.
#[must_use]
pub fn posterior_of(fit: &Fit, parameters: &[Parameter], count: usize, rng: &mut Rng) -> Posterior {
    let seen = Seen::new(fit, parameters.len());
    let names: Vec<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
    let value = |z: &Vec<f64>| -> Vec<f64> {
        let pairs = parameters.iter().zip(z);
        pairs.map(|(p, z)| p.from_scaled(*z)).collect()
    };
    let drawn: Vec<Vec<f64>> = seen.sample(count, rng).iter().map(value).collect();
    let weights = vec![1.0; drawn.len()];
    Posterior::from_samples(parameters, drawn, &weights).with_unseen(seen.unseen(&names))
}

/// What the readings determine about the unknowns: information by direction.
struct Seen {
    middle: DVector<f64>,
    at: Vec<f64>,
    directions: DMatrix<f64>,
    /// Information along each direction; zero where the direction is unseen.
    information: Vec<f64>,
}

impl Seen {
    fn new(fit: &Fit, sought: usize) -> Self {
        let see = |v: &f64| if *v < UNSEEN { 0.0 } else { *v };
        // Where every unknown is binary there is no direction.
        let (information, directions) = if sought == 0 {
            (Vec::new(), DMatrix::zeros(0, 0))
        } else {
            let eigen = fit.about(sought).symmetric_eigen();
            let seen = eigen.eigenvalues.iter().map(see).collect();
            (seen, eigen.eigenvectors)
        };
        Self {
            middle: DVector::from_column_slice(&fit.free[..sought]),
            at: fit.point[..sought].to_vec(),
            information,
            directions,
        }
    }

    /// The unseen directions, with the weights of the named unknowns.
    fn unseen(&self, names: &[&str]) -> Vec<Direction> {
        let unseen = (0..self.information.len()).filter(|&k| self.information[k] == 0.0);
        unseen
            .map(|k| {
                let column = self.directions.column(k);
                // The sign of a direction is arbitrary: the largest weight is made positive.
                let sign = column[column.iamax()].signum();
                Direction {
                    weights: names
                        .iter()
                        .zip(column.iter())
                        .filter(|(_, w)| w.abs() >= NAMED)
                        .map(|(name, w)| ((*name).to_owned(), sign * w))
                        .collect(),
                }
            })
            .collect()
    }

    /// Draws from the posterior: a normal distribution by the information, cut to the prior's
    /// range.
    fn sample(&self, count: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let d = self.at.len();
        let matrix = &self.directions
            * DMatrix::from_diagonal(&DVector::from_column_slice(&self.information))
            * self.directions.transpose();
        let bound = Parameter::scaled_bound();
        let inside = |z: &[f64]| z.iter().all(|x| x.abs() <= bound);
        let loss = |z: &[f64]| {
            let off = DVector::from_column_slice(z) - &self.middle;
            0.5 * off.dot(&(&matrix * &off))
        };
        let Some(root) =
            crate::fisher::inverse_above_prior(&(&matrix + DMatrix::identity(d, d))).cholesky()
        else {
            return vec![self.at.clone(); count];
        };
        let walk = Walk {
            shape: root.l(),
            inside: &inside,
            loss: &loss,
        };
        walk.draws(&self.at, count, rng)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fisher::roughness::Roughness;
    use asid_core::Streams;

    fn seen(point: &[f64], information: &[f64]) -> Seen {
        Seen::new(&fit_at(point, information), point.len())
    }

    fn fit_at(point: &[f64], information: &[f64]) -> Fit {
        let n = point.len();
        Fit {
            point: point.iter().map(|x| x.clamp(-1.7, 1.7)).collect(),
            free: point.to_vec(),
            information: DMatrix::from_row_slice(n, n, information),
            left: DVector::zeros(0),
            luck: Roughness::none(0),
            scatter: 0.0,
            residual: 1.0,
            misfit: 1.0,
            roughness: 0.0,
            course: Vec::new(),
        }
    }

    #[test]
    fn an_unseen_sum_or_difference_is_named() {
        // Information 100 about the sum of two unknowns, none about their difference.
        let found = seen(&[0.2, 0.1], &[100.0, 100.0, 100.0, 100.0]);
        let unseen = found.unseen(&["a", "b"]);
        assert_eq!(unseen.len(), 1);
        let [(a, x), (b, y)] = &unseen[0].weights[..] else {
            unreachable!("{unseen:?}")
        };
        assert_eq!([a.as_str(), b.as_str()], ["a", "b"]);
        let root = 0.5_f64.sqrt();
        assert!((x.abs() - root).abs() < 1e-9 && (x + y).abs() < 1e-9);
        // The draws spread over the whole range along the difference only.
        let drawn = found.sample(4000, &mut Streams::new(0).stream("t"));
        let across: Vec<Vec<f64>> = drawn
            .iter()
            .map(|z| vec![z[0] + z[1], z[0] - z[1]])
            .collect();
        assert!((walk::deviation(&across, 0) - 0.1).abs() < 0.02);
        assert!(walk::deviation(&across, 1) > 1.5);
    }

    /// Symptom: `gauss-newton` panicked where every unknown is binary. Cause: a matrix without entries
    /// has no eigenvalues.
    #[test]
    fn without_a_continuous_unknown_every_draw_is_the_only_point() {
        let found = seen(&[], &[]);
        assert!(found.unseen(&[]).is_empty());
        let drawn = found.sample(3, &mut Streams::new(0).stream("t"));
        assert_eq!(drawn, vec![Vec::<f64>::new(); 3]);
        // A start pose that is estimated jointly is no unknown.
        let fit = fit_at(&[0.5], &[4.0]);
        assert!(Seen::new(&fit, 0).information.is_empty());
    }

    #[test]
    fn draws_have_the_deviation_that_the_information_says() {
        let found = seen(&[0.3], &[400.0]);
        assert!(found.unseen(&["a"]).is_empty());
        let drawn = found.sample(4000, &mut Streams::new(1).stream("t"));
        assert!((walk::deviation(&drawn, 0) / 0.05 - 1.0).abs() < 0.1);
    }

    #[test]
    fn a_minimum_outside_of_the_range_piles_up_at_its_edge() {
        // 5 standard deviations outside: the density falls off by a factor e over a fifth of a
        // standard deviation.
        let found = seen(&[1.732 + 0.5], &[100.0]);
        let drawn = found.sample(4000, &mut Streams::new(2).stream("t"));
        let mean = drawn.iter().map(|z| 1.732 - z[0]).sum::<f64>() / 4000.0;
        assert!((mean / 0.0187 - 1.0).abs() < 0.2, "{mean}");
    }
}
