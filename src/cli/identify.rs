//! `asid identify`: the posterior over the unknowns from logs of the real machine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::pipeline::simulated_in;
use anyhow::Result;
use asid_algorithms::identify::articulation::Articulation;
use asid_core::identify::Identified;
use asid_core::posterior::Direction;
use asid_core::registry::{IdentifierEntry, find};
use asid_core::{Episode, Error, Model, Parameter};
use asid_report::run::{RealWorld, RunReport};
use asid_results::naming::joined;
use serde::Serialize;

use super::options::{Algorithms, Common, Simulator, Worlds};
use super::output::{OutFolder, write_json};
use super::result::{
    CostResult, ParameterResult, SCHEMA, Versions, caveats, parameter_line, unexplained,
    widen_by_setting,
};
use super::session::Session;
use super::settings::{Stage, wrong};
use super::tracked_joint::TrackedJoint;
use super::{failure, interrupt, machine, stage, trace, train};

/// Longest episode relative to the task's; a longer one probably has times in another unit.
const LONGEST: f64 = 100.0;

/// Arguments of `identify`.
#[derive(clap::Args)]
#[command(after_help = "\
A log is a CSV file: `time` in seconds, strictly increasing, at any rate; `ctrl.ACTUATOR`, the command \
from that time on; and columns named after the scene's sensors, vectors as NAME.0, NAME.1 and so on \
(quaternions w x y z). An empty cell is a missing reading. The machine's initial state is the scene's first \
keyframe; the object's initial pose is estimated.

The results folder (--out) holds posterior.json (for `asid solve`), result.json, config.toml, a copy of the logs, \
report.html and trace.json.

A study (a folder with study.toml, or the file) names its logs itself: its parameters are fitted to those to train, \
and the gap is measured on those held out. The results folder then holds refined.toml, the model with the fitted values.")]
pub struct Arguments {
    /// The task (see `asid list`), or a study: a folder or a TOML file
    task: String,
    /// Fit to these logs of real episodes, all together (CSV; Parquet in a build with the feature
    /// parquet)
    #[arg(long, value_name = "FILE", num_args = 1..)]
    log: Vec<PathBuf>,
    /// Trains the identifier on episodes of --explorer, saves it for the setting `network`, and
    /// identifies nothing; its curves for TensorBoard come beside it
    #[arg(long, value_name = "FILE", conflicts_with_all = ["log", "out"])]
    train: Option<PathBuf>,
    /// Learn from episodes of this explorer [default: fisher-ppo]
    #[arg(long, value_name = "NAME")]
    explorer: Option<String>,
    /// Let that explorer play this trained policy [default: the one that ships for the task]
    #[arg(long, value_name = "FILE", requires = "train")]
    policy: Option<PathBuf>,
    /// Identify by this algorithm: see `asid list`
    #[arg(long, value_name = "NAME")]
    identifier: Option<String>,
    #[command(flatten)]
    simulator: Simulator,
    #[command(flatten)]
    pub common: Common,
}

/// `result.json` of `identify`.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Identification")]
pub struct IdentifyResult {
    schema: u32,
    task: String,
    backend: String,
    identifier: String,
    seed: u64,
    parameters: Vec<ParameterResult>,
    /// Combinations of unknowns that the logs do not see.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unseen: Vec<Direction>,
    #[serde(
        rename = "articulation",
        skip_serializing_if = "TrackedJoint::is_missing"
    )]
    #[schemars(with = "Option<Articulation>")]
    joint: TrackedJoint,
    /// Root mean square of the residuals at the best fit, in standard deviations of the noise.
    residual: f64,
    /// Root mean square of the residuals at the best fit, in standard deviations of noise and of
    /// the simulator's roughness together; missing where the identifier fits nothing to the
    /// readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    misfit: Option<f64>,
    /// Start pose of each episode at the best fit.
    starts: Vec<BTreeMap<String, f64>>,
    logs: Vec<String>,
    cost: CostResult,
    versions: Versions,
}

/// Fits the unknowns to the episodes, in the models that the settings ask for; returns the number of
/// these too, 0 for the model as it is.
fn fitted(session: &Session, episodes: &[Episode]) -> Result<(Identified, usize)> {
    let component = &session.config.identifier;
    let identifier = (find::<IdentifierEntry>(&component.name)?.make)(&component.settings)?;
    let ensemble = session.ensemble_for(&*identifier)?;
    let models = ensemble.as_ref().map(|e| e as &dyn Model);
    let problem = session.problem();
    let found = identifier.identify(&simulated_in(&problem, models), episodes)?;
    let members = models.map_or(0, |_| session.config.model_errors.members);
    Ok((found, members))
}

