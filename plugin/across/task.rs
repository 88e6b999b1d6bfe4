//! Tasks and what they make.

use std::collections::BTreeMap;
use std::ops::Deref;

use super::Across;
use asid_core::difficulty::Levels;
use asid_core::error::Result;
use asid_core::layout::Layout;
use asid_core::parameter::Parameter;
use asid_core::registry::Settings;
use asid_core::rng::Rng;
use asid_core::scene::Scene;
use asid_core::task::{Commander, Outcome, Outline, Task, TaskSpec};

impl<T> Task for Across<T>
where
    T: Deref + Send + Sync,
    T::Target: Task,
{
    fn spec(&self) -> &TaskSpec {
        self.run(|task| task.spec())
    }

    fn name(&self) -> &str {
        self.name.unwrap_or_else(|| self.run(|task| task.name()))
    }

    fn settings(&self, section: &str, algorithm: &str) -> Settings {
        self.run(|task| task.settings(section, algorithm))
    }

    fn adjusted(&self, values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        // Check the values here, because a plugin need not check them.
        Levels::new(self.difficulty()).with(values)?;
        let task = self.try_run(|task| task.adjusted(values))?;
        Ok(task.map(|inner| self.another(inner)))
    }

    fn under(&self, condition: &str) -> Result<Option<Box<dyn Task>>> {
        let task = self.try_run(|task| task.under(condition))?;
        Ok(task.map(|inner| self.another(inner)))
    }

    fn wear(&self, parameters: &[Parameter], truth: &mut [f64], rng: &mut Rng) {
        let given = truth.to_vec();
        self.run(|task| task.wear(parameters, truth, rng));
        self.border
            .check_finite(&given, truth, "a true value after the task's wear");
    }

    fn stand_in(&self) -> Result<Option<Scene>> {
        self.try_run(|task| task.stand_in())
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        self.try_run(|task| task.place(layout, start, qpos))?;
        self.border
            .finite(start, qpos, "a position of the task's start")
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        let start = self.run(|task| task.locate(signals));
        let own = self.run(|task| task.spec().exploration.start.len());
        self.border.check(if start.len() == own {
            Ok(())
        } else {
            Err(format!(
                "the task's reading of the start has {} values where its start has {own}",
                start.len()
            ))
        });
        self.border
            .check_finite(signals, &start, "the task's reading of the start");
        start
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        let commander = self.try_run(|task| task.commander())?;
        Ok(Box::new(Across::new(commander, self.border)))
    }

    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        let commands = self.try_run(|task| task.attempt(start, action))?;
        let given = [start, action].concat();
        self.border
            .finite(&given, &commands, "a command of the task's attempt")?;
        Ok(commands)
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        let values = self.run(|task| task.metric(readings));
        self.border
            .check_finite(readings, &values, "the task's metric");
        values
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        let outcome = self.run(|task| task.outcome(readings));
        self.border.check_finite(
            readings,
            &[outcome.value, outcome.cost],
            "the task's outcome, metric and cost,",
        );
        outcome
    }

    fn goal_reward(&self, reading: &[f64]) -> Option<f64> {
        self.run(|task| task.goal_reward(reading))
    }

    fn side_view(&self, readings: &[f64]) -> Vec<Outline> {
        self.run(|task| task.side_view(readings))
    }
}

impl<T> Across<T> {
    /// Another task of the same side, under the same name.
    fn another(&self, inner: Box<dyn Task>) -> Box<dyn Task> {
        let mut across = Across::new(inner, self.border);
        across.name = self.name;
        Box::new(across)
    }
}

impl Commander for Across<Box<dyn Commander>> {
    fn reset(&mut self) {
        self.run_mut(|commander| commander.reset());
    }

    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]) {
        self.run_mut(|commander| commander.commands(action, ctrl));
        self.border
            .check_finite(action, ctrl, "a command of the task's exploration");
    }
}
