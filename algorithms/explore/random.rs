//! Random actions: the baseline that uses no information.

use asid_core::explore::{Explored, Explorer, Policy};
use asid_core::registry;
use asid_core::rng::Rng;
use asid_core::task::Coordinate;
use asid_core::{Problem, Result};
use rand::Rng as _;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The random explorer; it has no settings.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RandomExplorer {}

asid_core::register!(ExplorerEntry {
    name: "random",
    about: "independent uniform actions",
    defaults: registry::defaults::<RandomExplorer>,
    meanings: registry::meanings::<RandomExplorer>,
    make: |s| Ok(Box::new(registry::settings::<RandomExplorer>(
        "explorer", s
    )?)),
});

struct RandomPolicy {
    action: Vec<Coordinate>,
    first: Rng,
    rng: Rng,
}

impl Policy for RandomPolicy {
    fn reset(&mut self) {
        self.rng = self.first.clone();
    }

    fn act(&mut self, _step: usize, _reading: &[f64], action: &mut [f64]) -> Result<()> {
        for (a, c) in action.iter_mut().zip(&self.action) {
            *a = c.at(self.rng.random());
        }
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::json!({"kind": "random"})
    }
}

impl Explorer for RandomExplorer {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        _start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let rng = problem.streams.stream("random policy");
        Ok(Explored {
            policy: Box::new(RandomPolicy {
                action: problem.task.exploration().action.clone(),
                first: rng.clone(),
                rng,
            }),
            curve: Vec::new(),
            curve_label: "",
            objective: String::new(),
        })
    }
}
