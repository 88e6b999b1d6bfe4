//! `result.json`.

use crate::pipeline::{EpisodeInformation, RunOutcome};
use asid_algorithms::identify::articulation::Articulation;
use asid_core::identify::Identified;
use asid_core::posterior::{Direction, Edge, Marginal};
use asid_core::{Parameter, Posterior};
use serde::Serialize;

use super::session::Session;
use super::tracked_joint::TrackedJoint;
use super::world::RealResult;

/// Layout version of `result.json`.
pub const SCHEMA: u32 = 1;

/// Largest misfit that chance and a slightly underestimated noise explain, in standard deviations
/// of the noise and of the simulator's roughness.
pub const UNEXPLAINED: f64 = 1.5;

/// Text of a value or its deviation: four decimals, or two significant figures if those would be
/// zero.
pub fn figure(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 {
        format!("{x:.1e}")
    } else {
        format!("{x:.4}")
    }
}

/// An unknown: truth where it is known, estimate and interval.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Unknown")]
pub struct ParameterResult {
    name: String,
    unit: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<f64>,
    pub estimate: f64,
    /// Null where the data do not see it: their deviation is infinite, which JSON cannot say.
    pub std: Option<f64>,
    pub interval95: [f64; 2],
    /// End of the prior's range that the posterior piles up at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_edge: Option<Edge>,
    /// What was searched in the end, where the search went on past that end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub searched: Option<[f64; 2]>,
    /// The data do not see it: what is said of it is the prior.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub unidentified: bool,
}

impl ParameterResult {
    /// One for each unknown of a posterior, with its true value where known.
    pub fn all(posterior: &Posterior, truth: Option<&[f64]>) -> Vec<Self> {
        let marginals = posterior.marginals.iter().enumerate();
        marginals
            .map(|(i, m)| Self::new(m, truth.map(|t| t[i])))
            .collect()
    }

    fn new(marginal: &Marginal, truth: Option<f64>) -> Self {
        Self {
            name: marginal.name.clone(),
            unit: marginal.unit.clone(),
            truth,
            estimate: marginal.estimate,
            std: (!marginal.unidentified).then_some(marginal.std),
            interval95: marginal.interval95,
            at_edge: marginal.at_edge,
            searched: marginal.searched,
            unidentified: marginal.unidentified,
        }
    }
}

/// What the exploration tells about the unknowns.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Exploration")]
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

#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Downstream")]
struct DownstreamResult {
    metric: String,
    value: f64,
    success: bool,
}

#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Cost")]
pub struct CostResult {
    pub wall_s: f64,
    pub physics_steps: u64,
    pub env_steps: u64,
}

/// What made a result.
#[derive(Serialize, schemars::JsonSchema)]
pub struct Versions {
    asid: &'static str,
    engine: String,
    git: &'static str,
}

impl Versions {
    /// This program with an engine of this name and version.
    pub fn with(engine: String) -> Self {
        Self {
            asid: env!("CARGO_PKG_VERSION"),
            engine,
            git: env!("ASID_GIT"),
        }
    }

    pub fn of(session: &Session) -> Self {
        Self::with(session.engine.clone())
    }
}

/// What made a result to which several engines contributed.
#[derive(Serialize)]
pub struct Program {
    pub asid: &'static str,
    pub git: &'static str,
}

impl Program {
    /// This program.
    pub const THIS: Self = Self {
        asid: env!("CARGO_PKG_VERSION"),
        git: env!("ASID_GIT"),
    };
}

/// `result.json` of `run`.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Run")]
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
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unseen: Vec<Direction>,
    exploration: ExplorationResult,
    /// Root mean square of the residuals at the best fit, in standard deviations of the noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    residual: Option<f64>,
    /// Root mean square of the residuals at the best fit, in standard deviations of noise and of
    /// the simulator's roughness together; missing where the identifier fits nothing to the
    /// readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    misfit: Option<f64>,
    #[serde(
        rename = "articulation",
        skip_serializing_if = "TrackedJoint::is_missing"
    )]
    #[schemars(with = "Option<Articulation>")]
    pub joint: TrackedJoint,
    downstream: DownstreamResult,
    cost: CostResult,
    versions: Versions,
}

