//! The pipeline: explore, identify, solve, and one zero-shot attempt in the real world.

use std::time::Instant;

use asid_algorithms::fisher::{FisherBatch, FisherSettings, Form};
use asid_algorithms::identify::expected::{ExpectedSettings, expected_deviation};
use asid_core::Model;
use asid_core::error::Result;
use asid_core::explore::{CurvePoint, Explorer};
use asid_core::identify::{Identified, Identifier};
use asid_core::posterior::Posterior;
use asid_core::problem::Problem;
use asid_core::real_world::{Attempt, RealEpisode, RealWorld};
use asid_core::solve::{TaskSolver, Trial};
pub use asid_results::trace::StageCost;

/// Number of samples that represent the prior where nothing was identified.
const PRIOR_SAMPLES: usize = 256;

/// What an episode tells about the unknowns, computed in the simulator.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EpisodeInformation {
    /// Expected posterior standard deviation of each unknown after each control
    /// step, in its unit: `horizon + 1` entries, the prior first.
    pub expected_std: Vec<Vec<f64>>,
    /// Reward of each control step, in the unit [`EpisodeInformation::unit`].
    pub reward: Vec<f64>,
    /// What rewards are counted in.
    pub unit: &'static str,
    /// Form of the derivative by name.
    pub form: &'static str,
    /// `tr (I + I_0)^-1`, prior-scaled.
    pub a_optimality: f64,
    /// `log det (I + I_0)`, prior-scaled.
    pub log_det: f64,
    /// `tr I`, prior-scaled.
    pub trace: f64,
}

/// Information of an episode with these actions (`horizon x action`) at `theta` and `start`. It is
/// computed as for the reward of an explorer that has these settings.
///
/// # Errors
/// When the engine fails.
pub fn episode_information(
    problem: &Problem<'_>,
    settings: &FisherSettings,
    theta: &[f64],
    start: &[f64],
    actions: &[f64],
) -> Result<EpisodeInformation> {
    let mut batch = FisherBatch::new(problem, settings, 1)?;
    let mut reading = vec![0.0; batch.width()];
    batch.begin(theta, start, &mut reading)?;
    let unscale = |scaled: Vec<f64>| -> Vec<f64> {
        scaled
            .iter()
            .zip(problem.parameters)
            .zip(theta)
            .map(|((s, p), x)| p.unscale_std(*x, *s))
            .collect()
    };
    let mut out = EpisodeInformation {
        expected_std: vec![unscale(batch.information()[0].expected_std())],
        unit: settings.objective.unit(),
        form: settings.form.name(),
        ..EpisodeInformation::default()
    };
    let mut reward = [0.0];
    for action in actions.chunks_exact(problem.task.exploration().action.len()) {
        batch.step(action, &mut reading, &mut reward)?;
        out.reward.push(reward[0]);
        out.expected_std
            .push(unscale(batch.information()[0].expected_std()));
    }
    let information = &batch.information()[0];
    out.a_optimality = information.a_optimality();
    out.log_det = information.log_det();
    out.trace = information.trace();
    Ok(out)
}

/// [`episode_information`] with the expected deviations of [`expected_deviation`], which uses an
/// identifier's noise model and, where there are `models`, its simulations in these.
///
/// The replacement takes place where the settings describe what identification sees: trajectory
/// form, start pose estimated jointly, roughness included. They must also ask for at least one fit.
/// The deviations of binary unknowns always follow from the information.
///
/// # Errors
/// When the engine fails.
pub fn episode_information_as(
    problem: &Problem<'_>,
    models: Option<&dyn Model>,
    settings: &FisherSettings,
    expected: &ExpectedSettings,
    theta: &[f64],
    start: &[f64],
    actions: &[f64],
) -> Result<EpisodeInformation> {
    let mut out = episode_information(problem, settings, theta, start, actions)?;
    let as_identified =
        settings.form == Form::Trajectory && settings.nuisance && settings.roughness;
    if as_identified
        && expected.rounds > 0
        && let Some(deviations) = expected_deviation(
            &simulated_in(problem, models),
            expected,
            theta,
            start,
            actions,
        )?
    {
        for (row, better) in out.expected_std.iter_mut().zip(deviations) {
            for (std, x) in row.iter_mut().zip(better) {
                if x.is_finite() {
                    *std = x;
                }
            }
        }
    }
    Ok(out)
}

/// Everything that a run produced.
#[derive(Debug)]
pub struct RunOutcome {
    /// Return over the search for a policy.
    pub curve: Vec<CurvePoint>,
    /// What the curve's `x` counts.
    pub curve_label: &'static str,
    /// Name of the objective of exploration.
    pub objective: String,
    /// The real episode; `None` without exploration.
    pub real: Option<RealEpisode>,
    /// The policy, for the robot's side.
    pub policy: serde_json::Value,
    /// What the real episode tells, at the estimate.
    pub information: EpisodeInformation,
    /// What was identified; `None` without identification.
    pub identified: Option<Identified>,
    /// The belief that the solver was given.
    pub belief: Posterior,
    /// What the solver tried.
    pub trials: Vec<Trial>,
    /// The attempt in the real world.
    pub attempt: Attempt,
    /// Cost by stage.
    pub costs: Vec<StageCost>,
}

