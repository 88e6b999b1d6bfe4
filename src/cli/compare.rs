//! `asid compare`: compares methods over tasks, conditions, worlds, engines and seeds.
//!
//! The crate `asid-comparison` defines comparisons, their files and their tables; this module runs
//! their cells.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_comparison::method::{BY_DEFAULT, ORACLE};
use asid_comparison::rows::ComparisonResult;
use asid_comparison::shard::Shard;
use asid_core::Error;

use super::figure;
use super::options::{Common, Simulator, threads};
use super::settings;

pub mod arm;
mod cell;
mod folder;
mod given;
mod merge;
mod methods;
mod of_run;
pub mod page;
mod progress;
mod request;
mod resume;
mod signals;
mod submit;
mod train;
mod work;
mod worker;

/// Arguments of `compare`.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Compare on these tasks [default: all]
    tasks: Vec<String>,
    /// Method: asid, asid-ppo, asid-estimator, maxmi, max, random, dr, oracle (which is told the
    /// truth), or any other as NAME=explorer+identifier+solver (repeatable) [default: asid,
    /// random, dr]
    #[arg(long, value_name = "M")]
    method: Vec<String>,
    /// Condition of the task, such as left; `prior` draws truths from the whole prior (repeatable)
    /// [default: all of the task's own; prior where it has none]
    #[arg(long, value_name = "NAME")]
    condition: Vec<String>,
    /// Play in this kind of real world, such as matched, crossed or perturbed (repeatable)
    /// [default: matched; with --model, --real-model, --real-effect or another --real-backend the
    /// world is called custom]
    #[arg(long, value_name = "KIND")]
    world: Vec<String>,
    /// Simulate with this engine: see `asid list` (repeatable)
    #[arg(long, value_name = "NAME")]
    backend: Vec<String>,
    /// Run each row with this many seeds [default: 10; 3 with --quick]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = super::options::count)]
    seeds: Option<u64>,
    /// Begin each row with this seed; its other runs count up from it
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = super::options::seed)]
    seed: Option<u64>,
    /// Make a table of the paper: its tasks, conditions, methods and world, unless others are named
    #[arg(long, value_name = "1|2|3")]
    table: Option<u8>,
    /// Draw a figure instead: patches, displacement, laptop, distractors, learned-model or
    /// generalization, as in the paper; explorers or difficulty
    #[arg(long, value_name = "NAME")]
    figure: Option<String>,
    /// Play this many episodes of each explorer in a figure, or of each square of its map
    #[arg(long, value_name = "N", requires = "figure", allow_negative_numbers = true, value_parser = super::options::count)]
    episodes: Option<u64>,
    /// Explorer that a figure shows in place of its own; settings may follow, as in
    /// fisher-cem:fisher.objective=trace+fisher.form=one-step (repeatable)
    #[arg(long, value_name = "NAME")]
    explorer: Vec<String>,
    /// Draw the figure `difficulty` at these levels, such as ledge_width=0.04,0.02,0.01
    #[arg(long, value_name = "NAME=VALUE,…", requires = "figure")]
    levels: Option<String>,
    /// Take a quick look: fewer seeds and searches cut to half, marked so in every output
    #[arg(long)]
    quick: bool,
    /// Train the explorers and estimators that learn, in place of what ships
    #[arg(long)]
    train: bool,
    /// Run only a share of the cells, such as 2/4; shares may write into one folder, or be merged
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Submit the comparison as a job array of this scheduler, into one folder; the only one is
    /// slurm
    #[arg(long, value_name = "SCHEDULER", value_parser = ["slurm"])]
    submit: Option<String>,
    /// Split the job array into this many tasks [default: one a run, at most 32]
    #[arg(long, value_name = "N", requires = "submit")]
    jobs: Option<usize>,
    /// Give sbatch an option, such as --sbatch=--time=02:00:00 (repeatable)
    #[arg(
        long,
        value_name = "OPTION",
        requires = "submit",
        allow_hyphen_values = true
    )]
    sbatch: Vec<String>,
    /// Print the job array's script and submit nothing
    #[arg(long, requires = "submit")]
    print_script: bool,
    /// Merge finished comparisons, such as those of several machines, instead of running one
    #[arg(long, value_name = "DIR", num_args = 1..)]
    merge: Vec<PathBuf>,
    /// Allow rows of different commits in one table; each row is of one commit and names it
    #[arg(long, requires = "merge")]
    across_commits: bool,
    /// Play this many runs side by side, one a thread; results do not depend on it [default: one a
    /// core]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = threads)]
    threads: Option<usize>,
    /// Take settings from a file, such as a comparison's or a run's config.toml
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Set the difficulty of all tasks: default, or published; a single value by --set
    /// difficulty.NAME=VALUE
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Set a value, such as solver.iterations=10, for every method that has it (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the results; one that holds a part of this comparison is resumed
    /// [default: the next free one below runs/]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Show no progress on standard error
    #[arg(long)]
    quiet: bool,
    /// Print the result as JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    simulator: Simulator,
    #[command(flatten)]
    real: Real,
    #[command(flatten)]
    parts: Parts,
}

