//! Environment steps per second of Fisher exploration with one unknown, and the engine's share of
//! its CPU time.
//!
//! The share is the CPU time of the bare loop divided by that of the Fisher rollout. Both take the
//! same number of physics steps with the same parameters, initial states and commands. In the
//! one-step form the copies take the episode's state at every control step. The bare loop does not
//! do this, so its states drift slightly from theirs.

use std::sync::atomic::AtomicU64;

use anyhow::Result;
use asid_algorithms::fisher::{FisherBatch, FisherSettings, Form};
use asid_core::progress::Silent;
use asid_core::{Backend, Model, Parameter, Problem, Streams, Task};
use serde::Serialize;

use crate::clock::{Cost, timed};
use crate::loops::bare;
use crate::workload::{Episodes, Workload};

/// Episodes of a batch.
const EPISODES: usize = 64;

/// Both forms of the derivative.
const FORMS: [Form; 2] = [Form::OneStep, Form::Trajectory];

/// Measurement for one engine, form and number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct FisherRow {
    engine: String,
    form: &'static str,
    episodes: usize,
    threads: usize,
    rounds: usize,
    /// Control steps of all episodes per second, best of the rounds.
    env_steps_per_s: f64,
    /// Physics steps of all copies per second.
    physics_steps_per_s: f64,
    /// Share of the CPU time that the engine's own stepping takes, on one thread.
    #[serde(skip_serializing_if = "Option::is_none")]
    engine_cpu_share: Option<f64>,
}

/// All rows of one engine.
///
/// # Errors
/// If the engine fails.
pub fn rows(
    backend: &dyn Backend,
    task: &dyn Task,
    model: &dyn Model,
    threads: &[usize],
    rounds: usize,
) -> Result<Vec<FisherRow>> {
    let parameters = task.parameters();
    let episodes = Episodes::random(task, &parameters, EPISODES, 2);
    let (physics, environment) = (AtomicU64::new(0), AtomicU64::new(0));
    let problem = |threads| Problem {
        task,
        model,
        capabilities: backend.capabilities(),
        parameters: &parameters,
        signals: &task.exploration().signals,
        threads,
        streams: Streams::new(1),
        progress: &Silent,
        physics_counter: &physics,
        env_counter: &environment,
    };
    let settings = FORMS.map(|form| FisherSettings {
        form,
        nuisance: false,
        ..FisherSettings::default()
    });
    // Both forms run the same simulations.
    let (theta, copies) = copies(&parameters, settings[0].delta, &episodes.theta);
    let work = Workload::new(task, model.layout(), &parameters, &episodes, &theta, copies)?;
    let mut loops = bare(backend.name(), task.scene(), &work)?;
    let mut out = Vec::new();
    for &threads in threads {
        eprintln!("fisher: {}, threads {threads}", backend.name());
        let problem = problem(threads);
        let mut engine = Cost::ENDLESS;
        let mut best = FORMS.map(|_| Cost::ENDLESS);
        let mut batches = Vec::with_capacity(FORMS.len());
        for settings in &settings {
            batches.push(FisherBatch::new(&problem, settings, EPISODES)?);
        }
        for _ in 0..rounds {
            if threads == 1 {
                loops.rewind()?;
                engine = engine.least(timed(|| loops.run(1)).1);
            }
            for (batch, best) in batches.iter_mut().zip(&mut best) {
                let (done, cost) = timed(|| explore(batch, &episodes));
                done?;
                *best = best.least(cost);
            }
        }
        out.extend(FORMS.iter().zip(best).map(|(form, best)| FisherRow {
            engine: backend.name().to_owned(),
            form: form.name(),
            episodes: EPISODES,
            threads,
            rounds,
            env_steps_per_s: (EPISODES * episodes.horizon) as f64 / best.wall_s,
            physics_steps_per_s: work.steps() as f64 / best.wall_s,
            engine_cpu_share: (threads == 1).then(|| engine.cpu_s / best.cpu_s),
        }));
    }
    Ok(out)
}

/// Runs the episodes of a batch from start to end.
fn explore(batch: &mut FisherBatch<'_>, episodes: &Episodes) -> Result<()> {
    let mut readings = vec![0.0; batch.episodes() * batch.width()];
    let mut reward = vec![0.0; batch.episodes()];
    batch.begin(&episodes.theta, &episodes.starts, &mut readings)?;
    for actions in &episodes.actions {
        batch.step(actions, &mut readings, &mut reward)?;
    }
    Ok(())
}

/// Unknowns of every simulation of a Fisher batch, and the number of simulations per episode.
///
/// Each episode is followed by one copy with a higher and one with a lower value of each unknown.
fn copies(parameters: &[Parameter], delta: f64, theta: &[f64]) -> (Vec<f64>, usize) {
    let d = parameters.len();
    let bound = Parameter::scaled_bound();
    let mut out = Vec::new();
    for own in theta.chunks_exact(d) {
        out.extend_from_slice(own);
        for (i, parameter) in parameters.iter().enumerate() {
            for sign in [1.0, -1.0] {
                let mut copy = own.to_vec();
                let z = parameter.to_scaled(own[i]) + sign * delta;
                copy[i] = parameter.from_scaled(z.clamp(-bound, bound));
                out.extend(copy);
            }
        }
    }
    (out, 1 + 2 * d)
}

/// The rows as a table.
pub fn table(rows: &[FisherRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            vec![
                r.engine.clone(),
                r.form.to_owned(),
                r.threads.to_string(),
                format!("{:.0}", r.env_steps_per_s),
                format!("{:.0}", r.physics_steps_per_s),
                r.engine_cpu_share
                    .map_or_else(String::new, |s| format!("{:.0} %", 100.0 * s)),
            ]
        })
        .collect()
}