/// The algorithms of a run.
///
/// Without an explorer or identifier, the solver gets `known`; where that is absent too it gets the
/// prior (domain randomisation).
#[derive(Clone, Copy)]
pub struct Method<'m> {
    /// How to explore.
    pub explorer: Option<&'m dyn Explorer>,
    /// How to identify.
    pub identifier: Option<&'m dyn Identifier>,
    /// How to solve.
    pub solver: &'m dyn TaskSolver,
    /// The models that share the simulations of an identifier that measures how they scatter, where
    /// errors of the simulator are taken into account.
    pub ensemble: Option<&'m dyn Model>,
    /// Values of the unknowns that the solver is given where nothing is identified.
    pub known: Option<&'m [f64]>,
    /// How the expected deviations are computed. The identifier decides whether readings are
    /// weighted jointly.
    pub expected: ExpectedSettings,
}

/// The problem with its simulations in other models, if there are any.
#[must_use]
pub fn simulated_in<'a>(problem: &Problem<'a>, models: Option<&'a dyn Model>) -> Problem<'a> {
    Problem {
        model: models.unwrap_or(problem.model),
        ..problem.clone()
    }
}

/// Explore, identify, solve and attempt.
///
/// # Errors
/// When an algorithm or the world fails.
pub fn run(
    problem: &Problem<'_>,
    method: Method<'_>,
    world: &mut dyn RealWorld,
) -> Result<RunOutcome> {
    let mut costs = Vec::new();
    let mut clock = Stopwatch::new(problem);

    let mut curve = Vec::new();
    let (mut curve_label, mut objective) = ("", String::new());
    let mut policy_record = serde_json::Value::Null;
    let mut real = None;
    if let Some(explorer) = method.explorer {
        let mut explored = explorer.explore(problem, None)?;
        let episode = world.explore(&mut *explored.policy)?;
        curve = explored.policy.take_curve();
        if curve.is_empty() {
            curve = explored.curve;
        }
        (curve_label, objective) = (explored.curve_label, explored.objective);
        policy_record = explored.policy.export();
        real = Some(episode);
        costs.push(clock.lap("explore"));
    }

    let assumes = method.identifier.map(Identifier::assumes);
    let assumes = assumes.unwrap_or_default();
    let models = method.ensemble.filter(|_| assumes.scatter);
    let mut identified = None;
    if let (Some(identifier), Some(real)) = (method.identifier, &real) {
        let problem = simulated_in(problem, models);
        identified = Some(identifier.identify(&problem, std::slice::from_ref(&real.episode))?);
        costs.push(clock.lap("identify"));
    }
    let belief = match (&identified, method.known) {
        (Some(found), _) => found.posterior.clone(),
        (None, Some(values)) => {
            Posterior::from_samples(problem.parameters, vec![values.to_vec()], &[1.0])
        }
        (None, None) => Posterior::prior(
            problem.parameters,
            PRIOR_SAMPLES,
            &mut problem.streams.stream("prior belief"),
        ),
    };
    let information = match (&real, &identified) {
        (Some(real), Some(found)) => episode_information_as(
            problem,
            models,
            &FisherSettings::default(),
            &ExpectedSettings {
                assumes,
                ..method.expected
            },
            &belief.mean(),
            &found.starts[0],
            &real.actions,
        )?,
        _ => EpisodeInformation::default(),
    };

    let mut solved = method.solver.solve(problem, &belief)?;
    costs.push(clock.lap("solve"));
    let attempt = world.attempt(&mut *solved.policy)?;
    costs.push(clock.lap("attempt"));
    Ok(RunOutcome {
        curve,
        curve_label,
        objective,
        real,
        policy: policy_record,
        information,
        identified,
        belief,
        trials: solved.trials,
        attempt,
        costs,
    })
}

struct Stopwatch<'a> {
    problem: &'a Problem<'a>,
    at: Instant,
    steps: u64,
}

impl<'a> Stopwatch<'a> {
    fn new(problem: &'a Problem<'a>) -> Self {
        Self {
            problem,
            at: Instant::now(),
            steps: problem.physics_steps(),
        }
    }

    fn lap(&mut self, stage: &str) -> StageCost {
        let steps = self.problem.physics_steps();
        let cost = StageCost {
            stage: stage.to_owned(),
            wall_s: self.at.elapsed().as_secs_f64(),
            physics_steps: steps - self.steps,
        };
        (self.at, self.steps) = (Instant::now(), steps);
        cost
    }
}
