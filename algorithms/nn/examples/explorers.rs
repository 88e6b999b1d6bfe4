//! Compares how much the episodes of each explorer reveal: a table of the expected posterior
//! standard deviation of the first unknown.
//!
//! ```sh
//! cargo run --release --features mujoco,torch --example explorers -- \
//!     rod-balancing mujoco 20 random fisher-cem fisher-ppo fisher-ppo/seed=1
//! ```
//!
//! All explorers get the same start poses and truths, drawn from their ranges, in the engine that
//! they simulate with. They see readings with the trackers' noise. The expected standard deviation
//! is computed at the truth and the true start, with the settings that the reports use, whatever
//! the explorer's own reward.
//!
//! An explorer's settings follow its name:
//! `fisher-ppo/ppo.total_steps=50000/fisher.objective=a-optimal`; `seed` is that of its own random
//! numbers. Ratios are relative to the first explorer of the command line. Standard error shows the
//! return over training and the value of every episode.

// This program exists to print a table on standard output.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::sync::atomic::AtomicU64;
use std::time::Instant;

use asid::algorithms::fisher::FisherSettings;
use asid::core::registry::{BackendEntry, ExplorerEntry, Settings, TaskEntry, find};
use asid::core::{Model, Parameter, Problem, Progress, RealWorld as _, Streams, Task};
use asid::pipeline::episode_information;
use asid::worlds::SimulatedWorld;
use rand::Rng as _;

/// Seed of the episodes, independent of the explorers' own seeds.
const EPISODE_SEED: u64 = 2;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [task, backend, episodes, explorers @ ..] = &arguments[..] else {
        return Err("usage: explorers TASK BACKEND EPISODES EXPLORER[/key=value…]…".into());
    };
    let task = (find::<TaskEntry>(task)?.make)()?;
    let model = (find::<BackendEntry>(backend)?.make)()?.load(task.scene())?;
    let parameters = task.parameters();
    let bench = Bench {
        task: &*task,
        model: &*model,
        parameters: &parameters,
        episodes: episodes.parse()?,
        counter: AtomicU64::new(0),
    };
    println!(
        "| explorer | median std | ratio | geometric mean | ratio | contact | set-up s | s an episode |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut first = None;
    for explorer in explorers {
        let row = bench.row(explorer)?;
        let (median, mean) = (median(&row.stds), geometric_mean(&row.stds));
        let (m, g) = *first.get_or_insert((median, mean));
        println!(
            "| {explorer} | {median:.5} | {:.2} | {mean:.5} | {:.2} | {:.0} % | {:.1} | {:.1} |",
            median / m,
            mean / g,
            100.0 * row.contact,
            row.set_up_s,
            row.episode_s
        );
    }
    Ok(())
}

/// Prints progress as lines on standard error.
struct Notes;

impl Progress for Notes {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _units: u64) {}
    fn note(&self, text: &str) {
        eprintln!("{text}");
    }
    fn end(&self) {}
}

/// The common benchmark of all explorers.
struct Bench<'a> {
    task: &'a dyn Task,
    model: &'a dyn Model,
    parameters: &'a [Parameter],
    episodes: usize,
    counter: AtomicU64,
}

/// Results of one explorer.
struct Row {
    /// Expected standard deviation at the end of each episode.
    stds: Vec<f64>,
    /// Mean share of control steps with contact.
    contact: f64,
    /// Training time, s.
    set_up_s: f64,
    /// Time per episode, including planning, s.
    episode_s: f64,
}

impl Bench<'_> {
    fn problem(&self, seed: u64) -> Problem<'_> {
        Problem {
            task: self.task,
            model: self.model,
            capabilities: asid::core::Capabilities::empty(),
            parameters: self.parameters,
            signals: &self.task.exploration().signals,
            threads: 0,
            streams: Streams::new(seed),
            progress: &Notes,
            physics_counter: &self.counter,
            env_counter: &self.counter,
        }
    }

    fn row(&self, explorer: &str) -> Outcome<Row> {
        let (name, settings, seed) = parse(explorer)?;
        let entry = find::<ExplorerEntry>(name)?;
        let mut all = (entry.defaults)();
        merge(&mut all, settings);
        let explorer = (entry.make)(&all)?;
        let problem = self.problem(seed);
        let clock = Instant::now();
        let mut explored = explorer.explore(&problem, None)?;
        let set_up_s = clock.elapsed().as_secs_f64();
        // A policy without a learning curve plans when its episode begins, for that start.
        let searches = explored.curve.is_empty();
        let clock = Instant::now();
        let streams = Streams::new(EPISODE_SEED);
        let (mut stds, mut contact) = (Vec::new(), 0.0);
        for episode in 0..self.episodes {
            let mut rng = streams.indexed("episode", episode as u64);
            let truth: Vec<f64> = self.parameters.iter().map(|p| p.sample(&mut rng)).collect();
            let start: Vec<f64> = self
                .task
                .exploration()
                .start
                .iter()
                .map(|c| c.at(rng.random()))
                .collect();
            if searches && episode > 0 {
                explored = explorer.explore(&problem, None)?;
            }
            let mut world = SimulatedWorld::new(
                self.task,
                self.model,
                self.parameters,
                &truth,
                problem.signals,
                streams.child(&format!("world {episode}")),
            )?
            .with_exploration_start(start.clone());
            let real = world.explore(&mut *explored.policy)?;
            let told = episode_information(
                &problem,
                &FisherSettings::default(),
                &truth,
                &start,
                &real.actions,
            )?;
            stds.extend(told.expected_std.last().and_then(|s| s.first()));
            eprintln!(
                "episode {episode}: start {start:.3?}, truth {truth:.4?}, std {:.5?}",
                told.expected_std.last()
            );
            contact += real.contact_fraction / self.episodes as f64;
        }
        Ok(Row {
            stds,
            contact,
            set_up_s,
            episode_s: clock.elapsed().as_secs_f64() / self.episodes as f64,
        })
    }
}

/// Name, settings and seed of `name/key=value/…`.
fn parse(explorer: &str) -> Outcome<(&str, Settings, u64)> {
    let (name, rest) = explorer.split_once('/').unwrap_or((explorer, ""));
    let (mut settings, mut seed) = (Settings::new(), 0);
    for pair in rest.split('/').filter(|p| !p.is_empty()) {
        let (key, value) = pair
            .split_once('=')
            .ok_or_else(|| format!("`{pair}` should be key=value"))?;
        if key == "seed" {
            seed = value.parse()?;
            continue;
        }
        let line = format!("{key} = {value}");
        let quoted = || format!("{key} = \"{value}\"");
        let table = line.parse().or_else(|_| quoted().parse::<Settings>())?;
        merge(&mut settings, table);
    }
    Ok((name, settings, seed))
}

/// Merges the entries of `from` over those of `into`.
fn merge(into: &mut Settings, from: Settings) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(a)), toml::Value::Table(b)) => merge(a, b),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

fn median(values: &[f64]) -> f64 {
    let mut v = values.to_vec();
    v.sort_by(f64::total_cmp);
    match v.len() {
        0 => f64::NAN,
        n => (v[(n - 1) / 2] + v[n / 2]) / 2.0,
    }
}

fn geometric_mean(values: &[f64]) -> f64 {
    (values.iter().map(|x| x.ln()).sum::<f64>() / values.len() as f64).exp()
}
