//! `asid explore`: the exploration policy and its commands, for a real machine.
//!
//! The policy is played once in the simulator, at the middle of the prior. An open-loop policy can
//! be played from `commands.csv` as it stands. A policy that reacts to its readings is in
//! `policy.json`; the commands are those of the simulated episode.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use crate::pipeline::{EpisodeInformation, episode_information};
use anyhow::Result;
use asid_algorithms::fisher::FisherSettings;
use asid_core::real_world::RealEpisode;
use asid_core::registry::{ExplorerEntry, find};
use asid_core::signal::Signal;
use asid_core::{Episode, Parameter, RealWorld as _};
use asid_worlds::SimulatedWorld;
use serde::Serialize;

use super::options::{Algorithms, Common, Worlds};
use super::output::{OutFolder, write_json};
use super::result::{CostResult, ExplorationResult, SCHEMA, Versions, figure};
use super::session::Session;
use super::settings::Stage;
use super::{interrupt, machine, stage, trace, train, view};

/// Arguments of `explore`.
#[derive(clap::Args)]
#[command(after_help = "\
The start pose of the object is given by --set start.NAME=VALUE, such as --set start.x=0.55; \
what is not given takes the middle of its range.

The folder holds commands.csv (time in s and the command of each actuator), predicted.csv (the log \
that the simulator expects), policy.json, result.json, config.toml, report.html and trace.json. With \
--truth or a --real-… option the episode is also played in that simulated real world, from the same start pose: \
real.csv is its log, for `asid identify` and `asid diagnose`.

For any machine (a study, or --model FILE with --unknown) it designs the motion with the most information about the unknowns \
within the limits; explorers are fisher-cem, random, multisine and fourier. docs/any-machine.md has all steps.")]
pub struct Arguments {
    /// The task (see `asid list`), or a study: a folder or a TOML file
    #[arg(required_unless_present = "model")]
    task: Option<String>,
    /// Explore by this algorithm: see `asid list`
    #[arg(long, value_name = "NAME")]
    explorer: Option<String>,
    /// Trained policy to play [default: the one that ships for the task, else it is trained on the
    /// spot]
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Trains the explorer's policy, saves it for --policy, and plays nothing; its curves for
    /// TensorBoard come beside it
    #[arg(long, value_name = "FILE", conflicts_with_all = ["policy", "out"])]
    train: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    worlds: Worlds,
    #[command(flatten)]
    motion: machine::motion_config::Options,
}

/// `result.json` of `explore`.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "ExploredTask")]
pub struct ExploreResult {
    schema: u32,
    task: String,
    backend: String,
    explorer: String,
    seed: u64,
    start: BTreeMap<String, f64>,
    exploration: ExplorationResult,
    cost: CostResult,
    versions: Versions,
}

/// Explores in the simulator and writes what a machine needs to do the same.
pub fn explore(arguments: &Arguments) -> Result<()> {
    let clock = Instant::now();
    let common = &arguments.common;
    let Some(task) = any_machine(arguments)? else {
        return Ok(());
    };
    let algorithms = Algorithms {
        explorer: arguments.explorer.clone(),
        policy: arguments.policy.clone(),
        ..Algorithms::default()
    };
    let session =
        Session::open_stage(Stage::Explore, task, common, &algorithms, &arguments.worlds)?;
    if let Some(file) = &arguments.train {
        return train::explorer(&session, common, file);
    }
    let out = OutFolder::claim(common.out.as_deref(), &format!("{task}-explore"))?;
    interrupt::watch(&format!("the exploration of {task}"))?;
    stage::check_start(&session);
    let config = &session.config;
    let start = session.start();
    let problem = session.problem();
    let center: Vec<f64> = session.parameters.iter().map(Parameter::center).collect();

    let explorer = (find::<ExplorerEntry>(&config.explorer.name)?.make)(&config.explorer.settings)?;
    let mut explored = explorer.explore(&problem, Some(&start))?;
    let played = nominal_world(&session, &center)?
        .with_exploration_start(start.clone())
        .explore(&mut *explored.policy)?;
    let real = if config.real.is_left_open(&config.backend) {
        None
    } else {
        let mut world = session
            .world(&session.truth())?
            .with_exploration_start(start.clone());
        Some(world.explore(&mut *explored.policy)?)
    };
    let searched = explored.policy.take_curve();
    let curve = if searched.is_empty() {
        explored.curve
    } else {
        searched
    };
    let policy = explored.policy.export();
    let information = episode_information(
        &problem,
        &FisherSettings::default(),
        &center,
        &start,
        &played.actions,
    )?;

    let wall_s = clock.elapsed().as_secs_f64();
    let result = ExploreResult {
        schema: SCHEMA,
        task: config.task.clone(),
        backend: config.backend.clone(),
        explorer: config.explorer.name.clone(),
        seed: config.seed,
        start: config.start.clone(),
        exploration: ExplorationResult::new(
            &explored.objective,
            &information,
            played.contact_fraction,
        ),
        cost: session.cost(wall_s),
        versions: Versions::of(&session),
    };
    let expected = expected(&session, &information);
    let lines = [
        format!("start: {}", stage::start_line(&session)),
        format!("expected after the episode: {expected}"),
    ];
    let mut report = stage::report(&session, wall_s, &files(real.is_some()));
    report.explorer.clone_from(&config.explorer.name);
    report.answer = format!(
        "From {}, the episode is expected to tell {expected}.",
        stage::start_line(&session),
    );
    report.episode = trace::episode(&session, &played.episode);
    report.view = view::of_prediction(&session, &played.episode, &center, &start)?;
    report.exploration = trace::exploration(
        &session,
        &explored.objective,
        &information,
        Some(played.contact_fraction),
    );
    report.learning = trace::learning(&curve, explored.curve_label);
    stage::finish(&session, common, &out, &result, &report, &lines, |folder| {
        write_json(&folder.join("policy.json"), &policy)?;
        commands_of(&played).write_csv(&folder.join("commands.csv"))?;
        played.episode.write_csv(&folder.join("predicted.csv"))?;
        if let Some(real) = &real {
            real.episode.write_csv(&folder.join("real.csv"))?;
        }
        Ok(())
    })
}

