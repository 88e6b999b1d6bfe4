//! `result.json`.

use asid_algorithms::identify::articulation::{Articulation, Joint, of_episodes};
use asid_core::pipeline::{EpisodeInformation, RunOutcome};
use asid_core::posterior::Marginal;
use asid_core::{Episode, Result};
use serde::Serialize;

use super::session::Session;
use super::world::RealResult;

/// Layout version.
pub const SCHEMA: u32 = 1;

/// A value or its deviation for people: four decimals, and two figures where these would not show it.
pub fn figure(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 {
        format!("{x:.1e}")
    } else {
        format!("{x:.4}")
    }
}

/// An unknown: truth where it is known, estimate and interval.
#[derive(Serialize)]
pub struct ParameterResult {
    name: String,
    unit: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<f64>,
    pub estimate: f64,
    pub std: f64,
    pub interval95: [f64; 2],
}

impl ParameterResult {
    pub fn new(marginal: &Marginal, truth: Option<f64>) -> Self {
        Self {
            name: marginal.name.clone(),
            unit: marginal.unit.clone(),
            truth,
            estimate: marginal.estimate,
            std: marginal.std,
            interval95: marginal.interval95,
        }
    }
}

/// What the exploration tells about the unknowns.
#[derive(Serialize)]
pub struct ExplorationResult {
    objective: String,
    expected_std: Vec<f64>,
    a_optimality: f64,
    log_det: f64,
    trace: f64,
    contact_fraction: f64,
}

impl ExplorationResult {
    pub fn new(objective: &str, information: &EpisodeInformation, contact_fraction: f64) -> Self {
        Self {
            objective: objective.to_owned(),
            expected_std: information.expected_std.last().cloned().unwrap_or_default(),
            a_optimality: information.a_optimality,
            log_det: information.log_det,
            trace: information.trace,
            contact_fraction,
        }
    }
}

#[derive(Serialize)]
struct DownstreamResult {
    metric: String,
    value: f64,
    success: bool,
}

#[derive(Serialize)]
pub struct CostResult {
    pub wall_s: f64,
    pub physics_steps: u64,
    pub env_steps: u64,
}

/// What made a result.
#[derive(Serialize)]
pub struct Versions {
    asid: &'static str,
    engine: String,
    git: &'static str,
}

impl Versions {
    pub fn of(session: &Session) -> Self {
        Self {
            asid: env!("CARGO_PKG_VERSION"),
            engine: session.engine.clone(),
            git: env!("ASID_GIT"),
        }
    }
}

/// `result.json` of `run`.
#[derive(Serialize)]
pub struct RunResult {
    schema: u32,
    task: String,
    backend: String,
    explorer: String,
    identifier: String,
    solver: String,
    seed: u64,
    real: RealResult,
    parameters: Vec<ParameterResult>,
    exploration: ExplorationResult,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub articulation: Option<Articulation>,
    downstream: DownstreamResult,
    cost: CostResult,
    versions: Versions,
}

impl RunResult {
    /// What came of a run.
    ///
    /// # Errors
    /// When the task's tracked parts do not make sense.
    pub fn new(
        session: &Session,
        truth: &[f64],
        outcome: &RunOutcome,
        wall_s: f64,
    ) -> Result<Self> {
        let config = &session.config;
        let episodes = outcome
            .real
            .as_ref()
            .map(|r| std::slice::from_ref(&r.episode));
        Ok(Self {
            schema: SCHEMA,
            task: config.task.clone(),
            backend: config.backend.clone(),
            explorer: config.explorer.name.clone(),
            identifier: config.identifier.name.clone(),
            solver: config.solver.name.clone(),
            seed: config.seed,
            real: RealResult::of(session),
            parameters: outcome
                .belief
                .marginals
                .iter()
                .zip(truth)
                .map(|(m, &t)| ParameterResult::new(m, Some(t)))
                .collect(),
            exploration: ExplorationResult::new(
                &outcome.objective,
                &outcome.information,
                outcome.real.as_ref().map_or(0.0, |r| r.contact_fraction),
            ),
            articulation: articulation(session, episodes.unwrap_or_default())?,
            downstream: DownstreamResult {
                metric: session.task.downstream().metric.clone(),
                value: outcome.attempt.outcome.value,
                success: outcome.attempt.outcome.success,
            },
            cost: session.cost(wall_s),
            versions: Versions::of(session),
        })
    }
}

/// How the task's two tracked parts are joined, from real episodes; `None` where it has no
/// such parts or there is no episode.
pub fn articulation(session: &Session, episodes: &[Episode]) -> Result<Option<Articulation>> {
    if episodes.is_empty() {
        return Ok(None);
    }
    let layout = session.model.layout();
    of_episodes(&*session.task, layout, &session.signals, episodes)
}

/// `revolute joint (100 %), axis …, origin …` of an articulation, for people.
pub fn articulation_line(found: &Articulation) -> String {
    let (name, p) = match found.joint {
        Joint::Rigid => ("rigid", found.probability[0]),
        Joint::Revolute => ("revolute", found.probability[1]),
        Joint::Prismatic => ("prismatic", found.probability[2]),
    };
    let vector = |v: &[f64; 3]| format!("({:.3}, {:.3}, {:.3})", v[0], v[1], v[2]);
    let mut line = format!("joint of the tracked parts: {name} ({:.1} %)", 100.0 * p);
    if let Some(axis) = &found.axis {
        line += &format!(", axis {}", vector(axis));
    }
    if let Some(origin) = &found.origin {
        line += &format!(" through {} m", vector(origin));
    }
    line
}
