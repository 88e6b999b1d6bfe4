//! `cargo xtask slurm`: comparisons as job arrays of a real Slurm with two nodes on this host.
//!
//! It tests the promises of a job array under real conditions. Two nodes that write shares into one
//! folder must give the same bytes as one process. A task that is killed, requeued, or warned
//! before its time limit must not lose a finished run.

mod cluster;
mod comparison;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::library::{repository, target};
use crate::stage::{ALL_FEATURES, Stages};
use cluster::{Cluster, Programs};

/// Runs the stage alone. `--program FILE` tests a program that is already built.
pub fn run(arguments: &[String]) -> Result<bool> {
    let program = match arguments {
        [] => None,
        [option, file] if option == "--program" => Some(PathBuf::from(file)),
        _ => bail!("usage: cargo xtask slurm [--program FILE]"),
    };
    let mut stages = Stages::default();
    stage(&mut stages, program.as_deref())?;
    Ok(stages.finish())
}

/// Runs the stage, or prints why it is left out.
pub fn stage(stages: &mut Stages, program: Option<&Path>) -> Result<()> {
    let programs = match Programs::get() {
        Ok(programs) => programs,
        Err(reason) => {
            stages.leave_out("slurm", &format!("{reason:#}"));
            return Ok(());
        }
    };
    stages.run("slurm", || {
        let program = match program {
            Some(program) => program
                .canonicalize()
                .context(program.display().to_string())?,
            None => build()?,
        };
        test(&programs, &program)
    })?;
    Ok(())
}

/// Builds the program as the tests build it.
fn build() -> Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let built = Command::new(cargo)
        .args(["build", ALL_FEATURES])
        .current_dir(repository())
        .status()
        .context("cannot start cargo")?;
    if !built.success() {
        bail!("the program cannot be built");
    }
    Ok(target()?.join("debug").join("asid"))
}

/// Runs every check; returns whether all hold. Shows the cluster's logs if one fails.
fn test(programs: &Programs, program: &Path) -> Result<bool> {
    let cluster = Cluster::start(programs)?;
    let checked = comparison::check(&cluster, program);
    match &checked {
        Ok(()) => Ok(true),
        Err(error) => {
            eprintln!("slurm: {error:#}\n{}", cluster.logs());
            Ok(false)
        }
    }
}
