//! Open-loop plans that several runs share.
//!
//! An open-loop plan depends on the problem and on the first reading of the episode. Runs of a
//! comparison that differ in their hidden truth, or in what comes after the episode, often agree in
//! both. Such a plan is made once. The other runs count its physics steps as if they had made it,
//! so that a run has the same result whether it comes first or later.

use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use asid_core::explore::{CurvePoint, Explored, Explorer, Policy};
use asid_core::{Problem, Result};

/// A plan and the cost of making it.
#[derive(Clone)]
struct Plan {
    /// Actions of the episode, `horizon x action`, in the task's units.
    actions: Vec<f64>,
    curve: Vec<CurvePoint>,
    export: serde_json::Value,
    physics_steps: u64,
    env_steps: u64,
}

/// Name of a problem and bits of a first reading.
type Key = (String, Vec<u64>);

/// The place of one plan; locked while the plan is made.
type Place = Arc<Mutex<Option<Plan>>>;

/// Plans by problem and first reading.
#[derive(Default)]
pub struct Plans(Mutex<HashMap<Key, Place>>);

impl Plans {
    fn place(&self, key: Key) -> Place {
        let mut places = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(places.entry(key).or_default())
    }
}

/// An explorer whose open-loop plans are made once.
pub struct Reused<'p> {
    /// The explorer.
    pub explorer: Box<dyn Explorer>,
    /// Where its plans are kept.
    pub plans: &'p Plans,
    /// Name of the explorer and the problem: equal only where all is equal that its plans depend
    /// on, except the first reading.
    pub name: String,
}

impl Explorer for Reused<'_> {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let explored = self.explorer.explore(problem, start)?;
        if start.is_some() || !explored.policy.is_open_loop() {
            return Ok(explored);
        }
        Ok(Explored {
            policy: Box::new(ReusedPolicy {
                inner: explored.policy,
                explorer: self,
                problem,
                plan: None,
            }),
            ..explored
        })
    }
}

/// Plays a plan that is made or found at the first reading.
struct ReusedPolicy<'a> {
    inner: Box<dyn Policy + 'a>,
    explorer: &'a Reused<'a>,
    problem: &'a Problem<'a>,
    plan: Option<Plan>,
}

impl ReusedPolicy<'_> {
    /// The plan for an episode with this first reading.
    fn plan(&mut self, reading: &[f64]) -> Result<Plan> {
        let bits = reading.iter().map(|x| x.to_bits()).collect();
        let place = self
            .explorer
            .plans
            .place((self.explorer.name.clone(), bits));
        let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
        let (physics, env) = (self.problem.physics_counter, self.problem.env_counter);
        if let Some(plan) = &*place {
            physics.fetch_add(plan.physics_steps, Ordering::Relaxed);
            env.fetch_add(plan.env_steps, Ordering::Relaxed);
            return Ok(plan.clone());
        }
        let before = (physics.load(Ordering::Relaxed), env.load(Ordering::Relaxed));
        let protocol = self.problem.task.exploration();
        let width = protocol.action.len();
        let mut actions = vec![0.0; protocol.horizon * width];
        for (step, action) in actions.chunks_exact_mut(width).enumerate() {
            self.inner.act(step, reading, action)?;
        }
        let plan = Plan {
            actions,
            curve: self.inner.take_curve(),
            export: self.inner.export(),
            physics_steps: physics.load(Ordering::Relaxed) - before.0,
            env_steps: env.load(Ordering::Relaxed) - before.1,
        };
        *place = Some(plan.clone());
        Ok(plan)
    }
}

impl Policy for ReusedPolicy<'_> {
    fn reset(&mut self) {
        self.inner.reset();
    }

    fn act(&mut self, step: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        let plan = match self.plan.take() {
            Some(plan) => plan,
            None => self.plan(reading)?,
        };
        let a = action.len();
        action.copy_from_slice(&plan.actions[step * a..(step + 1) * a]);
        self.plan = Some(plan);
        Ok(())
    }

    fn is_open_loop(&self) -> bool {
        true
    }

    fn take_curve(&mut self) -> Vec<CurvePoint> {
        let plan = self.plan.as_mut();
        plan.map_or_else(Vec::new, |plan| std::mem::take(&mut plan.curve))
    }

    fn export(&self) -> serde_json::Value {
        let plan = self.plan.as_ref();
        plan.map_or_else(|| self.inner.export(), |plan| plan.export.clone())
    }
}
