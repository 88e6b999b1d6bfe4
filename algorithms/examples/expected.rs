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
//! is one unknown in one episode: truth, estimate and actual deviation, then two ratios of expected
//! to actual deviation. The expectations are:
//!
//! 1. the one that rewards explorers,
//! 2. the one by the noise model of identification with the identifier's assumptions, as
//!    `exploration.expected_std` of a run; NaN where there is no fit, and for binary unknowns. With
//!    `reps/sampling.correlated=true` this one and the identifier weigh readings by the whole
//!    covariance.
//!
//! The table gives the medians of both ratios, the quartiles of the second, and in how many episodes
//! the 95 % interval holds the truth.

// This program exists to print a table on standard output.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::sync::atomic::AtomicU64;

use asid::algorithms::fisher::{FisherBatch, FisherSettings};
use asid::algorithms::identify::expected::{ExpectedSettings, expected_deviation};
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
    let mut ratios: Vec<Vec<[f64; 2]>> = vec![Vec::new(); parameters.len()];
    let mut held = vec![0; parameters.len()];
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
        let settings = ExpectedSettings {
            assumes: identifier.assumes(),
            ..ExpectedSettings::default()
        };
        let expected = expected_deviation(&problem, &settings, &theta, start, &real.actions)?;
        let last = expected.as_ref().and_then(|rows| rows.last());
        for (i, (p, m)) in parameters
            .iter()
            .zip(&found.posterior.marginals)
            .enumerate()
        {
            let ways = [
                p.unscale_std(theta[i], paid[i]) / m.std,
                last.map_or(f64::NAN, |row| row[i]) / m.std,
            ];
            println!(
                "{seed} {}: truth {:.4e} estimate {:.4e} std {:.2e} ({:.2} of the prior's) off {:.2} std, residual {:.2}, roughness {:.2}: {:.2} {:.2}",
                p.name,
                truth[i],
                m.estimate,
                m.std,
                m.std / p.unscale_std(m.estimate, 1.0),
                (m.estimate - truth[i]) / m.std,
                found.residual,
                found.roughness,
                ways[0],
                ways[1]
            );
            ratios[i].push(ways);
            held[i] += usize::from(m.interval95[0] <= truth[i] && truth[i] <= m.interval95[1]);
        }
    }
    println!(
        "| unknown | n | as paid | as identified (quartiles) | 95 % holds |\n|---|---|---|---|---|"
    );
    for ((p, ratios), held) in parameters.iter().zip(&ratios).zip(&held) {
        let of = |way: usize, share: f64| quantile(ratios.iter().map(|r| r[way]), share);
        println!(
            "| {} | {} | {:.2} | {:.2} ({:.2} to {:.2}) | {held} |",
            p.name,
            ratios.len(),
            of(0, 0.5),
            of(1, 0.5),
            of(1, 0.25),
            of(1, 0.75)
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

/// Interpolates between the two nearest of the finite values.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else {
        return f64::NAN;
    };
    let at = share * last as f64;
    let (below, above) = (values[at.floor() as usize], values[at.ceil() as usize]);
    below + (at - at.floor()) * (above - below)
}
