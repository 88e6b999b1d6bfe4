//! Open-loop plans, made when the episode begins.

use asid_core::explore::{CurvePoint, Explored, Policy};
use asid_core::task::ExplorationProtocol;
use asid_core::{Problem, Result};

use crate::optimise::{Cem, CemSettings};

/// How a plan is parameterised by the numbers to search for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLoop {
    /// Control steps that share an action; more of them leave fewer numbers to search for.
    pub hold: usize,
    /// Initial standard deviation of an action, as a fraction of half its range.
    pub std: f64,
}

impl OpenLoop {
    /// The search over plans, each number between -1 and 1.
    #[must_use]
    pub fn search(&self, protocol: &ExplorationProtocol, settings: CemSettings) -> Cem {
        let n = protocol.horizon.div_ceil(self.hold) * protocol.action.len();
        Cem::new(
            settings,
            &vec![0.0; n],
            &vec![self.std; n],
            &vec![-1.0; n],
            &vec![1.0; n],
        )
    }

    /// Actions of all control steps of a candidate, `horizon x action`, in the task's units.
    #[must_use]
    pub fn actions(&self, protocol: &ExplorationProtocol, candidate: &[f64]) -> Vec<f64> {
        let a = protocol.action.len();
        (0..protocol.horizon)
            .flat_map(|h| {
                candidate[h / self.hold * a..][..a]
                    .iter()
                    .zip(&protocol.action)
                    .map(|(u, c)| c.at((u + 1.0) / 2.0))
            })
            .collect()
    }
}

/// Finds a plan for a start pose.
pub trait Planner: Sync {
    /// Returns the actions of an episode (`horizon x action`, in the task's units) and the mean
    /// objective over the course of the search.
    ///
    /// # Errors
    /// When the engine fails.
    fn plan(&self, problem: &Problem<'_>, start: &[f64]) -> Result<(Vec<f64>, Vec<CurvePoint>)>;
}

/// A plan for the episode's start pose, as the first reading shows it.
pub struct Planned<'a, P> {
    planner: &'a P,
    problem: &'a Problem<'a>,
    plan: Vec<f64>,
    curve: Vec<CurvePoint>,
    planned_for: Option<Vec<f64>>,
}

impl<'a, P: Planner> Planned<'a, P> {
    /// The policy of a planner. It plans at once if the start pose is known.
    ///
    /// # Errors
    /// When planning fails.
    pub fn explored(
        planner: &'a P,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
        objective: String,
    ) -> Result<Explored<'a>> {
        let (plan, curve) = match start {
            Some(start) => planner.plan(problem, start)?,
            None => (Vec::new(), Vec::new()),
        };
        Ok(Explored {
            policy: Box::new(Self {
                planner,
                problem,
                plan,
                curve: Vec::new(),
                planned_for: start.map(<[f64]>::to_vec),
            }),
            curve,
            curve_label: "iteration",
            objective,
        })
    }
}

impl<P: Planner> Policy for Planned<'_, P> {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        if self.planned_for.is_none() {
            let start = self.problem.task.locate(reading);
            (self.plan, self.curve) = self.planner.plan(self.problem, &start)?;
            self.planned_for = Some(start);
        }
        let a = action.len();
        action.copy_from_slice(&self.plan[step * a..(step + 1) * a]);
        Ok(())
    }

    fn is_open_loop(&self) -> bool {
        true
    }

    fn take_curve(&mut self) -> Vec<CurvePoint> {
        std::mem::take(&mut self.curve)
    }

    fn export(&self) -> serde_json::Value {
        let a = self.problem.task.exploration().action.len();
        let actions: Vec<&[f64]> = self.plan.chunks_exact(a).collect();
        serde_json::json!({"kind": "open-loop", "start": self.planned_for, "actions": actions})
    }
}
