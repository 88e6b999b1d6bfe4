//! Identification by relative entropy policy search over the simulator's parameters.

use asid_core::identify::{Assumptions, Identified, Identifier};
use asid_core::registry;
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Problem, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sampling::SamplingSettings;
use super::search::{Budget, Course};
use crate::optimise::RepsSettings;

/// Settings of identification by REPS.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RepsIdentifier {
    /// Refits of the search distribution.
    pub iterations: usize,
    /// Simulations per refit.
    pub population: usize,
    /// Maximum number of restarts, each with twice the population of the one before. The search
    /// restarts while the residuals exceed what noise and a model's usual errors explain.
    pub restarts: usize,
    /// Step size of the search; the reward is the log-likelihood.
    pub reps: RepsSettings,
    /// Standard deviations of the trackers' systematic errors, which are integrated out.
    pub tracker: TrackerPrior,
    /// How the posterior is sampled after the search.
    pub sampling: SamplingSettings,
}

impl Default for RepsIdentifier {
    fn default() -> Self {
        Self {
            iterations: 5,
            population: 64,
            restarts: 1,
            reps: RepsSettings {
                epsilon: 1.5,
                min_eta: 1.0,
            },
            tracker: TrackerPrior::default(),
            sampling: SamplingSettings::default(),
        }
    }
}

asid_core::register!(IdentifierEntry {
    name: "reps",
    about: "relative entropy policy search, then the posterior by emulation of the likelihood",
    defaults: registry::defaults::<RepsIdentifier>,
    meanings: registry::meanings::<RepsIdentifier>,
    make: |s| {
        let identifier: RepsIdentifier = registry::settings("identifier", s)?;
        identifier.course().check()?;
        identifier.reps.check("identifier.reps")?;
        Ok(Box::new(identifier))
    },
});

impl RepsIdentifier {
    fn course(&self) -> Course<'_, RepsSettings> {
        let budget = Budget {
            iterations: self.iterations,
            population: self.population,
            restarts: self.restarts,
        };
        Course {
            budget,
            tracker: self.tracker,
            sampling: &self.sampling,
            rule: &self.reps,
        }
    }
}

impl Identifier for RepsIdentifier {
    fn identify(&self, problem: &Problem<'_>, episodes: &[Episode]) -> Result<Identified> {
        self.course().identify(problem, episodes)
    }
    fn assumes(&self) -> Assumptions {
        self.course().assumes()
    }
}