/// Text on the expected deviation of each unknown after an episode.
fn expected(session: &Session, information: &EpisodeInformation) -> String {
    let deviations = information.expected_std.last().into_iter().flatten();
    let each = session.parameters.iter().zip(deviations);
    let each: Vec<String> = each
        .map(|(p, std)| format!("{} ± {} {}", p.name, figure(*std), p.unit))
        .collect();
    each.join(", ")
}

/// The files of the folder beside result and report, with descriptions; the last is written only
/// where a real world played.
fn files(is_real: bool) -> Vec<(&'static str, &'static str)> {
    let mut files = vec![
        (
            "commands.csv",
            "the commands to play: time in s, one column an actuator",
        ),
        (
            "predicted.csv",
            "log of the episode that the simulator expects, without noise",
        ),
        ("policy.json", "the exploration policy"),
    ];
    files.extend(is_real.then_some(("real.csv", "log of the real episode")));
    files
}

/// The task; `None` for a machine, whose motion is designed here.
fn any_machine(arguments: &Arguments) -> Result<Option<&str>> {
    let common = &arguments.common;
    let wrong = |key: &str, message: &str| asid_core::Error::Config {
        key: key.into(),
        message: message.into(),
    };
    let given = arguments.worlds.simulator.model.as_deref();
    let (path, model) = match &arguments.task {
        Some(task) => (machine::path_of(task)?, given),
        None => (given, None),
    };
    let Some(path) = path else {
        if let Some(option) = arguments.motion.first() {
            let message =
                "goes with a study or --model: a task has unknowns, limits and lengths of its own";
            return Err(wrong(option, message).into());
        }
        return Ok(arguments.task.as_deref());
    };
    let of_task = [
        ("--policy", arguments.policy.is_some()),
        ("--train", arguments.train.is_some()),
        ("--preset", common.preset.is_some()),
    ];
    if let Some((option, _)) = of_task.iter().find(|(_, is_given)| *is_given) {
        let message = "goes with a task: a study or model has no policies and no presets";
        return Err(wrong(option, message).into());
    }
    if let Some(option) = arguments.worlds.real.first() {
        let message = "goes with a task: the motion of a study or model is played by you";
        return Err(wrong(option, message).into());
    }
    let of_explorer = |set: &&String| set.starts_with("explorer.");
    if let Some(set) = common.set.iter().find(of_explorer) {
        let key = set.split('=').next().unwrap_or(set);
        let message = "goes with a task: a motion has the settings of [design], as `asid config STUDY --of explore` prints them";
        return Err(wrong(key, message).into());
    }
    let mut common = common.clone();
    if let Some(explorer) = &arguments.explorer {
        common.set.push(format!("explorer=\"{explorer}\""));
    }
    machine::explore::explore((path, model), &common, &arguments.motion)?;
    Ok(None)
}

/// The simulator at these values, with perfect trackers.
fn nominal_world<'a>(session: &'a Session, theta: &[f64]) -> Result<SimulatedWorld<'a>> {
    let signals: Vec<Signal> = session
        .signals
        .iter()
        .map(|s| Signal {
            sensor: s.sensor.clone(),
            noise: 0.0,
        })
        .collect();
    Ok(SimulatedWorld::new(
        &*session.task,
        &*session.model,
        &session.parameters,
        theta,
        &signals,
        session.problem().streams.child("nominal world"),
    )?)
}

fn commands_of(played: &RealEpisode) -> Episode {
    Episode {
        channels: Vec::new(),
        readings: Vec::new(),
        ..played.episode.clone()
    }
}
