//! Trains the explorer `task-ppo`; its settings and play are in [`asid_learned::task_ppo`].

use asid_core::registry::{self, Settings};
use asid_core::{Error, Problem, Result};
use asid_learned::learning::{LearnedExplorer, Trainer, Training};
use asid_learned::task_ppo::{Reading, TaskPpo};
use rand::Rng as _;

use crate::tracked::{Pay, TrackedEnvironment};
use crate::training::learn_policy;

inventory::submit! {
    Trainer { algorithm: TaskPpo::NAME, train }
}

/// Rewards progress towards the goal.
struct Nearer<'a> {
    problem: &'a Problem<'a>,
    /// Goal reward of the latest reading of each episode.
    worth: Vec<f64>,
}

impl Nearer<'_> {
    fn worth_of(&self, reading: &[f64]) -> f64 {
        self.problem.task.goal_reward(reading).unwrap_or(f64::NAN)
    }
}

impl Pay<Reading> for Nearer<'_> {
    fn begin(&mut self, e: usize, _: &Reading, reading: &[f64], _: &[f64]) {
        self.worth[e] = self.worth_of(reading);
    }

    fn reward(&mut self, e: usize, _: &Reading, reading: &[f64], _: &[f64]) -> f64 {
        let before = self.worth[e];
        self.worth[e] = self.worth_of(reading);
        self.worth[e] - before
    }
}

fn train(problem: &Problem<'_>, settings: &Settings) -> Result<Training> {
    let explorer: TaskPpo = registry::settings("explorer", settings)?;
    let names = problem.task.exploration().channels();
    let width = problem.model.layout().recording(&names)?.width();
    if problem.task.goal_reward(&vec![0.0; width]).is_none() {
        return Err(Error::Config {
            key: "explorer".into(),
            message: format!(
                "`task-ppo` needs a task with a goal for its object; `{}` has none while it is explored",
                problem.task.name()
            ),
        });
    }
    let n = explorer.environments;
    let sights = (0..n)
        .map(|_| Reading::new(problem))
        .collect::<Result<Vec<_>>>()?;
    let observation = explorer.observation(problem)?;
    let len = observation.iter().map(|e| e.len).sum();
    let pay = Nearer {
        problem,
        worth: vec![0.0; n],
    };
    let mut environment = TrackedEnvironment::new(problem, sights, len, pay, "task-ppo episodes")?;
    let seed = problem.streams.stream("task-ppo").random();
    let learned = learn_policy(problem, &mut environment, &explorer.ppo, seed)?;
    Ok(learned.training(observation))
}

#[cfg(test)]
#[allow(clippy::field_reassign_with_default)] // nested settings read best one by one
mod tests {
    use asid_core::BatchEnvironment as _;
    use asid_core::Transition;
    use asid_learned::learning::obtain;

    use super::*;
    use crate::testing::with_problem;

    /// The rewards of an episode add up to its progress towards the goal.
    #[test]
    fn the_return_is_the_way_made() {
        with_problem("sphere-striking", |problem| {
            let sights = vec![
                Reading::new(problem).unwrap(),
                Reading::new(problem).unwrap(),
            ];
            let pay = Nearer {
                problem,
                worth: vec![0.0; 2],
            };
            let len = TaskPpo::default().observation(problem).unwrap();
            let len = len.iter().map(|e| e.len).sum();
            let mut environment =
                TrackedEnvironment::new(problem, sights, len, pay, "test").unwrap();
            let mut transition = Transition::new(2, len);
            environment.reset(&mut transition.observation).unwrap();
            let first = environment.pay.worth.clone();
            let mut total = [0.0; 2];
            for _ in 0..19 {
                environment
                    .step(&[1.0, -1.0, 0.5, -1.0], &mut transition)
                    .unwrap();
                for (t, r) in total.iter_mut().zip(&transition.reward) {
                    *t += r;
                }
            }
            for e in 0..2 {
                let way = environment.pay.worth[e] - first[e];
                assert!((total[e] - way).abs() < 1e-12);
            }
        });
    }

    #[test]
    fn a_task_without_a_goal_says_so() {
        with_problem("rod-balancing", |problem| {
            let mut explorer = TaskPpo::default();
            explorer.policy = "train".into();
            let message = obtain(&explorer, problem).unwrap_err().to_string();
            assert!(message.contains("`rod-balancing` has none"), "{message}");
        });
    }
}
