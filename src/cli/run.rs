//! `asid run`: explore, identify, solve, and one zero-shot attempt in the real world.

use std::io::Write as _;
use std::time::Instant;

use crate::pipeline::{self, Method, RunOutcome};
use anyhow::Result;
use asid_core::Model;
use asid_core::registry::{ExplorerEntry, IdentifierEntry, SolverEntry, find};

use super::options::{Algorithms, Common, Worlds};
use super::output::{OutFolder, write_json, write_text};
use super::result::{RunResult, caveats, figure, parameter_line, unexplained, widen_by_setting};
use super::session::Session;
use super::{failure, interrupt, trace};

/// Arguments of `run`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The task: see `asid list`
    task: String,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    algorithms: Algorithms,
    #[command(flatten)]
    worlds: Worlds,
}

/// Runs the pipeline and writes its folder.
pub fn run(arguments: &Arguments) -> Result<()> {
    let clock = Instant::now();
    let session = Session::open(
        &arguments.task,
        &arguments.common,
        &arguments.algorithms,
        &arguments.worlds,
    )?;
    let out = OutFolder::claim(arguments.common.out.as_deref(), &arguments.task)?;
    interrupt::watch(&format!("the run of {}", arguments.task))?;
    let truth = session.truth();
    let outcome = pipeline(&session, &truth)?;
    let wall_s = clock.elapsed().as_secs_f64();
    let result = RunResult::new(&session, &truth, &outcome, wall_s);
    let mut report = trace::run_report(&session, &truth, &outcome, wall_s, command_line())?;
    report.notes.extend(result.joint.line());
    let caveats = caveats(&session.parameters, &outcome.belief, widen_by_setting);
    report.notes.extend(caveats.iter().cloned());
    let warning = outcome.identified.as_ref().and_then(unexplained);
    report.notes.extend(warning.clone());
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        write_text(
            &folder.join("config.toml"),
            &toml::to_string_pretty(&session.config)?,
        )?;
        write_json(&folder.join("posterior.json"), &outcome.belief)?;
        let attempt = &outcome.attempt.episode;
        attempt.write_csv(&folder.join("attempt.csv"))?;
        if let Some(real) = &outcome.real {
            real.episode.write_csv(&folder.join("real.csv"))?;
            write_json(&folder.join("policy.json"), &outcome.policy)?;
        }
        report.write(folder)?;
        Ok(())
    })?;
    if let Some(warning) = &warning {
        failure::warn(warning);
    }
    let mut stdout = std::io::stdout().lock();
    if arguments.common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
        return Ok(());
    }
    for (m, t) in outcome.belief.marginals.iter().zip(&truth) {
        writeln!(stdout, "{}, truth {}", parameter_line(m), figure(*t))?;
    }
    if let Some(line) = result.joint.line() {
        writeln!(stdout, "{line}")?;
    }
    let protocol = session.task.downstream();
    let attempt = &outcome.attempt.outcome;
    let digits = if attempt.value.abs() < 1.0 { 3 } else { 2 };
    writeln!(
        stdout,
        "{}: {:.digits$}, {}",
        protocol.metric,
        attempt.value,
        if attempt.success {
            "success"
        } else {
            "failure"
        }
    )?;
    for caveat in &caveats {
        writeln!(stdout, "{caveat}")?;
    }
    let cost = session.cost(wall_s);
    writeln!(
        stdout,
        "{:.1} s, {:.2} million physics steps on {}",
        wall_s,
        cost.physics_steps as f64 / 1e6,
        session.engine
    )?;
    writeln!(
        stdout,
        "report: {}",
        out.path().join("report.html").display()
    )?;
    Ok(())
}

/// The pipeline with the session's algorithms.
pub fn pipeline(session: &Session, truth: &[f64]) -> Result<RunOutcome> {
    let config = &session.config;
    let explorer = (find::<ExplorerEntry>(&config.explorer.name)?.make)(&config.explorer.settings)?;
    let identifier =
        (find::<IdentifierEntry>(&config.identifier.name)?.make)(&config.identifier.settings)?;
    let solver = (find::<SolverEntry>(&config.solver.name)?.make)(&config.solver.settings)?;
    let ensemble = session.ensemble_for(&*identifier)?;
    let method = Method {
        explorer: Some(&*explorer),
        identifier: Some(&*identifier),
        solver: &*solver,
        ensemble: ensemble.as_ref().map(|e| e as &dyn Model),
        known: None,
        expected: config.expected.settings(),
    };
    let problem = session.problem();
    let mut world = session.world(truth)?;
    Ok(pipeline::run(&problem, method, &mut world)?)
}

/// The command line of this process, quoted where necessary.
pub fn command_line() -> String {
    super::shell::line(std::iter::once("asid".to_owned()).chain(std::env::args().skip(1)))
}
