//! Environment steps per second of a whole training: collection and updates.

use std::sync::atomic::Ordering;

use anyhow::{Context, Result, bail};
use asid_core::registry::{ExplorerEntry, find};
use serde::{Deserialize, Serialize};
use serde_json::json;
use toml::Value;

use super::problem::{Described, EXPLORER};
use super::process::Python;
use super::spread::{ratios, spread};
use super::{Effort, INTERFACES, THREADS};
use crate::clock::timed;

/// Results of one side on one task, one entry per round.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    task: &'static str,
    side: String,
    threads: usize,
    environment_steps: u64,
    env_steps_per_s: Vec<f64>,
    /// CPU time of a step on all threads, ms.
    cpu_ms_per_step: Vec<f64>,
    /// ASID's steps per second divided by this side's, per round.
    asid_by_this: Vec<f64>,
    /// CPU time of this side divided by ASID's, per round; other load on the machine affects it
    /// less.
    cpu_by_asid: Vec<f64>,
    /// Mean return of the episodes before the first and before the last update, nat; absent if not
    /// reported.
    returns: Vec<[Option<f64>; 2]>,
}

/// The result of a training.
#[derive(Deserialize)]
struct Trained {
    seconds: f64,
    cpu_seconds: f64,
    environment_steps: u64,
    returns: Vec<Option<f64>>,
}

/// Trains all sides in turns.
///
/// # Errors
/// If a side fails or takes another number of steps.
pub fn rows(peer: &mut Python, described: &Described, effort: &Effort) -> Result<Vec<Row>> {
    let mut sides = vec!["asid".to_owned()];
    sides.extend(INTERFACES.map(|i| format!("stable-baselines3, `{i}`")));
    let mut trained: Vec<Vec<Trained>> = sides.iter().map(|_| Vec::new()).collect();
    for round in 0..effort.rounds {
        // The sides take turns in going first, so that none always finds a warm machine.
        for turn in 0..sides.len() {
            let side = (turn + round) % sides.len();
            eprintln!(
                "{}, training {}: {}",
                described.name,
                round + 1,
                sides[side]
            );
            let seed = round as u64;
            let one = match side.checked_sub(1) {
                None => ours(described, effort.steps, seed)?,
                Some(i) => peer.ask(&json!({
                    "do": "explore",
                    "problem": described.file,
                    "interface": INTERFACES[i],
                    "steps": effort.steps,
                    "seed": seed,
                }))?,
            };
            trained[side].push(one);
        }
    }
    let steps = trained[0][0].environment_steps;
    for (side, all) in sides.iter().zip(&trained) {
        if let Some(other) = all.iter().find(|t| t.environment_steps != steps) {
            bail!(
                "asid took {steps} environment steps, {side} {}",
                other.environment_steps
            );
        }
    }
    let speeds: Vec<Vec<f64>> = trained
        .iter()
        .map(|all| all.iter().map(|t| steps as f64 / t.seconds).collect())
        .collect();
    let cpu: Vec<Vec<f64>> = trained
        .iter()
        .map(|all| {
            all.iter()
                .map(|t| 1e3 * t.cpu_seconds / steps as f64)
                .collect()
        })
        .collect();
    let ends = |t: &Trained| [t.returns.first(), t.returns.last()].map(|r| r.copied().flatten());
    Ok(sides
        .into_iter()
        .enumerate()
        .map(|(i, side)| Row {
            task: described.name,
            side,
            threads: THREADS,
            environment_steps: steps,
            asid_by_this: ratios(&speeds[0], &speeds[i]),
            cpu_by_asid: ratios(&cpu[i], &cpu[0]),
            env_steps_per_s: speeds[i].clone(),
            cpu_ms_per_step: cpu[i].clone(),
            returns: trained[i].iter().map(ends).collect(),
        })
        .collect())
}

/// One training of ASID, like `asid explore --explorer fisher-ppo`.
fn ours(described: &Described, steps: usize, seed: u64) -> Result<Trained> {
    let entry = find::<ExplorerEntry>(EXPLORER)?;
    let mut settings = (entry.defaults)();
    settings
        .get_mut("ppo")
        .and_then(Value::as_table_mut)
        .context("the explorer has no settings of PPO")?
        .insert("total_steps".into(), Value::Integer(i64::try_from(steps)?));
    let explorer = (entry.make)(&settings)?;
    let file = tempfile::NamedTempFile::new()?;
    let problem = described.problem(seed);
    let before = described.steps.load(Ordering::Relaxed);
    let (done, cost) = timed(|| -> Result<Vec<Option<f64>>> {
        // Without this call, an explorer that can be trained in advance would only play the network
        // it is given.
        if explorer.train(&problem, file.path())? {
            return Ok(Vec::new());
        }
        let explored = explorer.explore(&problem, None)?;
        Ok(explored.curve.iter().map(|p| Some(p.mean)).collect())
    });
    Ok(Trained {
        returns: done?,
        seconds: cost.wall_s,
        cpu_seconds: cost.cpu_s,
        environment_steps: described.steps.load(Ordering::Relaxed) - before,
    })
}

/// Columns of [`table`].
pub const HEADER: [&str; 6] = [
    "task",
    "side",
    "environment steps/s",
    "asid by this",
    "CPU time by asid's",
    "return, first to last update",
];

/// The rows as a table.
pub fn table(rows: &[Row]) -> Vec<Vec<String>> {
    let whole = |x: f64| format!("{x:.0}");
    let ratio = |x: f64| format!("{x:.2}");
    rows.iter()
        .map(|r| {
            let mean = |end: usize| {
                let told: Vec<f64> = r.returns.iter().filter_map(|e| e[end]).collect();
                let sum: f64 = told.iter().sum();
                (!told.is_empty()).then(|| format!("{:.2}", sum / told.len() as f64))
            };
            let returns = match (mean(0), mean(1)) {
                (Some(first), Some(last)) => format!("{first} to {last}"),
                _ => String::new(),
            };
            vec![
                r.task.to_owned(),
                r.side.clone(),
                spread(&r.env_steps_per_s, whole),
                spread(&r.asid_by_this, ratio),
                spread(&r.cpu_by_asid, ratio),
                returns,
            ]
        })
        .collect()
}
