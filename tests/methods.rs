//! Methods from end to end, on a cart whose mass must be known: the information of an episode
//! decides how close to the goal the cart comes.

#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // not every test needs all of it
mod cart_support;
#[allow(dead_code)]
mod task_support;

use asid::algorithms::identify::expected::ExpectedSettings;
use asid::core::parameter::Scale;
use asid::core::registry::{
    BackendEntry, ExplorerEntry, IdentifierEntry, Settings, SolverEntry, find,
};
use asid::core::{Parameter, Streams};
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
