//! The procedure of an identification, for any search rule: draw, simulate, learn from the losses,
//! and turn all simulations into a posterior.

use asid_core::identify::{Assumptions, Identified};
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Error, Problem, Result};

use super::Likelihood;
use super::beyond;
use super::evidence::Evidence;
use super::models;
use super::sampling::{self, Samples, SamplingSettings};
use crate::optimise::{Search, UpdateRule};

/// Root mean square of the residual in units of noise and roughness together (1 for these alone)
/// above which a search is taken to have ended in a local optimum.
///
/// Worlds whose step, contacts and servos are slightly off leave residuals of 1.0 to 1.4 times the
/// noise (`docs/results.md`), and so at most that in units of noise and roughness. Where the
/// roughness comes in ten independent pieces, a right fit exceeds 1.5 in one of 80 cases
/// (chi-squared).
const LOST: f64 = 1.5;

/// Budget of a search.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Refits of the search distribution.
    pub iterations: usize,
    /// Simulations per refit.
    pub population: usize,
    /// Maximum number of restarts, each with twice the population of the one before.
    pub restarts: usize,
}

impl Budget {
    /// Checks that the budget suffices for a search.
    ///
    /// # Errors
    /// [`Error::Config`] where it does not.
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

/// An identification by a search: its budget, its assumptions about the trackers, the posterior
/// sampling, and the rule that learns from its draws.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a, R> {
    /// Budget of the search.
    pub budget: Budget,
    /// Prior of the trackers' systematic errors.
    pub tracker: TrackerPrior,
    /// How the posterior is sampled after the search.
    pub sampling: &'a SamplingSettings,
    /// The update rule of the search distribution.
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

    /// What it assumes about the readings.
    #[must_use]
    pub fn assumes(&self) -> Assumptions {
        Assumptions {
            correlated: self.sampling.correlated,
            tracker: self.tracker,
            scatter: true,
        }
    }

    /// Searches from the whole prior by the rule, then samples the posterior; goes [`beyond`] the
    /// prior's ranges where the posterior piles up at their ends.
    ///
    /// Binary unknowns make several models, which are searched one by one and compared; see
    /// [`super::models`].
    ///
    /// # Errors
    /// When the engine fails or nearly every simulation diverged.
    pub fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        let limits = beyond::Limits {
            most: self.sampling.beyond,
            correlated: self.sampling.correlated,
        };
        beyond::identify(problem, limits, |problem| self.within(problem, episodes))
    }

    /// Identifies within the ranges of the problem's unknowns.
    ///
    /// A search whose misfit exceeds [`LOST`] restarts with more draws, as in IPOP-CMA-ES (Auger
    /// and Hansen 2005); the fit with the smallest misfit stands.
    fn within(
        &self,
        problem: &Problem<'_>,
        episodes: &[Episode],
    ) -> Result<(Identified, Evidence)> {
        let (mut best, mut evidence) = self.once(problem, episodes, 0)?;
        for restart in 1..=self.budget.restarts {
            // At an end of a range the range itself causes the misfit.
            let marginals = &best.posterior.marginals;
            let lost = best.misfit.is_some_and(|misfit| misfit > LOST);
            if !lost || marginals.iter().any(|m| m.at_edge.is_some()) {
                break;
            }
            let (mut next, its_evidence) = self.once(problem, episodes, restart)?;
            let before = std::mem::take(&mut best.iterations);
            next.iterations.splice(0..0, before);
            if next.misfit < best.misfit {
                (best, evidence) = (next, its_evidence);
            } else {
                best.iterations = next.iterations;
            }
        }
        Ok((best, evidence))
    }

    /// One search with `2^restart` times the population, on random streams of its own.
    fn once(
        &self,
        problem: &Problem<'_>,
        episodes: &[Episode],
        restart: usize,
    ) -> Result<(Identified, Evidence)> {
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
            // The same draws for every model, so that models which the data cannot distinguish
            // compare as equal.
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
        // The best model's roughness says by how much another one is behind.
        searched.sort_by(|a, b| a.1.best_loss().total_cmp(&b.1.best_loss()));
        let mut found: Vec<(Identified, Evidence)> = Vec::with_capacity(searched.len());
        for (model, samples, iterations, mut rng) in searched {
            let hopeless = found.first().is_some_and(|(_, best)| {
                samples
                    .best_residual()
                    .is_none_or(|single| models::is_hopeless(single, best, settings.correlated))
            });
            if hopeless {
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
        models::average(problem.parameters, found, settings.correlated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::emulator::Emulator;
    use crate::optimise::Gaussian;
    use asid_core::Streams;
    use rand_distr::{Distribution, StandardNormal};

    /// Fit to 200 readings of slope 0.5 and noise 1, with roughness that lasts 20 readings. `bias`
    /// moves even readings up and odd ones down, which the unknown does not.
    fn fitted(seed: u64, rough: f64, bias: f64) -> Emulator {
        let (m, run): (usize, usize) = (200, 20);
        let mut rng = Streams::new(seed).stream("luck");
        let mut luck = || -> Vec<f64> {
            let normal = |_| -> f64 { StandardNormal.sample(&mut rng) };
            let pieces: Vec<f64> = (0..m / run).map(normal).collect();
            (0..m).map(|k| rough * pieces[k / run]).collect()
        };
        let mut sensor = Streams::new(seed).stream("noise");
        let real = luck();
        let observed: Vec<f64> = (0..m)
            .map(|k| {
                let noise: f64 = StandardNormal.sample(&mut sensor);
                let side = if k.is_multiple_of(2) { bias } else { -bias };
                real[k] + noise + side
            })
            .collect();
        let region = Gaussian::diagonal(&[0.0], &[1.0], &[-9.0], &[9.0]);
        let mut draws = Streams::new(seed).stream("draws");
        let points: Vec<Vec<f64>> = (0..64).map(|_| region.sample(&mut draws)).collect();
        let residuals: Vec<Vec<f64>> = points
            .iter()
            .map(|x| {
                let all = luck().into_iter().zip(&observed);
                all.map(|(l, o)| 0.5 * x[0] + l - o).collect()
            })
            .collect();
        let p: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let r: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        Emulator::fit(&region, &p, &r, m, false).unwrap()
    }

    /// Symptom: a search that had found the truth of a rough simulator restarted, and
    /// `asid identify` said that the simulator does not explain the logs. Cause: the residual was
    /// compared with the sensors' noise alone, but the machine's own scatter is in it too.
    #[test]
    fn scatter_of_contacts_is_no_lost_search() {
        let fits: Vec<Emulator> = (0..60).map(|seed| fitted(seed, 3.0, 0.0)).collect();
        let rms = |of: fn(&Emulator) -> f64| {
            let squares = fits.iter().map(|f| of(f).powi(2));
            (squares.sum::<f64>() / fits.len() as f64).sqrt()
        };
        // Noise 1 and roughness 3: sqrt(1 + 9).
        let residual = rms(|f| f.residual);
        assert!((residual / 10.0_f64.sqrt() - 1.0).abs() < 0.2, "{residual}");
        let misfit = rms(|f| f.misfit);
        assert!((misfit - 1.0).abs() < 0.2, "{misfit}");
        // Expected: 60 / 80.
        let lost = fits.iter().filter(|f| f.misfit > LOST).count();
        assert!(lost <= 5, "{lost} of 60");
        // What neither noise nor roughness explains: sqrt(1 + 25).
        let misfit = fitted(0, 0.0, 5.0).misfit;
        assert!((misfit / 26.0_f64.sqrt() - 1.0).abs() < 0.1, "{misfit}");
    }
}