/// Identifies from logs.
pub fn identify(arguments: &Arguments) -> Result<()> {
    let clock = Instant::now();
    let common = &arguments.common;
    if let Some(path) = machine::path_of(&arguments.task)? {
        refuse_of_a_study(arguments)?;
        return machine::identify::identify(path, arguments.simulator.model.as_deref(), common);
    }
    if arguments.log.is_empty() && arguments.train.is_none() {
        return Err(wrong(
            "--log",
            "is missing: a task is identified from --log FILE…",
        ));
    }
    let algorithms = Algorithms {
        identifier: arguments.identifier.clone(),
        explorer: train::explorer_of(
            arguments.explorer.as_deref(),
            arguments.identifier.as_deref(),
        ),
        policy: arguments.policy.clone(),
        ..Algorithms::default()
    };
    let mut session = Session::open_stage(
        Stage::Identify,
        &arguments.task,
        common,
        &algorithms,
        &Worlds::from(&arguments.simulator),
    )?;
    if let Some(name) = &arguments.explorer {
        train::learned_from(&mut session, name)?;
    }
    if let Some(file) = &arguments.train {
        return train::identifier(&session, common, file);
    }
    let episodes: Vec<Episode> = arguments
        .log
        .iter()
        .map(|path| read(&session, path))
        .collect::<Result<_>>()?;
    let out = OutFolder::claim(
        common.out.as_deref(),
        &format!("{}-identify", arguments.task),
    )?;
    interrupt::watch(&format!("the identification of {}", arguments.task))?;
    let config = &session.config;
    let (found, members) = fitted(&session, &episodes)?;

    let wall_s = clock.elapsed().as_secs_f64();
    let coordinates = &session.task.exploration().start;
    let result = IdentifyResult {
        schema: SCHEMA,
        task: config.task.clone(),
        backend: config.backend.clone(),
        identifier: config.identifier.name.clone(),
        seed: config.seed,
        parameters: ParameterResult::all(&found.posterior, None),
        unseen: found.posterior.unseen.clone(),
        joint: TrackedJoint::of(&session, &episodes),
        residual: found.residual,
        misfit: found.misfit,
        starts: found
            .starts
            .iter()
            .map(|s| stage::pose(coordinates, s))
            .collect(),
        logs: arguments
            .log
            .iter()
            .map(|p| p.display().to_string())
            .collect(),
        cost: session.cost(wall_s),
        versions: Versions::of(&session),
    };
    let mut lines = lines(&found, &result.joint, members);
    let caveats = caveats(&session.parameters, &found.posterior, widen_by_setting);
    lines.extend(caveats.iter().cloned());
    let names = copies(&arguments.log);
    let mut report = report(&session, &episodes, &found, &names, wall_s)?;
    report.notes.extend(result.joint.line());
    report.notes.push(model_line(members));
    report.notes.extend(caveats);
    stage::finish(&session, common, &out, &result, &report, &lines, |folder| {
        write_json(&folder.join("posterior.json"), &found.posterior)?;
        for (path, name) in arguments.log.iter().zip(&names) {
            std::fs::copy(path, folder.join(name)).map_err(|e| Error::File {
                path: path.clone(),
                message: e.to_string(),
            })?;
        }
        Ok(())
    })?;
    if let Some(warning) = unexplained(&found) {
        failure::warn(&warning);
    }
    Ok(())
}

/// Refuses options that do not apply to a study.
fn refuse_of_a_study(arguments: &Arguments) -> Result<()> {
    let algorithms = [&arguments.explorer, &arguments.identifier];
    let files = [&arguments.train, &arguments.policy];
    let none = arguments.log.is_empty()
        && algorithms.iter().all(|a| a.is_none())
        && files.iter().all(|f| f.is_none())
        && arguments.common.preset.is_none();
    if none {
        return Ok(());
    }
    Err(wrong(
        "--log",
        "a study names its logs itself and is fitted by gauss-newton: --log, --train, --explorer, --policy, --identifier and \
         --preset go with a task",
    ))
}

/// The identified values, line by line.
fn lines(found: &Identified, joint: &TrackedJoint, members: usize) -> Vec<String> {
    let marginals = found.posterior.marginals.iter();
    let mut lines: Vec<String> = marginals.map(parameter_line).collect();
    lines.extend(joint.line());
    let together = found.misfit.map_or_else(String::new, |misfit| {
        format!(", {misfit:.2} times noise and the simulator's roughness together")
    });
    lines.push(format!(
        "residual: {:.2} times the sensors' noise{together}",
        found.residual
    ));
    lines.push(model_line(members));
    lines
}

