//! Time and accuracy of identification from one log, compared with MuJoCo's own toolbox.

use std::sync::atomic::Ordering;

use anyhow::{Context, Result};
use asid_core::posterior::Marginal;
use asid_core::registry::{ExplorerEntry, IdentifierEntry, Settings, find};
use asid_core::rng::Rng;
use asid_core::{Episode, RealWorld as _, Streams};
use asid_worlds::SimulatedWorld;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::problem::Described;
use super::process::Python;
use super::spread::{ratios, spread};
use super::{Effort, THREADS};
use crate::clock::timed;

/// ASID's identifiers that are compared, if they are built in.
const IDENTIFIERS: [&str; 2] = ["reps", "gauss-newton"];

/// Finite-difference steps of the toolbox: its default, and wide ones in standard deviations of the
/// prior or of the first reading.
///
/// With contact the cost is rough, and the derivative from a tiny step is mostly random.
const DIFFERENCES: [Option<f64>; 2] = [None, Some(0.1)];

/// Explorer whose search gives the logged episode.
const LOGGED_BY: &str = "fisher-cem";

/// Refits of that search: enough to meet the object well, in two seconds instead of six.
const REFITS: i64 = 2;

/// Results of one method on one task, one entry per log.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    task: &'static str,
    method: String,
    threads: usize,
    unit: String,
    seconds: Vec<f64>,
    cpu_seconds: Vec<f64>,
    /// Number of simulations of the episode; absent if they are not counted.
    simulations: Vec<Option<u64>>,
    truth: Vec<f64>,
    /// Smallest and largest value of the prior.
    range: [f64; 2],
    estimate: Vec<f64>,
    interval95: Vec<[f64; 2]>,
    /// Time of the toolbox with its defaults divided by this method's, per log.
    sysid_by_this: Vec<f64>,
    /// The same ratio of CPU times.
    sysid_cpu_by_this: Vec<f64>,
}

/// Result of a method for one log.
#[derive(Deserialize)]
struct Found {
    parameters: Vec<Estimate>,
    seconds: f64,
    cpu_seconds: f64,
    simulations: Option<u64>,
}

#[derive(Deserialize)]
struct Estimate {
    estimate: f64,
    interval95: [f64; 2],
}

