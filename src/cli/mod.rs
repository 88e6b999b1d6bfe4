//! The command line, one file a subcommand.

mod compare;
mod config;
mod conformance;
mod diagnose;
mod doctor;
mod explore;
mod export;
mod export_log;
mod failure;
mod figure;
mod identify;
mod import;
mod interrupt;
mod list;
mod machine;
mod model;
mod new;
mod options;
mod output;
mod plugins;
mod progress;
pub mod readers;
mod report;
mod result;
mod run;
pub mod schemas;
mod session;
mod settings;
mod shell;
mod solve;
mod stage;
mod trace;
mod tracked_joint;
mod train;
mod view;
mod withheld;
mod world;

pub use machine::motion_config::Config as MotionConfig;
pub use machine::{Subject, setup::Setup as MotionSetup};

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Design an informative motion of a robot, estimate unknown physical parameters from one episode
/// of it, and solve the task in the fitted simulator; find what a model lacks beside the logs of a
/// real machine.
#[derive(Parser)]
#[command(name = "asid", version, about, arg_required_else_help = true)]
struct Cli {
    /// Load a plugin, a shared library (repeatable); `asid list` shows what it brings
    #[arg(long, global = true, value_name = "FILE")]
    plugin: Vec<PathBuf>,
    /// Load the plugins that the file of --config names: their code runs as you
    #[arg(long, global = true)]
    trust_plugins: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// List engines, tasks, explorers, identifiers, solvers and effects
    List(list::Arguments),
    /// Check the native libraries: where they are, and how to get what is missing
    Doctor(doctor::Arguments),
    /// Explore, identify, solve and try the task once in the real world
    Run(run::Arguments),
    /// Make the commands of a motion that tells the most, for a task or for any machine
    Explore(explore::Arguments),
    /// Estimate the unknowns of a task or of any machine from logs of the real one
    Identify(identify::Arguments),
    /// Find the action that achieves the task, for a posterior
    Solve(solve::Arguments),
    /// Compare methods head to head, over tasks, conditions, worlds, engines and seeds
    Compare(compare::Arguments),
    /// Check engines against theory and against the contract
    Conformance(conformance::Arguments),
    /// Find where model and logs disagree, which effect causes it, and how far the gap shrinks with
    /// it
    Diagnose(diagnose::Arguments),
    /// Score diagnoses of cases whose effect is withheld, or make such cases
    Withheld(withheld::Arguments),
    /// Print every setting of a task or of a diagnosis with its value and meaning, as a file for
    /// --config
    Config(config::Arguments),
    /// Write a task's scene, or a refined model, as plain MJCF
    Export(export::Arguments),
    /// Make a study of a model and logs of another stack: CSV of any names, ROS 2 (MCAP, bags),
    /// LeRobot
    Import(import::Arguments),
    /// Write logs as MCAP, for Foxglove and Rerun
    ExportLog(export_log::Arguments),
    /// Write a folder that a plugin starts from
    New(new::Arguments),
    /// Make report.html of a finished run or diagnosis again
    Report(report::Arguments),
}

impl Command {
    /// The configuration file of the subcommand.
    fn config(&self) -> Option<&Path> {
        let common = match self {
            Self::Run(a) => &a.common,
            Self::Explore(a) => &a.common,
            Self::Identify(a) => &a.common,
            Self::Solve(a) => &a.common,
            Self::Diagnose(a) => &a.common,
            Self::Withheld(a) => &a.common,
            Self::Compare(a) => return a.config.as_deref(),
            Self::Conformance(a) => return a.config.as_deref(),
            Self::List(_)
            | Self::Doctor(_)
            | Self::Config(_)
            | Self::Export(_)
            | Self::Import(_)
            | Self::ExportLog(_)
            | Self::New(_)
            | Self::Report(_) => return None,
        };
        common.config.as_deref()
    }
}

/// Runs the command line of this process.
#[must_use]
pub fn main() -> ExitCode {
    asid_learned::set_commit(env!("ASID_GIT"));
    failure::guard(dispatch)
}

fn dispatch() -> ExitCode {
    let mut arguments: Vec<OsString> = std::env::args_os().collect();
    let mut named = leading_plugins(&mut arguments);
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => return failure::usage(&error),
    };
    named.extend_from_slice(&cli.plugin);
    match run_command(&cli, named) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure::report(&error),
    }
}

/// Takes the plugins before the subcommand out of the arguments, because an option of the
/// subcommand would hide them.
fn leading_plugins(arguments: &mut Vec<OsString>) -> Vec<PathBuf> {
    let mut named = Vec::new();
    while let Some(first) = arguments.get(1).and_then(|a| a.to_str()) {
        let taken = match (first, first.strip_prefix("--plugin="), arguments.get(2)) {
            (_, Some(file), _) => {
                named.push(PathBuf::from(file));
                1
            }
            ("--plugin", _, Some(file)) => {
                named.push(PathBuf::from(file));
                2
            }
            _ => break,
        };
        arguments.drain(1..=taken);
    }
    named
}

fn run_command(cli: &Cli, mut named: Vec<PathBuf>) -> Result<()> {
    let of_config = plugins::of_config(cli.command.config(), &named, cli.trust_plugins)?;
    named.extend(of_config);
    let plugins::Searched { found, refused } = plugins::load(&named)?;
    match &cli.command {
        // The rows of these commands report refused plugins themselves.
        Command::List(_) | Command::Doctor(_) => {}
        _ => {
            found.iter().for_each(|line| failure::note(line));
            refused.iter().for_each(|r| failure::warn(&r.why));
        }
    }
    match &cli.command {
        Command::List(arguments) => list::list(arguments, &refused),
        Command::Doctor(arguments) => doctor::doctor(arguments, &refused),
        Command::Run(arguments) => run::run(arguments),
        Command::Explore(arguments) => explore::explore(arguments),
        Command::Identify(arguments) => identify::identify(arguments),
        Command::Solve(arguments) => solve::solve(arguments),
        Command::Compare(arguments) => compare::compare(arguments),
        Command::Conformance(arguments) => conformance::conformance(arguments),
        Command::Diagnose(arguments) => diagnose::diagnose(arguments),
        Command::Withheld(arguments) => withheld::withheld(arguments),
        Command::Config(arguments) => config::print(arguments),
        Command::Export(arguments) => export::export(arguments),
        Command::Import(arguments) => import::import(arguments),
        Command::ExportLog(arguments) => export_log::export_log(arguments),
        Command::New(arguments) => new::new(arguments),
        Command::Report(arguments) => report::report(arguments),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plugins_before_the_subcommand_are_taken_out() {
        let mut arguments: Vec<OsString> = [
            "asid",
            "--plugin",
            "a.so",
            "--plugin=b.so",
            "list",
            "--plugin",
            "c.so",
        ]
        .map(OsString::from)
        .into();
        assert_eq!(
            leading_plugins(&mut arguments),
            [PathBuf::from("a.so"), PathBuf::from("b.so")]
        );
        assert_eq!(arguments, ["asid", "list", "--plugin", "c.so"]);
        let mut alone: Vec<OsString> = ["asid", "--plugin"].map(OsString::from).into();
        assert!(leading_plugins(&mut alone).is_empty());
        assert_eq!(alone.len(), 2);
    }
}
