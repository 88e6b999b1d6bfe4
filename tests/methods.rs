//! Methods from end to end, on a cart whose mass must be known: the information of an episode
//! decides how close to the goal the cart comes.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // not every test needs all of it
mod cart_support;
#[allow(dead_code)]
mod task_support;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use asid::algorithms::explore::open_loop::{Planned, Planner};
use asid::algorithms::explore::reused::{Plans, Reused};
use asid::algorithms::identify::expected::ExpectedSettings;
use asid::core::explore::{CurvePoint, Explored};
use asid::core::parameter::Scale;
use asid::core::registry::{
    BackendEntry, ExplorerEntry, IdentifierEntry, Settings, SolverEntry, find,
};
use asid::core::{Explorer, Parameter, Problem, Result, Streams};
use asid::pipeline::{self, Method};
use asid::worlds::SimulatedWorld;
use asid_comparison::method::Method as Named;
use asid_statistics::interquartile_mean;
use cart_support::Cart;

/// Number of runs of each method.
const SEEDS: u64 = 6;

/// A search that ends within a few hundredths of the best force. The remaining error is that of the
/// mass.
const SOLVER: &str = "iterations = 6\npopulation = 12\nbelief_samples = 2";

/// Error of the mass in standard deviations of the prior, and distance from the goal, m, of one
/// run.
fn run(name: &str, seed: u64) -> [f64; 2] {
    let method = Named::named(name).unwrap();
    let task = Cart::new();
    let parameters: [Parameter; 1] = [Cart::mass(Scale::Log)];
    let backend = (find::<BackendEntry>("rapier").unwrap().make)().unwrap();
    // Truth, initial state and noise depend on the seed, whatever the method.
    let streams = Streams::new(seed).child("world");
    let truth = [parameters[0].sample(&mut streams.stream("truth"))];
    let mut out = [f64::NAN; 2];
    task_support::on_engine(&*backend, &task, &parameters, seed, |problem, model| {
        let explorer = method.explores().then(|| {
            let entry = find::<ExplorerEntry>(&method.explorer).unwrap();
            (entry.make)(&(entry.defaults)()).unwrap()
        });
        let identifier = method.identifies().then(|| {
            let entry = find::<IdentifierEntry>(&method.identifier).unwrap();
            (entry.make)(&(entry.defaults)()).unwrap()
        });
        let entry = find::<SolverEntry>(&method.solver).unwrap();
        let mut settings = (entry.defaults)();
        settings.extend(SOLVER.parse::<Settings>().unwrap());
        let solver = (entry.make)(&settings).unwrap();
        let signals = problem.signals;
        let mut world =
            SimulatedWorld::new(&task, &**model, &parameters, &truth, signals, streams).unwrap();
        let parts = Method {
            explorer: explorer.as_deref(),
            identifier: identifier.as_deref(),
            solver: &*solver,
            ensemble: None,
            known: None,
            expected: ExpectedSettings::default(),
        };
        let outcome = pipeline::run(problem, parts, &mut world).unwrap();
        let scaled = |x: f64| parameters[0].to_scaled(x);
        let found = outcome.belief.marginals[0].estimate;
        out = [
            (scaled(found) - scaled(truth[0])).abs(),
            outcome.attempt.outcome.value,
        ];
    });
    out
}

/// Errors of the mass and of the goal follow from the information of the episode.
///
/// Under the largest force throughout the episode the cart moves by `C / m` with the largest
/// possible `C`. Random forces largely cancel, to about `1 / sqrt(10)` of it. Without an episode
/// the mass is that of the prior, with a range of a factor of four.
#[test]
fn what_is_explored_for_information_beats_random_actions_and_these_beat_no_episode() {
    let of = |name: &str| {
        let runs: Vec<[f64; 2]> = (0..SEEDS).map(|seed| run(name, seed)).collect();
        [0, 1].map(|i| {
            let values: Vec<f64> = runs.iter().map(|r| r[i]).collect();
            interquartile_mean(&values)
        })
    };
    let [asid, random, dr] = ["asid", "random", "dr"].map(of);
    for (i, what) in ["mass", "goal"].into_iter().enumerate() {
        assert!(
            asid[i] < 0.7 * random[i] && random[i] < 0.5 * dr[i],
            "{what}: asid {}, random {}, dr {}",
            asid[i],
            random[i],
            dr[i]
        );
    }
}

/// Plans for an initial state, and counts how often.
struct Counting(Arc<AtomicU64>);

impl Planner for Counting {
    fn plan(&self, problem: &Problem<'_>, start: &[f64]) -> Result<(Vec<f64>, Vec<CurvePoint>)> {
        self.0.fetch_add(1, Ordering::Relaxed);
        problem.physics_counter.fetch_add(7, Ordering::Relaxed);
        let protocol = problem.task.exploration();
        let numbers = protocol.horizon * protocol.action.len();
        Ok((vec![start[0]; numbers], Vec::new()))
    }
}

impl Explorer for Counting {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        Planned::explored(self, problem, start, String::new())
    }
}

#[test]
fn a_plan_is_made_once_for_a_problem_and_a_first_reading() {
    let task = task_support::task("rod-balancing");
    let backend = (find::<BackendEntry>("rapier").unwrap().make)().unwrap();
    task_support::on_engine(&*backend, &*task, &task.parameters(), 0, |problem, _| {
        let plans = Plans::default();
        let made = Arc::new(AtomicU64::new(0));
        let width = problem.task.exploration().action.len();
        // The first action, and the physics steps that are counted.
        let play = |name: &str, x: f64| {
            let reused = Reused {
                explorer: Box::new(Counting(Arc::clone(&made))),
                plans: &plans,
                name: name.into(),
            };
            let mut reading = vec![0.0; 7];
            (reading[0], reading[3]) = (x, 1.0);
            let mut action = vec![f64::NAN; width];
            let before = problem.physics_steps();
            let mut policy = reused.explore(problem, None).unwrap().policy;
            policy.act(0, &reading, &mut action).unwrap();
            // The plan stays, whatever is read later.
            policy.act(1, &[9.0; 7], &mut action).unwrap();
            (action[0], problem.physics_steps() - before)
        };
        let first = play("a", 0.5);
        assert_eq!(first.1, 7);
        assert_eq!(play("a", 0.5), first, "the same plan at the same cost");
        assert_ne!(play("a", 0.6).0, first.0, "another initial state");
        play("b", 0.5);
        assert_eq!(made.load(Ordering::Relaxed), 3);
    });
}
