//! The methods that answer cases: the diagnosis, or a baseline on the same question.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;
use asid_core::Error;
use asid_scorer::baseline::{self, Baseline};

use super::Arguments;
use crate::cli::diagnose::default_backend;
use crate::cli::output::write_json;
use crate::cli::session::backend;

/// What answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// `asid diagnose`
    Diagnose,
    /// Fit the study's parameters, and say that nothing is missing
    IdentifyOnly,
    /// Name the single effect whose fit has the smallest residual on the training logs
    BestResidual,
    /// Add and drop effects for as long as the Bayesian information criterion falls
    Bic,
    /// Name nothing, and let a network learn what is left of the readings; with --features torch
    ResidualNetwork,
}

impl Method {
    /// Name in tables and folders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diagnose => "diagnose",
            Self::IdentifyOnly => Baseline::IdentifyOnly.name(),
            Self::BestResidual => Baseline::BestResidual.name(),
            Self::Bic => Baseline::Bic.name(),
            Self::ResidualNetwork => Baseline::ResidualNetwork.name(),
        }
    }

    fn baseline(self) -> Option<Baseline> {
        match self {
            Self::Diagnose => None,
            Self::IdentifyOnly => Some(Baseline::IdentifyOnly),
            Self::BestResidual => Some(Baseline::BestResidual),
            Self::Bic => Some(Baseline::Bic),
            Self::ResidualNetwork => Some(Baseline::ResidualNetwork),
        }
    }
}

/// The settings that an answer depends on, besides the study and the program.
#[derive(Clone, Debug)]
pub struct Asked {
    pub method: Method,
    pub backend: String,
    pub without: Vec<String>,
    /// Effects left out of this case's catalogue, besides those of `without`.
    pub also_without: Vec<String>,
    seed: u64,
    threads: usize,
    set: Vec<String>,
    plugins: Vec<PathBuf>,
}

impl Asked {
    /// The settings of a method under the arguments of this call.
    pub fn new(method: Method, arguments: &Arguments) -> Self {
        let common = &arguments.common;
        Self {
            method,
            backend: common.backend.clone().unwrap_or_else(default_backend),
            without: arguments.without.clone(),
            also_without: Vec::new(),
            seed: common.seed.unwrap_or(0),
            // Cases run side by side, each on one core, so that their times are comparable.
            threads: common.threads.unwrap_or(1),
            set: common.set.clone(),
            plugins: crate::cli::plugins::used(&[]),
        }
    }

    /// The arguments of the call, with the paths of study and answer as the process sees them.
    pub fn arguments(&self, study: &str, out: &str) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for plugin in &self.plugins {
            all.extend(["--plugin".into(), plugin.display().to_string()]);
        }
        let given: &[&str] = match self.method {
            Method::Diagnose => &["diagnose", study],
            baseline => &["withheld", "--answer", study, "--method", baseline.name()],
        };
        all.extend(given.iter().map(|a| (*a).to_owned()));
        let numbers = [self.seed.to_string(), self.threads.to_string()];
        let more = [
            ("--out", out),
            ("--backend", &*self.backend),
            ("--seed", &*numbers[0]),
            ("--threads", &*numbers[1]),
        ];
        all.extend(
            more.iter()
                .flat_map(|(k, v)| [(*k).to_owned(), (*v).to_owned()]),
        );
        for effect in self.without.iter().chain(&self.also_without) {
            all.extend(["--without".to_owned(), effect.clone()]);
        }
        for set in &self.set {
            all.extend(["--set".to_owned(), set.clone()]);
        }
        all.push("--quiet".into());
        all
    }

    /// The command, to be run in the folder that holds `study`.
    pub fn command(&self, study: &str, out: &str) -> Result<Command> {
        let mut command = Command::new(program()?);
        command.args(self.arguments(study, out));
        Ok(command)
    }
}

/// The file of this program. The system's name for the running file is preferred, because the
/// original may have been rebuilt.
pub fn program() -> Result<PathBuf> {
    let running = Path::new("/proc/self/exe");
    if running.exists() {
        return Ok(running.to_owned());
    }
    std::env::current_exe()
        .map_err(|e| Error::Failed(format!("this program does not find itself: {e}")).into())
}

/// Answers one study with a baseline, in the process of a case.
pub fn answer(study: &Path, arguments: &Arguments) -> Result<()> {
    let method = arguments
        .method
        .first()
        .copied()
        .unwrap_or(Method::Diagnose);
    let (Some(baseline), Some(out)) = (method.baseline(), &arguments.common.out) else {
        return Err(Error::Config {
            key: "--answer".into(),
            message: "takes --out and a --method that is a baseline; `asid diagnose` answers by the diagnosis".into(),
        }
        .into());
    };
    let name = arguments
        .common
        .backend
        .clone()
        .unwrap_or_else(default_backend);
    let said = baseline::answer(
        baseline,
        backend(&name)?.into(),
        study,
        &arguments.without,
        arguments.common.seed.unwrap_or(0),
    )?;
    std::fs::create_dir_all(out).map_err(|e| Error::Failed(format!("{}: {e}", out.display())))?;
    write_json(&out.join("result.json"), &said)
}