/// The real world of every run, but for its kind.
#[derive(clap::Args, Clone)]
struct Real {
    /// Give the real world this true value, which the methods do not see, such as mass_offset=0.06
    /// [default: that of the condition, else drawn]
    #[arg(long, value_name = "NAME=VALUE")]
    truth: Vec<String>,
    /// Play the real world with this engine [default: the simulator's]
    #[arg(long, value_name = "NAME")]
    real_backend: Option<String>,
    /// Simulate the real world with this model: MJCF, or a refined.toml of a diagnosis [default:
    /// the task's scene]
    #[arg(long, value_name = "FILE")]
    real_model: Option<PathBuf>,
    /// Add an effect to the real world that the simulator lacks (repeatable)
    #[arg(long, value_name = "NAME@SITE:PARAMETER=VALUE")]
    real_effect: Vec<String>,
}

/// Options of `run` that make no sense here: a row's name stands for its parts.
#[derive(clap::Args, Clone)]
struct Parts {
    #[arg(long, hide = true)]
    identifier: Option<String>,
    #[arg(long, hide = true)]
    solver: Option<String>,
}

impl Arguments {
    /// The request of a figure.
    ///
    /// # Errors
    /// When the settings cannot be read.
    fn figure_request(&self) -> Result<figure::Request<'_>> {
        let mut common = Common {
            backend: self.backend.first().cloned(),
            seed: self.seed,
            threads: self.threads,
            config: self.config.clone(),
            set: self.set.clone(),
            out: self.out.clone(),
            quiet: self.quiet,
            json: self.json,
            ..Common::default()
        };
        if common.seed.is_none() {
            // Each episode has a seed of its own; they count up from that of the settings.
            common.seed = settings::seed(&settings::given(&common)?)?;
        }
        Ok(figure::Request {
            common,
            tasks: self.tasks.clone(),
            episodes: self.episodes,
            explorers: self.explorer.clone(),
            levels: self.levels.clone(),
            quick: self.quick,
            compare: Box::new(|task, setting, folder| self.compare_at(task, setting, folder)),
        })
    }

    /// The comparison on a task that these arguments request, under one more setting and in a
    /// folder of its own.
    fn compare_at(&self, task: &str, setting: &str, folder: &Path) -> Result<ComparisonResult> {
        let mut own = Self {
            tasks: vec![task.to_owned()],
            figure: None,
            explorer: Vec::new(),
            out: Some(folder.to_owned()),
            ..self.clone()
        };
        own.set.push(setting.to_owned());
        if own.method.is_empty() {
            own.method = BY_DEFAULT.map(str::to_owned).to_vec();
            own.method.push(ORACLE.to_owned());
        }
        let outcome = work::run(&own)?;
        match (outcome.failed, outcome.summed) {
            (Some(error), _) => Err(error),
            (None, Some(summed)) => Ok(summed.result),
            (None, None) => Err(Error::Failed("a share of a figure is no figure".into()).into()),
        }
    }
}

/// Runs the comparison, or its missing cells, and writes its folder.
pub fn compare(arguments: &Arguments) -> Result<()> {
    if let Some(name) = &arguments.figure {
        arguments.check_figure(name)?;
        return figure::figure(name, &arguments.figure_request()?);
    }
    let parts = &arguments.parts;
    for (option, part) in [
        ("--explorer", &arguments.explorer.first().cloned()),
        ("--identifier", &parts.identifier),
        ("--solver", &parts.solver),
    ] {
        if let Some(name) = part {
            return Err(Error::Config {
                key: format!("{option} {name}"),
                message: "a row is named after its parts: name the method, such as --method \
                          NAME=explorer+identifier+solver"
                    .into(),
            }
            .into());
        }
    }
    if !arguments.merge.is_empty() {
        arguments.check_merge()?;
        return merge::merge(arguments);
    }
    if arguments.submit.is_some() {
        return submit::submit(arguments);
    }
    work::work(arguments)
}
