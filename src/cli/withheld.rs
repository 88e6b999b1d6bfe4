//! `asid withheld`: answers cases whose cause is withheld and scores the answers; it also makes
//! such cases.
//!
//! Each case is answered in a process of its own that sees a copy of the study and nothing else.
//! The labels are read after every answer is there, and only by this process.

mod cases;
mod child;
mod control;
mod isolate;
mod jobs;
mod kept;
mod make;
mod method;
mod score;
mod seal;
mod sensitivity;
mod written;

use std::path::PathBuf;

use anyhow::Result;
use asid_comparison::shard::Shard;
use asid_core::Error;

use super::options::Common;
use control::Control;
use make::Half;
use method::Method;

/// Arguments of `withheld`.
#[derive(clap::Args)]
#[command(after_help = "\
The folder of --cases holds one study a case. Each is answered in a process of its own, which sees a copy of the study \
and nothing else; then the labels are read, once, and the answers scored: right or not, probabilities, ambiguity sets, \
false alarms, the gap closed, by machine, cause, magnitude and fault of the log (docs/withheld.md). A case without an \
answer, by an error or by --limit, counts as wrong. Cases that the engine cannot simulate are left out, with the reason.

OUT/answers keeps each answer with a hash of program, study and settings of the diagnosis. Repeating the command skips \
the answers whose hash is the same, and scores again. With --shard i/n a call answers its share and scores nothing; the same call without it, in the same OUT, \
scores all.

With --make a folder of new cases is written instead: DIR/studies, which is for --cases, and apart from it \
DIR/sealed/labels.json, which is for --labels.")]
#[group(id = "work", required = true, args = ["cases", "make", "answer"])]
pub struct Arguments {
    /// Diagnose the cases in this folder and score the answers
    #[arg(long, value_name = "DIR")]
    cases: Option<PathBuf>,
    /// Read the labels from this file [default: labels.json in the folder of the cases]
    #[arg(long, value_name = "FILE", requires = "cases")]
    labels: Option<PathBuf>,
    /// Make new cases in this folder; takes --seed
    #[arg(long, value_name = "DIR")]
    make: Option<PathBuf>,
    /// Machines that others modelled, beside those of the project: a folder that
    /// withheld/models/fetch.py filled
    #[cfg(feature = "mujoco")]
    #[arg(long, value_name = "DIR", requires = "make")]
    models: Option<PathBuf>,
    /// Make this many cases
    #[arg(long, value_name = "N", default_value_t = 40, requires = "make")]
    count: usize,
    /// Make cases of the machines of this half: training or test
    #[arg(
        long,
        value_name = "HALF",
        default_value = "training",
        requires = "make"
    )]
    half: Half,
    #[cfg(feature = "mujoco")]
    #[command(flatten)]
    wanted: make::Wanted,
    /// Take only this case (repeatable)
    #[arg(long, value_name = "NAME")]
    case: Vec<String>,
    /// Let this answer: diagnose, or a baseline (repeatable) [default: diagnose]
    #[arg(long, value_name = "NAME")]
    method: Vec<Method>,
    /// Answer this share of the cases, such as 1/4, and score nothing
    #[arg(
        long,
        value_name = "i/n",
        requires = "cases",
        conflicts_with = "only_score"
    )]
    shard: Option<Shard>,
    /// Answer this many cases side by side [default: one a core, less those that --threads takes]
    #[arg(long, value_name = "N", value_parser = super::options::threads)]
    jobs: Option<usize>,
    /// Give each case this long, s; one over it counts as wrong [default: no limit]
    #[arg(long, value_name = "SECONDS")]
    limit: Option<f64>,
    /// Score the answers that OUT holds, whatever made them, and answer nothing
    #[arg(long, requires = "cases")]
    only_score: bool,
    /// Repeat the decisions of the answers that OUT holds with each number that decides halved and
    /// doubled; replays nothing
    #[arg(long, requires = "cases", conflicts_with_all = ["shard", "control", "only_score"])]
    sensitivity: bool,
    /// Score by names alone: without replays no set counts as the same physics, and no gap as the
    /// best possible
    #[arg(long, requires = "cases")]
    names_only: bool,
    /// Spoil the check on purpose, to see that it fails: scrambled labels, noise in place of the
    /// logs, or a catalogue without the true effects
    #[arg(long, value_name = "NAME", requires = "cases")]
    control: Option<Control>,
    /// Leave out an effect of the catalogue (repeatable)
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// Divide the time step of the MJCF model of every case by this
    #[arg(long, value_name = "N", default_value_t = 1, requires = "cases")]
    finer: u32,
    /// Answer this study by a baseline.
    #[arg(long, value_name = "DIR", hide = true)]
    answer: Option<PathBuf>,
    #[command(flatten)]
    pub common: Common,
}

/// Makes cases, or answers all cases and scores them.
pub fn withheld(arguments: &Arguments) -> Result<()> {
    let wrong = |key: &str, message: &str| {
        Err(Error::Config {
            key: key.into(),
            message: message.into(),
        }
        .into())
    };
    if arguments.common.config.is_some() {
        return wrong(
            "--config",
            "is not taken here: give settings of the diagnosis by --set",
        );
    }
    if arguments.limit.is_some_and(|l| !(l.is_finite() && l > 0.0)) {
        return wrong("--limit", "is a time above 0, in seconds");
    }
    if arguments.finer == 0 {
        return wrong("--finer", "is a whole number from 1 on");
    }
    match (&arguments.cases, &arguments.make, &arguments.answer) {
        (Some(cases), ..) => score::score(cases, arguments),
        (_, Some(folder), _) => make::make(folder, arguments),
        (_, _, Some(study)) => method::answer(study, arguments),
        (None, None, None) => Ok(()),
    }
}