/// How a method is called.
enum Method {
    Asid(&'static str),
    Sysid(Option<f64>),
}

impl Method {
    fn name(&self) -> String {
        match self {
            Self::Asid(name) => format!("asid, {name}"),
            Self::Sysid(None) => "mujoco.sysid".into(),
            Self::Sysid(Some(step)) => format!("mujoco.sysid, differences of {step} deviations"),
        }
    }
}

/// Identifies every log with every method, in turns.
///
/// # Errors
/// If a method fails.
pub fn rows(peer: &mut Python, described: &Described, effort: &Effort) -> Result<Vec<Row>> {
    let ours = IDENTIFIERS.into_iter();
    let ours = ours.filter(|name| find::<IdentifierEntry>(name).is_ok());
    let mut methods: Vec<Method> = DIFFERENCES.map(Method::Sysid).into();
    methods.extend(ours.map(Method::Asid));
    let mut found: Vec<Vec<Found>> = methods.iter().map(|_| Vec::new()).collect();
    let mut truths = Vec::new();
    for log in 0..effort.logs {
        let (truth, episode) = logged(described, log as u64)?;
        let path = described.file.with_file_name(format!("log-{log}.csv"));
        episode.write_csv(&path)?;
        for turn in 0..methods.len() {
            let at = (turn + log) % methods.len();
            eprintln!(
                "{}, log {}: {}",
                described.name,
                log + 1,
                methods[at].name()
            );
            let one = match &methods[at] {
                Method::Asid(name) => identified(described, name, &episode, log as u64)?,
                Method::Sysid(difference) => peer.ask(&json!({
                    "do": "identify",
                    "problem": described.file,
                    "log": path,
                    "difference": difference,
                }))?,
            };
            found[at].push(one);
        }
        truths.push(truth);
    }
    let seconds = |all: &[Found]| -> Vec<f64> { all.iter().map(|f| f.seconds).collect() };
    let cpu = |all: &[Found]| -> Vec<f64> { all.iter().map(|f| f.cpu_seconds).collect() };
    // The toolbox with its defaults is the first method.
    let toolbox = (seconds(&found[0]), cpu(&found[0]));
    Ok(methods
        .iter()
        .zip(&found)
        .map(|(method, all)| Row {
            task: described.name,
            method: method.name(),
            threads: THREADS,
            unit: described.parameters[0].unit.clone(),
            seconds: seconds(all),
            cpu_seconds: cpu(all),
            simulations: all.iter().map(|f| f.simulations).collect(),
            truth: truths.clone(),
            range: described.parameters[0].range,
            estimate: all.iter().map(|f| f.parameters[0].estimate).collect(),
            interval95: all.iter().map(|f| f.parameters[0].interval95).collect(),
            sysid_by_this: ratios(&toolbox.0, &seconds(all)),
            sysid_cpu_by_this: ratios(&toolbox.1, &cpu(all)),
        })
        .collect())
}

/// An exploration episode at a true value drawn from the prior, with the trackers' noise.
fn logged(described: &Described, seed: u64) -> Result<(f64, Episode)> {
    let streams = Streams::new(seed).child("real world");
    let mut rng: Rng = streams.stream("truth");
    let truth: Vec<f64> = described
        .parameters
        .iter()
        .map(|p| p.sample(&mut rng))
        .collect();
    let problem = described.problem(seed);
    let settings: Settings = [("iterations".to_owned(), REFITS.into())]
        .into_iter()
        .collect();
    let explorer = (find::<ExplorerEntry>(LOGGED_BY)?.make)(&settings)?;
    let mut explored = explorer.explore(&problem, None)?;
    let mut world = SimulatedWorld::new(
        &*described.task,
        &*described.model,
        &described.parameters,
        &truth,
        &described.task.exploration().signals,
        streams,
    )?;
    let played = world.explore(&mut *explored.policy)?;
    let truth = *truth.first().context("the task has no unknown")?;
    Ok((truth, played.episode))
}

/// One identification by ASID.
fn identified(described: &Described, name: &str, episode: &Episode, seed: u64) -> Result<Found> {
    let identifier = (find::<IdentifierEntry>(name)?.make)(&Settings::new())?;
    let problem = described.problem(seed);
    let before = problem.physics_steps();
    let episodes = std::slice::from_ref(episode);
    let (done, cost) = timed(|| identifier.identify(&problem, episodes));
    let steps = problem.physics_counter.load(Ordering::Relaxed) - before;
    let protocol = described.task.exploration();
    let each = protocol.frames() * problem.substeps(protocol.frame_period)?;
    let of = |m: &Marginal| Estimate {
        estimate: m.estimate,
        interval95: m.interval95,
    };
    Ok(Found {
        parameters: done?.posterior.marginals.iter().map(of).collect(),
        seconds: cost.wall_s,
        cpu_seconds: cost.cpu_s,
        simulations: Some(steps / each as u64),
    })
}

/// Columns of [`table`].
pub const HEADER: [&str; 8] = [
    "task",
    "method",
    "s",
    "simulations",
    "error, % of the prior's range",
    "95 % intervals that hold the truth",
    "time of mujoco.sysid by this",
    "its CPU time by this",
];

/// The rows as a table.
pub fn table(rows: &[Row]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            let pairs = r.truth.iter().zip(&r.estimate);
            let range = r.range[1] - r.range[0];
            let errors: Vec<f64> = pairs.map(|(t, e)| 100.0 * (t - e).abs() / range).collect();
            let held = r.truth.iter().zip(&r.interval95);
            let held = held.filter(|(t, [low, high])| (low..=high).contains(t));
            let simulations: Vec<f64> = r.simulations.iter().flatten().map(|&n| n as f64).collect();
            vec![
                r.task.to_owned(),
                r.method.clone(),
                spread(&r.seconds, |x| format!("{x:.2}")),
                spread(&simulations, |x| format!("{x:.0}")),
                spread(&errors, |x| format!("{x:.2}")),
                format!("{} of {}", held.count(), r.truth.len()),
                spread(&r.sysid_by_this, |x| format!("{x:.2}")),
                spread(&r.sysid_cpu_by_this, |x| format!("{x:.2}")),
            ]
        })
        .collect()
}