impl RunResult {
    /// The result of a run.
    pub fn new(session: &Session, truth: &[f64], outcome: &RunOutcome, wall_s: f64) -> Self {
        let config = &session.config;
        let identified = outcome.identified.as_ref();
        let episodes = outcome
            .real
            .as_ref()
            .map(|r| std::slice::from_ref(&r.episode));
        Self {
            schema: SCHEMA,
            task: config.task.clone(),
            backend: config.backend.clone(),
            explorer: config.explorer.name.clone(),
            identifier: config.identifier.name.clone(),
            solver: config.solver.name.clone(),
            seed: config.seed,
            real: RealResult::of(session),
            parameters: ParameterResult::all(&outcome.belief, Some(truth)),
            unseen: outcome.belief.unseen.clone(),
            exploration: ExplorationResult::new(
                &outcome.objective,
                &outcome.information,
                outcome.real.as_ref().map_or(0.0, |r| r.contact_fraction),
            ),
            residual: identified.map(|found| found.residual),
            misfit: identified.and_then(|found| found.misfit),
            joint: TrackedJoint::of(session, episodes.unwrap_or_default()),
            downstream: DownstreamResult {
                metric: session.task.downstream().metric.clone(),
                value: outcome.attempt.outcome.value,
                success: outcome.attempt.outcome.success,
            },
            cost: session.cost(wall_s),
            versions: Versions::of(session),
        }
    }
}

/// Text `name: 0.31 ± 0.02 m (95 %: 0.27 to 0.35)` of an unknown.
pub fn parameter_line(m: &Marginal) -> String {
    let [low, high] = m.interval95.map(figure);
    let deviation = if m.unidentified {
        "(not seen by the data)".to_owned()
    } else {
        format!("± {} {}", figure(m.std), m.unit)
    };
    format!(
        "{}: {} {deviation} (95 %: {low} to {high})",
        m.name,
        figure(m.estimate)
    )
}

/// How the range of a task's unknown of this name is widened.
pub fn widen_by_setting(name: &str) -> String {
    format!("widen it with --set parameter.{name}.range=[LOW,HIGH]")
}

/// Caveats of a posterior: where it piles up at an end of the prior's range, and what the data do
/// not determine.
///
/// `widen` tells how the range of an unknown is widened, by its name.
pub fn caveats(
    parameters: &[Parameter],
    belief: &Posterior,
    widen: impl Fn(&str) -> String,
) -> Vec<String> {
    let edges = parameters.iter().zip(&belief.marginals).filter_map(|(p, m)| {
        let end = m.at_edge?;
        let [low, high] = p.range.map(figure);
        let (unit, space) = (&p.unit, if p.unit.is_empty() { "" } else { " " });
        let (name, end) = (&p.name, end.name());
        let piles = format!("{name} piles up at the {end} end of its range, {low} to {high}{space}{unit}");
        let widen = widen(name);
        Some(match m.searched {
            None => format!(
                "{piles}: its true value may lie beyond, where no interval of this prior reaches; if that is \
                 possible, {widen}"
            ),
            Some(searched) => {
                let [low, high] = searched.map(figure);
                let inside = if m.reaches_an_end_of(searched) {
                    format!(", and its interval ends there; if more is possible, {widen}")
                } else {
                    String::new()
                };
                format!("{piles}: the search went on, from {low} to {high}{space}{unit}{inside}")
            }
        })
    });
    let unseen = belief.unseen.iter().map(|direction| {
        let parts: Vec<String> = direction
            .weights
            .iter()
            .map(|(name, w)| format!("{w:+.2} {name}"))
            .collect();
        format!(
            "the data do not see {} (in prior deviations): along it the posterior is the prior",
            parts.join(" ")
        )
    });
    edges.chain(unseen).collect()
}

/// Warning of a fit that leaves more than noise and roughness explain.
pub fn unexplained(found: &Identified) -> Option<String> {
    let misfit = found.misfit.filter(|misfit| *misfit > UNEXPLAINED)?;
    Some(format!(
        "the simulator does not explain the logs: at the best fit the readings are off by {misfit:.1} times \
         their noise and the simulator's roughness together, and the intervals are widened for it; check the noise, \
         the start of the machine and whether something else differs from the scene"
    ))
}
