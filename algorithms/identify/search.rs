//! The course of an identification, whatever searches: draw, simulate, learn from
//! the losses, and turn all that was simulated into a posterior.

use asid_core::identify::Identified;
use asid_core::rng::Rng;
use asid_core::{Episode, Error, Problem, Result};

use super::Likelihood;
use super::models;
use super::sampling::{self, Samples, SamplingSettings};
use crate::optimise::{Cem, Reps};

/// A search over points by their losses.
pub trait Search {
    /// Draws `n` points.
    fn ask(&self, n: usize, rng: &mut Rng) -> Vec<Vec<f64>>;
    /// Learns what each cost; a loss is infinite where the simulation diverged.
    fn tell(&mut self, points: &[Vec<f64>], losses: &[f64]);
}

impl Search for Cem {
    fn ask(&self, n: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        Self::ask(self, n, rng)
    }

    fn tell(&mut self, points: &[Vec<f64>], losses: &[f64]) {
        Self::tell(self, points, losses);
    }
}

impl Search for Reps {
    fn ask(&self, n: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        Self::ask(self, n, rng)
    }

    /// The reward is the log-likelihood.
    fn tell(&mut self, points: &[Vec<f64>], losses: &[f64]) {
        let rewards: Vec<f64> = losses.iter().map(|l| -l).collect();
        Self::tell(self, points, &rewards);
    }
}

/// How long a search goes on.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Refits.
    pub iterations: usize,
    /// Simulations a refit.
    pub population: usize,
}

impl Budget {
    /// Checks that there is something to search with.
    ///
    /// # Errors
    /// [`Error::Config`] where there is not.
    pub fn check(self) -> Result<()> {
        let Self {
            iterations,
            population,
        } = self;
        if iterations == 0 || population < 4 {
            return Err(Error::Config {
                key: "identifier".into(),
                message: format!(
                    "needs at least 1 iteration of at least 4 simulations, not {iterations} of {population}"
                ),
            });
        }
        Ok(())
    }
}

/// Searches with what `start` makes of the first mean, deviations and bounds, then
/// samples the posterior.
///
/// Binary unknowns make several models, which are searched one by one and compared; see
/// [`super::models`].
///
/// # Errors
/// When the engine fails or nearly every simulation diverged.
pub fn identify<S: Search>(
    problem: &Problem<'_>,
    episodes: &[Episode],
    budget: Budget,
    settings: &SamplingSettings,
    start: impl Fn(&[f64], &[f64], &[f64], &[f64]) -> S,
) -> Result<Identified> {
    let size = budget.population.max(settings.draws);
    let mut likelihood = Likelihood::new(problem, episodes, size)?;
    let models = models::all(problem.parameters)?;
    let total = (budget.iterations + settings.rounds) * models.len();
    problem.progress.begin("identify", total as u64);
    let mut searched = Vec::with_capacity(models.len());
    for model in models {
        likelihood.hold(&model);
        let (low, high) = likelihood.bounds();
        let n = likelihood.dimension();
        let mut search = start(&vec![0.0; n], &vec![1.0; n], &low, &high);
        // The same draws for every model: where the data tell nothing, so does the comparison.
        let mut rng = problem.streams.stream("identify");
        let mut samples = Samples::default();
        let mut iterations = Vec::new();
        for _ in 0..budget.iterations {
            let points = search.ask(budget.population, &mut rng);
            let residuals = likelihood.residuals(&points)?;
            let losses = samples.add(&points, residuals);
            search.tell(&points, &losses);
            iterations.push(sampling::summary(&likelihood, &points, samples.best_loss()));
            problem.progress.advance(1);
        }
        searched.push((model, samples, iterations, rng));
    }
    let scale = models::Scale::new(
        searched.iter().map(|s| s.1.best_loss()),
        likelihood.present(),
    );
    let mut found = Vec::with_capacity(searched.len());
    for (model, samples, iterations, mut rng) in searched {
        if scale.is_hopeless(samples.best_loss()) {
            problem.progress.advance(settings.rounds as u64);
            continue;
        }
        likelihood.hold(&model);
        found.push(sampling::posterior(
            problem,
            &mut likelihood,
            settings,
            samples,
            iterations,
            &mut rng,
        )?);
    }
    problem.progress.end();
    models::average(problem.parameters, found, likelihood.present())
}
