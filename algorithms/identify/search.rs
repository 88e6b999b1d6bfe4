//! The course of an identification, whatever searches: draw, simulate, learn from
//! the losses, and turn all that was simulated into a posterior.

use asid_core::identify::{Assumptions, Identified};
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Error, Problem, Result};

use super::Likelihood;
use super::beyond;
use super::models;
use super::sampling::{self, Samples, SamplingSettings};
use crate::optimise::{Search, UpdateRule};

/// Root mean square of the whitened residual, 1 for noise alone, above which a search is taken to have ended in a
/// place where the likelihood is locally good: worlds whose step, contacts and servos are a little off leave 1.0
/// to 1.4 (`docs/results.md`), and searches that ended wrong on the patches 2 to 7.
const LOST: f64 = 1.5;

/// How long a search goes on.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Refits.
    pub iterations: usize,
    /// Simulations a refit.
    pub population: usize,
    /// Searches anew at most, each of twice the population of the one before.
    pub restarts: usize,
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
            ..
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

/// An identification by a search: how long it goes on, what it assumes of the trackers, what follows it, and the
/// rule that learns from its draws.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a, R> {
    /// How long the search goes on.
    pub budget: Budget,
    /// Systematic errors of the trackers.
    pub tracker: TrackerPrior,
    /// The posterior after the search.
    pub sampling: &'a SamplingSettings,
    /// The rule.
    pub rule: &'a R,
}

impl<R: UpdateRule> Course<'_, R> {
    /// Checks all but the rule.
    ///
    /// # Errors
    /// [`Error::Config`] naming the setting.
    pub fn check(&self) -> Result<()> {
        self.budget.check()?;
        self.tracker.check("identifier.tracker")?;
        self.sampling.check()
    }

    /// What it assumes of the readings.
    #[must_use]
    pub fn assumes(&self) -> Assumptions {
        Assumptions {
            correlated: self.sampling.correlated,
            tracker: self.tracker,
        }
    }

    /// Searches by the rule from the whole prior on, then samples the posterior; [`beyond`] the prior's
    /// ranges where it piles up at their ends.
    ///
    /// Binary unknowns make several models, which are searched one by one and compared; see
    /// [`super::models`].
    ///
    /// # Errors
    /// When the engine fails or nearly every simulation diverged.
    pub fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        beyond::identify(problem, self.sampling.beyond, |problem| {
            self.within(problem, episodes)
        })
    }

    /// The same inside the ranges of the problem's unknowns. A search whose fit misses the readings by far begins anew with
    /// more draws, as in IPOP-CMA-ES (Auger and Hansen 2005); the fit that misses least stands.
    fn within(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let mut best = self.once(problem, episodes, 0)?;
        for restart in 1..=self.budget.restarts {
            // At an end of a range the misfit is the range's.
            let marginals = &best.posterior.marginals;
            if best.residual <= LOST || marginals.iter().any(|m| m.at_edge.is_some()) {
                break;
            }
            let mut next = self.once(problem, episodes, restart)?;
            let before = std::mem::take(&mut best.iterations);
            next.iterations.splice(0..0, before);
            if next.residual < best.residual {
                best = next;
            } else {
                best.iterations = next.iterations;
            }
        }
        Ok(best)
    }

    /// One search, of twice the draws of the one before, from streams of its own.
    fn once(
        &self,
        problem: &Problem<'_>,
        episodes: &[Episode],
        restart: usize,
    ) -> Result<Identified> {
        let (budget, settings) = (self.budget, self.sampling);
        let population = budget.population << restart;
        let size = population.max(settings.draws);
        let mut likelihood = Likelihood::new(problem, episodes, size)?.with_tracker(self.tracker);
        let models = models::all(problem.parameters)?;
        let total = (budget.iterations + settings.rounds) * models.len();
        problem.progress.begin("identify", total as u64);
        let mut searched = Vec::with_capacity(models.len());
        for model in models {
            likelihood.hold(&model);
            let (low, high) = likelihood.bounds();
            let n = likelihood.dimension();
            let mut search =
                Search::new(self.rule.clone(), &vec![0.0; n], &vec![1.0; n], &low, &high);
            // The same draws for every model: where the data tell nothing, so does the comparison.
            let mut rng = problem.streams.indexed("identify", restart as u64);
            let mut samples = Samples::default();
            let mut iterations = Vec::new();
            for _ in 0..budget.iterations {
                let points = search.ask(population, &mut rng);
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
}
