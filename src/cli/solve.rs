//! `asid solve`: the task action for a posterior, and its commands for a real machine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use asid_core::real_world::Attempt;
use asid_core::registry::{SolverEntry, find};
use asid_core::{Control, Episode, Error, Posterior, Rollout};
use asid_results::naming::joined;
use serde::Serialize;

use super::options::{Algorithms, Common, Simulator, Worlds};
use super::output::{OutFolder, write_json};
use super::result::{CostResult, ParameterResult, SCHEMA, Versions};
use super::session::Session;
use super::settings::Stage;
use super::stage::{self, Named};
use super::{interrupt, shell, trace};

/// The name of the prior in place of a folder.
const PRIOR: &str = "prior";

/// Number of samples that represent the prior.
const PRIOR_SAMPLES: usize = 256;

/// Number of samples of the belief at which the chosen action is tried.
const TRIES: usize = 16;

/// Arguments of `solve`.
#[derive(clap::Args)]
#[command(after_help = "\
Where the object lies before the attempt is given by --set start.NAME=VALUE, such as --set start.x=0.5; \
what is not given takes the middle of its range.

The folder holds action.json, commands.csv (time in s and the command of each actuator), result.json, \
config.toml, report.html and trace.json.")]
pub struct Arguments {
    /// The task: see `asid list`
    task: String,
    /// The folder of `asid identify` or `asid run`; `prior` for the prior (domain randomisation)
    #[arg(long, value_name = "DIR")]
    posterior: PathBuf,
    /// Solve the task by this algorithm: see `asid list`
    #[arg(long, value_name = "NAME")]
    solver: Option<String>,
    #[command(flatten)]
    simulator: Simulator,
    #[command(flatten)]
    pub common: Common,
}

/// What the chosen action does in the simulator, over the belief.
#[derive(Serialize)]
struct Expected {
    metric: String,
    value: f64,
    success_rate: f64,
    cost: f64,
    tries: usize,
}

/// `action.json`.
#[derive(Serialize)]
struct Action {
    task: String,
    action: Vec<Named>,
    expected_cost: f64,
    start: BTreeMap<String, f64>,
}

/// `result.json` of `solve`.
#[derive(Serialize)]
struct SolveResult {
    schema: u32,
    task: String,
    backend: String,
    solver: String,
    seed: u64,
    posterior: String,
    parameters: Vec<ParameterResult>,
    start: BTreeMap<String, f64>,
    action: Vec<Named>,
    expected: Expected,
    cost: CostResult,
    versions: Versions,
}

/// Solves the task for a belief.
pub fn solve(arguments: &Arguments) -> Result<()> {
    let clock = Instant::now();
    let common = &arguments.common;
    let algorithms = Algorithms {
        solver: arguments.solver.clone(),
        ..Algorithms::default()
    };
    let session = Session::open_stage(
        Stage::Solve,
        &arguments.task,
        common,
        &algorithms,
        &Worlds::from(&arguments.simulator),
    )?;
    let belief = belief(&session, &arguments.posterior)?;
    let out = OutFolder::claim(common.out.as_deref(), &format!("{}-solve", arguments.task))?;
    interrupt::watch(&format!("the search for an action of {}", arguments.task))?;
    stage::check_start(&session);
    let config = &session.config;
    let protocol = session.task.downstream();
    let start = session.start();
    let problem = session.problem();

    let solver = (find::<SolverEntry>(&config.solver.name)?.make)(&config.solver.settings)?;
    let mut solved = solver.solve(&problem, &belief)?;
    let mut action = vec![0.0; protocol.action.len()];
    solved.policy.act(&start, &mut action)?;
    let ctrl = session.task.attempt(&start, &action)?;
    let (expected, attempt) = try_out(&session, &belief, &start, &action, &ctrl)?;

    let wall_s = clock.elapsed().as_secs_f64();
    let record = Action {
        task: config.task.clone(),
        action: stage::named(&protocol.action, &action),
        expected_cost: expected.cost,
        start: config.start.clone(),
    };
    let chosen: Vec<String> = record
        .action
        .iter()
        .map(|a| format!("{} {:.4} {}", a.name, a.value, a.unit))
        .collect();
    let lines = [
        format!("start: {}", stage::start_line(&session)),
        format!(
            "action: {}; expected {} {:.2}, success in {:.0} % of {} simulated tries",
            joined(&chosen, "and"),
            expected.metric,
            expected.value,
            100.0 * expected.success_rate,
            expected.tries
        ),
    ];
    let mut report = stage::report(
        &session,
        wall_s,
        &[
            ("action.json", "the action"),
            (
                "commands.csv",
                "the commands to play: time in s, one column an actuator",
            ),
        ],
    );
    report.solver.clone_from(&config.solver.name);
    report.answer = format!("Chosen {}", lines[1]);
    report.parameters = trace::parameters(&session, None, &belief, None);
    for p in &mut report.parameters {
        p.narrowing.clear();
    }
    report.downstream = Some(trace::downstream(&session, &attempt, &solved.trials));
    let result = SolveResult {
        schema: SCHEMA,
        task: config.task.clone(),
        backend: config.backend.clone(),
        solver: config.solver.name.clone(),
        seed: config.seed,
        posterior: arguments.posterior.display().to_string(),
        parameters: ParameterResult::all(&belief, None),
        start: config.start.clone(),
        action: stage::named(&protocol.action, &action),
        expected,
        cost: session.cost(wall_s),
        versions: Versions::of(&session),
    };
    stage::finish(&session, common, &out, &result, &report, &lines, |folder| {
        write_json(&folder.join("action.json"), &record)?;
        Episode::of_commands(session.model.layout(), ctrl, protocol.frame_period)
            .write_csv(&folder.join("commands.csv"))?;
        Ok(())
    })
}

