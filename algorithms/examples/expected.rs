//! Compares the posterior standard deviation that an episode is expected to give with the one that
//! it gives.
//!
//! The program draws truths from the prior and prints expected over actual deviation for every
//! unknown of a task, in the engine that identifies.
//!
//! ```sh
//! cargo run --release --features mujoco --example expected -- \
//!     sphere-patches mujoco 30 fisher-cem/population=16 reps 0
//! ```
//!
//! Settings follow a name: `reps/sampling.rounds=6`. The last argument is the first seed. Each line
//! is one unknown in one episode: truth, estimate and actual deviation, then three ratios of
//! expected to actual deviation. The expectations are:
//!
//! 1. the one that rewards explorers,
//! 2. the noise model of identification, reading by reading,
//! 3. the same with the correlation of the roughness.
//!
//! The table gives the median of each ratio.

// This program exists to print a table on standard output.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::sync::atomic::AtomicU64;

use asid::algorithms::fisher::expected::{ExpectedSettings, expected_deviation};
use asid::algorithms::fisher::{FisherBatch, FisherSettings};
use asid::core::identify::Assumptions;
use asid::core::progress::Silent;
use asid::core::registry::{
    AlgorithmEntry, BackendEntry, Entry, ExplorerEntry, IdentifierEntry, Settings, TaskEntry, find,
};
use asid::core::{Problem, RealWorld as _, Streams, Task};
use asid::worlds::SimulatedWorld;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [task, backend, episodes, explorer, identifier, first] = &arguments[..] else {
        return Err("usage: expected TASK BACKEND EPISODES EXPLORER[/key=value…] IDENTIFIER[/key=value…] SEED".into());
    };
    let task = (find::<TaskEntry>(task)?.make)()?;
    let model = (find::<BackendEntry>(backend)?.make)()?.load(task.scene())?;
    let parameters = task.parameters();
    let (name, settings) = configured::<dyn asid::core::Explorer>(&*task, "explorer", explorer)?;
    let explorer = (find::<ExplorerEntry>(name)?.make)(&settings)?;
    let (name, settings) =
        configured::<dyn asid::core::Identifier>(&*task, "identifier", identifier)?;
    let identifier = (find::<IdentifierEntry>(name)?.make)(&settings)?;
    let first: u64 = first.parse()?;
    let counter = AtomicU64::new(0);
    let mut ratios: Vec<Vec<[f64; 3]>> = vec![Vec::new(); parameters.len()];
    for seed in first..first + episodes.parse::<u64>()? {
        let problem = Problem {
            task: &*task,
            model: &*model,
            capabilities: asid::core::Capabilities::empty(),
            parameters: &parameters,
            signals: &task.exploration().signals,
            threads: 0,
            streams: Streams::new(seed),
            progress: &Silent,
            physics_counter: &counter,
            env_counter: &counter,
        };
        let mut chance = Streams::new(seed).stream("truths");
        let truth: Vec<f64> = parameters.iter().map(|p| p.sample(&mut chance)).collect();
        let streams = Streams::new(seed).child("worlds");
        let signals = &task.exploration().signals;
        let mut world =
            SimulatedWorld::new(&*task, &*model, &parameters, &truth, signals, streams)?;
        let mut policy = explorer.explore(&problem, None)?.policy;
        let real = world.explore(&mut *policy)?;
        let found = identifier.identify(&problem, std::slice::from_ref(&real.episode))?;
        let (theta, start) = (found.posterior.mean(), &found.starts[0]);
        let mut batch = FisherBatch::new(&problem, &FisherSettings::default(), 1)?;
        let (mut reading, mut reward) = (vec![0.0; batch.width()], [0.0]);
        batch.begin(&theta, start, &mut reading)?;
        for action in real.actions.chunks_exact(task.exploration().action.len()) {
            batch.step(action, &mut reading, &mut reward)?;
        }
        let paid = batch.information()[0].expected_std();
        let [alone, together] = [false, true].map(|correlated| {
            let settings = ExpectedSettings {
                assumes: Assumptions {
                    correlated,
                    ..identifier.assumes()
                },
                ..ExpectedSettings::default()
            };
            expected_deviation(&problem, &settings, &theta, start, &real.actions)
        });
        let (alone, together) = (alone?, together?);
        let last = |rows: &Option<Vec<Vec<f64>>>, i: usize| {
            rows.as_ref()
                .and_then(|r| r.last())
                .map_or(f64::NAN, |r| r[i])
        };
        for (i, (p, m)) in parameters
            .iter()
            .zip(&found.posterior.marginals)
            .enumerate()
        {
            let ways = [
                p.unscale_std(theta[i], paid[i]) / m.std,
                last(&alone, i) / m.std,
                last(&together, i) / m.std,
            ];
            println!(
                "{seed} {}: truth {:.4e} estimate {:.4e} std {:.2e} ({:.2} of the prior's) off {:.2} std, residual {:.2}, roughness {:.2}: {:.2} {:.2} {:.2}",
                p.name,
                truth[i],
                m.estimate,
                m.std,
                m.std / p.unscale_std(m.estimate, 1.0),
                (m.estimate - truth[i]) / m.std,
                found.residual,
                found.roughness,
                ways[0],
                ways[1],
                ways[2]
            );
            ratios[i].push(ways);
        }
    }
    println!("| unknown | n | as paid | reading by reading | correlated |\n|---|---|---|---|---|");
    for (p, ratios) in parameters.iter().zip(&ratios) {
        let [a, b, c] = [0, 1, 2].map(|k| median(ratios.iter().map(|r| r[k])));
        println!(
            "| {} | {} | {a:.2} | {b:.2} | {c:.2} |",
            p.name,
            ratios.len()
        );
    }
    Ok(())
}

/// Name and settings of `name/key=value…`: the defaults, overridden by the task's, then by the
/// given ones.
fn configured<'n, T: ?Sized + 'static>(
    task: &dyn Task,
    section: &str,
    text: &'n str,
) -> Outcome<(&'n str, Settings)>
where
    AlgorithmEntry<T>: Entry,
{
    let mut parts = text.split('/');
    let name = parts.next().unwrap_or_default();
    let mut settings = (find::<AlgorithmEntry<T>>(name)?.defaults)();
    merge(&mut settings, task.settings(section, name));
    for part in parts {
        let (key, value) = part.split_once('=').ok_or("settings are key=value")?;
        let mut table = &mut settings;
        let mut keys: Vec<&str> = key.split('.').collect();
        let last = keys.pop().unwrap_or_default();
        for key in keys {
            let inner = table.get_mut(key).and_then(|v| v.as_table_mut());
            table = inner.ok_or_else(|| format!("there is no {key}"))?;
        }
        let value = format!("x = {value}").parse::<Settings>()?.remove("x");
        table.insert(last.into(), value.ok_or("no value")?);
    }
    Ok((name, settings))
}

fn merge(into: &mut Settings, from: Settings) {
    for (key, value) in from {
        if let (Some(inner), Some(more)) = (
            into.get_mut(&key).and_then(|v| v.as_table_mut()),
            value.as_table(),
        ) {
            merge(inner, more.clone());
        } else {
            into.insert(key, value);
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}
