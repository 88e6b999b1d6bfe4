//! Options that several subcommands share.

use std::path::PathBuf;

use asid_effects::refined_model::RefinedModel;

/// Largest number of threads that may be requested.
const MAX_THREADS: usize = 1024;

/// Parses a number of threads.
pub fn threads(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|n| (1..=MAX_THREADS).contains(n))
        .ok_or_else(|| format!("not a whole number from 1 to {MAX_THREADS}"))
}

/// Parses a seed: a whole number that TOML can hold, so that every run can be repeated from its
/// file.
pub fn seed(text: &str) -> Result<u64, String> {
    /// Largest whole number of TOML.
    const LARGEST: u64 = i64::MAX as u64;
    text.parse()
        .ok()
        .filter(|seed| *seed <= LARGEST)
        .ok_or_else(|| format!("not a whole number from 0 to {LARGEST}"))
}

/// Largest number of runs or episodes that may be requested. It is far more than are ever played,
/// and small enough to count up from any seed.
const MAX_COUNT: u64 = 1_000_000;

/// Parses a number of runs or episodes.
pub fn count(text: &str) -> Result<u64, String> {
    text.parse()
        .ok()
        .filter(|n| (1..=MAX_COUNT).contains(n))
        .ok_or_else(|| format!("must be a whole number, at least 1 and at most {MAX_COUNT}"))
}

/// Options of every subcommand that works.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Common {
    /// Simulate with this engine: see `asid list` [default: for a task rapier, for a study or a model
    /// of your own MuJoCo, where they are built in]
    #[arg(long, value_name = "NAME")]
    pub backend: Option<String>,
    /// Seed all random numbers with this
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = seed)]
    pub seed: Option<u64>,
    /// Seed of the real world's machine, where it is another than that of the run.
    #[arg(skip)]
    pub machine: Option<u64>,
    /// Use this many threads; results do not depend on it, but where --minutes or --limit ends the
    /// work [default: one a core]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = threads)]
    pub threads: Option<usize>,
    /// Settings below those of `config`, from elsewhere than the command line.
    #[arg(skip)]
    pub base: toml::Table,
    /// Take settings from a file, such as a run's config.toml
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Set a value, such as explorer.iterations=10; `asid config TASK|STUDY` lists them
    /// (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Set the difficulty: default, or published (values of the paper or its code, defaults where
    /// they give none); a single value by --set difficulty.NAME=VALUE
    #[arg(long, value_name = "NAME")]
    pub preset: Option<String>,
    /// Write the results into this folder [default: the next free one below runs/]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Show no progress on standard error
    #[arg(long)]
    pub quiet: bool,
    /// Print the result as JSON, and nothing else, on standard output
    #[arg(long)]
    pub json: bool,
}

/// Names of the algorithms.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Algorithms {
    /// Explore by this algorithm: see `asid list`
    #[arg(long, value_name = "NAME")]
    pub explorer: Option<String>,
    /// Play this trained policy, as `asid explore --train FILE` saves it [default: the
    /// one that ships for the task, else it is trained on the spot]
    #[arg(long, value_name = "FILE")]
    pub policy: Option<PathBuf>,
    /// Identify by this algorithm: see `asid list`
    #[arg(long, value_name = "NAME")]
    pub identifier: Option<String>,
    /// Solve the task by this algorithm: see `asid list`
    #[arg(long, value_name = "NAME")]
    pub solver: Option<String>,
}

/// The simulator that a method works in.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Simulator {
    /// Simulate this model: MJCF, or TOML of a refined model, such as the refined.toml of a
    /// diagnosis [default: the task's scene, or the study's own model]
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// A refined model that is no file yet, in place of `model`.
    #[arg(skip)]
    pub refined: Option<RefinedModel>,
}

/// The simulated real world.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Real {
    /// Play in this kind of real world: matched (the simulator itself), crossed (the other engine),
    /// perturbed (step, contacts, masses, servos and tracker a little off) or stand-in (another
    /// object) [default: matched; with --model, --real-model, --real-effect or another
    /// --real-backend the world is called custom]
    #[arg(long, value_name = "KIND")]
    pub world: Option<String>,
    /// Give the real world this true value, which the methods do not see, such as mass_offset=0.06
    /// (repeatable) [default: drawn from the prior by the seed]
    #[arg(long, value_name = "NAME=VALUE")]
    pub truth: Vec<String>,
    /// Play the real world with this engine [default: the simulator's; the other one for --world
    /// crossed]
    #[arg(long, value_name = "NAME")]
    pub real_backend: Option<String>,
    /// Simulate the real world with this model: MJCF, or a refined.toml of a diagnosis [default:
    /// the task's scene]
    #[arg(long, value_name = "FILE")]
    pub real_model: Option<PathBuf>,
    /// Add an effect to the real world that the simulator lacks, such as
    /// viscous-friction@joint1:damping=2 (repeatable)
    #[arg(long, value_name = "NAME@SITE:PARAMETER=VALUE")]
    pub real_effect: Vec<String>,
}

impl Real {
    /// Whether any option describes a real world.
    #[must_use]
    pub fn is_described(&self) -> bool {
        self.first().is_some()
    }

    /// Name of the first option that describes a real world; `None` where none does.
    #[must_use]
    pub fn first(&self) -> Option<&'static str> {
        let Self {
            world,
            truth,
            real_backend,
            real_model,
            real_effect,
        } = self;
        let given = [
            ("--world", world.is_some()),
            ("--truth", !truth.is_empty()),
            ("--real-backend", real_backend.is_some()),
            ("--real-model", real_model.is_some()),
            ("--real-effect", !real_effect.is_empty()),
        ];
        let first = given.iter().find(|(_, is_given)| *is_given);
        first.map(|(name, _)| *name)
    }
}

/// The simulator of a method, and the real world that it is tried in.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Worlds {
    #[command(flatten)]
    pub simulator: Simulator,
    #[command(flatten)]
    pub real: Real,
}

impl From<&Simulator> for Worlds {
    /// The simulator alone, without a simulated real world.
    fn from(simulator: &Simulator) -> Self {
        Self {
            simulator: simulator.clone(),
            real: Real::default(),
        }
    }
}