/// Whether the intervals include errors of the model, by the number of models that were fitted.
fn model_line(members: usize) -> String {
    if members == 0 {
        return "the intervals take the model as it is: errors of the model are not in them".into();
    }
    format!(
        "the intervals include errors of the model, by {members} models that differ as [model_errors] says; \
         those of `asid diagnose` include none, and can be far narrower"
    )
}

/// Names of the logs' copies in the folder, in the format of the logs.
fn copies(logs: &[PathBuf]) -> Vec<String> {
    let ending = |path: &PathBuf| match path.extension() {
        Some(e) if e.eq_ignore_ascii_case("parquet") => "parquet",
        _ => "csv",
    };
    match logs {
        [one] => vec![format!("real.{}", ending(one))],
        many => (1..)
            .zip(many)
            .map(|(i, path)| format!("real-{i}.{}", ending(path)))
            .collect(),
    }
}

/// Reads a log and checks that it can be used for identification.
fn read(session: &Session, path: &Path) -> Result<Episode> {
    let layout = session.model.layout();
    let episode = asid_logs::episode::read(path, layout)?;
    let fail = |message: String| Error::Log {
        path: path.to_owned(),
        message,
    };
    let names: Vec<String> = session.signals.iter().map(|s| s.sensor.clone()).collect();
    if let Some(name) = names.iter().find(|n| episode.channel(n).is_none()) {
        return Err(fail(format!("has no columns of `{name}`, which the task tracks")).into());
    }
    let readings = episode.select(layout, &names);
    let width = readings.len() / episode.rows();
    if !readings
        .chunks_exact(width)
        .any(|row| row.iter().all(|x| x.is_finite()))
    {
        return Err(fail(format!(
            "no row has a reading of all of {}",
            joined(&names, "and")
        ))
        .into());
    }
    let protocol = session.task.exploration();
    let usual = protocol.frames() as f64 * protocol.frame_period;
    let lasts = episode.time[episode.rows() - 1] - episode.time[0];
    if lasts > LONGEST * usual {
        return Err(fail(format!(
            "lasts {lasts} s, where the task's episode lasts {usual} s; is the time in seconds?"
        ))
        .into());
    }
    Ok(episode)
}

fn report(
    session: &Session,
    episodes: &[Episode],
    found: &Identified,
    names: &[String],
    wall_s: f64,
) -> Result<RunReport> {
    let mut files = vec![("posterior.json", "the posterior, for `asid solve`")];
    files.extend(names.iter().map(|n| (n.as_str(), "log of a real episode")));
    let mut report = stage::report(session, wall_s, &files);
    let center: Vec<f64> = session.parameters.iter().map(Parameter::center).collect();
    let before = trace::replay(session, &episodes[0], &center, &found.starts[0])?;
    let after = trace::replay(
        session,
        &episodes[0],
        &found.posterior.mean(),
        &found.starts[0],
    )?;
    report
        .identifier
        .clone_from(&session.config.identifier.name);
    report.real_world = RealWorld {
        engine: "logs".into(),
        ..RealWorld::default()
    };
    report.parameters = trace::parameters(session, None, &found.posterior, Some(&found.iterations));
    report.episode = trace::episode(session, &episodes[0]);
    report.signals = trace::tracked(session, &episodes[0], Some((&before, &after)));
    if episodes.len() > 1 {
        report.notes.push(format!(
            "{} episodes were fitted together; the first is shown",
            episodes.len()
        ));
    }
    report.notes.extend(unexplained(found));
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: `asid identify` and `asid diagnose` stated intervals of one parameter that differ by a
    /// factor of 40. Cause: one includes errors of the model and the other does not, and neither said
    /// so.
    #[test]
    fn an_interval_says_whether_it_includes_errors_of_the_model() {
        let with = model_line(16);
        assert!(
            with.contains("16 models") && with.contains("asid diagnose"),
            "{with}"
        );
        assert!(model_line(0).contains("as it is"));
    }

    #[test]
    fn a_parquet_log_is_copied_under_its_own_ending() {
        let logs = ["a.csv", "b.PARQUET"].map(PathBuf::from);
        assert_eq!(copies(&logs[..1]), ["real.csv"]);
        assert_eq!(copies(&logs[1..]), ["real.parquet"]);
        assert_eq!(copies(&logs), ["real-1.csv", "real-2.parquet"]);
    }
}