/// The posterior of a folder, or the prior.
fn belief(session: &Session, from: &Path) -> Result<Posterior> {
    if from == Path::new(PRIOR) {
        let mut rng = session.problem().streams.stream("prior belief");
        return Ok(Posterior::prior(
            &session.parameters,
            PRIOR_SAMPLES,
            &mut rng,
        ));
    }
    let path = from.join("posterior.json");
    let fail = |message: String| Error::File {
        path: path.clone(),
        message,
    };
    let posterior = read_posterior(&path)?;
    if let Some(task) = task_of(from)
        && task != session.config.task
    {
        return Err(fail(format!(
            "is of the task `{task}`, not of `{}`",
            session.config.task
        ))
        .into());
    }
    let theirs: Vec<&str> = posterior.marginals.iter().map(|m| &*m.name).collect();
    let ours: Vec<&str> = session.parameters.iter().map(|p| &*p.name).collect();
    if theirs != ours {
        return Err(fail(format!(
            "is over {}, the task's unknowns here are {}; `--config {}` brings the settings it was made with",
            joined(&theirs, "and"),
            joined(&ours, "and"),
            shell::quoted(&from.join("config.toml").display().to_string())
        ))
        .into());
    }
    Ok(posterior)
}

/// Reads a posterior and checks that it is a distribution.
pub fn read_posterior(path: &Path) -> Result<Posterior> {
    let fail = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| {
        fail(format!(
            "{e}; --posterior takes a folder of `asid identify` or `asid run`, or `prior`"
        ))
    })?;
    let posterior: Posterior =
        serde_json::from_str(&text).map_err(|e| fail(format!("is not a posterior: {e}")))?;
    check(&posterior).map_err(fail)?;
    Ok(posterior)
}

/// Task of the result beside the posterior, where there is one.
fn task_of(folder: &Path) -> Option<String> {
    let text = std::fs::read_to_string(folder.join("result.json")).ok()?;
    let result: serde_json::Value = serde_json::from_str(&text).ok()?;
    Some(result.get("task")?.as_str()?.to_owned())
}

/// Checks that samples and weights form a distribution.
fn check(posterior: &Posterior) -> Result<(), String> {
    let (samples, weights) = (&posterior.samples, &posterior.weights);
    if samples.is_empty() || samples.len() != weights.len() {
        return Err(format!(
            "has {} samples and {} weights",
            samples.len(),
            weights.len()
        ));
    }
    let d = posterior.marginals.len();
    if let Some(i) = samples
        .iter()
        .position(|s| s.len() != d || s.iter().any(|x| !x.is_finite()))
    {
        return Err(format!("sample {i} is not {d} finite numbers"));
    }
    let total: f64 = weights.iter().sum();
    if weights.iter().any(|w| w.is_nan() || *w < 0.0) || (total - 1.0).abs() > 1e-6 {
        return Err(format!(
            "the weights are not positive numbers that sum to 1, but to {total}"
        ));
    }
    Ok(())
}

/// Tries the action in the simulator, at samples of the belief and at its mean. The report shows
/// the latter.
fn try_out(
    session: &Session,
    belief: &Posterior,
    start: &[f64],
    action: &[f64],
    ctrl: &[f64],
) -> Result<(Expected, Attempt)> {
    let problem = session.problem();
    let protocol = session.task.downstream();
    let recording = session.model.layout().recording(&protocol.channels)?;
    let mut thetas = belief.mean();
    let drawn = belief.resample(TRIES, &mut problem.streams.stream("try out"));
    thetas.extend(drawn.into_iter().flatten());
    let n = TRIES + 1;
    let sims: Vec<usize> = (0..n).collect();
    let mut batch = problem.batch(n)?;
    batch.set_parameters(&sims, &thetas)?;
    batch.place(&*session.task, &sims, &start.repeat(n))?;
    let mut readings = vec![0.0; n * protocol.frames * recording.width()];
    let substeps = problem.substeps(protocol.frame_period)?;
    let rollout = Rollout::new(
        &sims,
        protocol.frames,
        substeps,
        Control::Shared(ctrl),
        &recording,
    );
    let before = batch.simulator.steps_taken();
    batch.simulator.rollout(&rollout, &mut readings)?;
    problem.count_physics(&batch, before);

    let (mean, samples) = readings.split_at(readings.len() / n);
    let outcomes: Vec<_> = samples
        .chunks_exact(mean.len())
        .map(|r| session.task.outcome(r))
        .collect();
    let share = 1.0 / TRIES as f64;
    Ok((
        Expected {
            metric: protocol.metric.clone(),
            value: share * outcomes.iter().map(|o| o.value).sum::<f64>(),
            success_rate: share * outcomes.iter().filter(|o| o.success).count() as f64,
            cost: share * outcomes.iter().map(|o| o.cost).sum::<f64>(),
            tries: TRIES,
        },
        Attempt {
            outcome: session.task.outcome(mean),
            action: action.to_vec(),
            believed_start: start.to_vec(),
            readings: mean.to_vec(),
            episode: Episode::default(),
        },
    ))
}
