//! `asid withheld`: diagnoses of cases whose effect is withheld, scored.
//!
//! The labels are read only when every diagnosis is done, and by this command alone.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use asid_core::Error;
use asid_core::progress::Silent;
use asid_diagnosis::diagnose::{Settings, diagnose};
use asid_diagnosis::same_physics::same_physics;
use asid_diagnosis::score::{Answer, Label, Score, read_labels};
use asid_diagnosis::study::Study;

use super::diagnose::{default_backend, machine};
use super::failure;
use super::options::Common;
use super::output::{OutFolder, write_json};
use super::progress::Bars;
use asid_core::Progress as _;

/// Arguments of `withheld`.
#[derive(clap::Args)]
#[command(after_help = "\
The folder holds one study a case, and labels.json, which is read once all diagnoses are done. The result has \
a line a case, the confusion matrix and the figures of docs/diagnosis.md. Cases that the engine cannot simulate are \
left out, with the reason.

With --make a folder of new cases is written instead: DIR/studies, which is for --cases, and apart from it \
DIR/sealed/labels.json, which is for --labels.")]
#[group(id = "work", required = true, args = ["cases", "make"])]
pub struct Arguments {
    /// Diagnose the cases in this folder, and score them
    #[arg(long, value_name = "DIR", conflicts_with = "make")]
    cases: Option<PathBuf>,
    /// Read the labels from this file [default: labels.json in the folder of the cases]
    #[arg(long, value_name = "FILE", requires = "cases")]
    labels: Option<PathBuf>,
    /// Make new cases in this folder; takes --seed
    #[arg(long, value_name = "DIR")]
    make: Option<PathBuf>,
    /// Machines that others modelled, beside those of the project: a folder that withheld/models/fetch.py filled
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
    /// Take only this case (repeatable)
    #[arg(long, value_name = "NAME")]
    case: Vec<String>,
    /// Leave out an effect of the catalogue (repeatable)
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// Divide the time step of every model by this
    #[arg(long, value_name = "N", default_value_t = 1)]
    finer: u32,
    #[command(flatten)]
    pub common: Common,
}

/// Half of the machines.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Half {
    /// Settings of a diagnosis may be chosen on it
    Training,
    /// Nothing may be chosen on it
    Test,
}

/// Folders with a study, sorted.
fn cases(folder: &Path, only: &[String]) -> Result<Vec<PathBuf>> {
    let fail = |message: String| Error::File {
        path: folder.to_owned(),
        message,
    };
    let entries = std::fs::read_dir(folder).map_err(|e| fail(e.to_string()))?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.join("study.toml").is_file())
        .filter(|p| only.is_empty() || only.contains(&name(p)))
        .collect();
    found.sort();
    if found.is_empty() {
        return Err(fail("holds no folder with a study.toml".into()).into());
    }
    Ok(found)
}

fn name(path: &Path) -> String {
    path.file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Whether an engine says that it cannot simulate a scene.
fn is_refusal(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(Error::Scene { .. }))
}

/// Makes new cases.
#[cfg(feature = "mujoco")]
fn make(folder: &Path, arguments: &Arguments) -> Result<()> {
    let common = &arguments.common;
    let half = match arguments.half {
        Half::Training => asid_withheld::Half::Training,
        Half::Test => asid_withheld::Half::Test,
    };
    let seed = common.seed.unwrap_or(0);
    let bars = Bars::new(common.quiet);
    bars.begin("cases", arguments.count as u64);
    let done = || bars.advance(1);
    let make = || {
        let outside = match &arguments.models {
            Some(models) => {
                let found = asid_withheld::outside::read(models, half)?;
                for why in &found.refused {
                    failure::note(why);
                }
                found.machines
            }
            None => Vec::new(),
        };
        asid_withheld::make::make(folder, half, seed, arguments.count, &outside, &done)
    };
    let made = asid_withheld::make::with_threads(common.threads.unwrap_or(0), make)
        .map_err(|e| Error::Failed(e.to_string()))?;
    bars.end();
    let mut stdout = std::io::stdout().lock();
    if common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&made)?)?;
    } else {
        for line in made.lines() {
            writeln!(stdout, "{line}")?;
        }
    }
    Ok(())
}

/// Without MuJoCo there are no worlds.
#[cfg(not(feature = "mujoco"))]
fn make(folder: &Path, arguments: &Arguments) -> Result<()> {
    let message = format!(
        "{}: {} cases of the {:?} half are worlds in MuJoCo: build with --features mujoco",
        folder.display(),
        arguments.count,
        arguments.half,
    );
    Err(Error::Failed(message).into())
}

/// Makes cases, or diagnoses all cases and scores them.
pub fn withheld(arguments: &Arguments) -> Result<()> {
    match (&arguments.cases, &arguments.make) {
        (Some(cases), _) => score(cases, arguments),
        (None, Some(folder)) => make(folder, arguments),
        (None, None) => Ok(()),
    }
}

/// Diagnoses all cases of a folder and scores them.
fn score(folder: &Path, arguments: &Arguments) -> Result<()> {
    let common = &arguments.common;
    let folders = cases(folder, &arguments.case)?;
    let engine = common.backend.clone().unwrap_or_else(default_backend);
    let out = common
        .out
        .as_deref()
        .map(|path| OutFolder::claim(Some(path), "withheld"))
        .transpose()?;
    let settings = Settings {
        seed: common.seed.unwrap_or(0),
        without: arguments.without.clone(),
        ..Settings::default()
    };
    let bars = Bars::new(common.quiet);
    let mut done = Vec::with_capacity(folders.len());
    let mut left_out = BTreeMap::new();
    bars.begin("cases", folders.len() as u64);
    for case in &folders {
        let clock = Instant::now();
        let mut study = Study::read(case)?;
        if arguments.finer > 1 {
            let step = asid_mjcf::Plant::of(&study.scene)?.layout.timestep;
            study.scene = study
                .scene
                .with_timestep(step / f64::from(arguments.finer))?;
        }
        let machine = match machine(&study, &engine, common.threads.unwrap_or(0)) {
            Err(error) if is_refusal(&error) => {
                failure::note(&format!("{}: left out: {error}", study.name));
                left_out.insert(study.name, error.to_string());
                bars.advance(1);
                continue;
            }
            machine => machine?,
        };
        let (diagnosis, work) = diagnose(&study, machine, settings.clone(), &Silent)?;
        let seconds = clock.elapsed().as_secs_f64();
        failure::note(&format!(
            "{}: {seconds:.1} s: {}",
            study.name, diagnosis.result.sentence
        ));
        done.push((study, diagnosis, work, seconds));
        bars.advance(1);
    }
    bars.end();
    // Everything is decided; now the labels.
    let beside = folder.join("labels.json");
    let file = arguments.labels.as_deref().unwrap_or(&beside);
    let labels = read_labels(file)?;
    let mut answers = Vec::new();
    for (study, diagnosis, work, seconds) in &done {
        let label: &Label = labels.get(&study.name).ok_or_else(|| Error::File {
            path: file.to_owned(),
            message: format!("has no label of `{}`", study.name),
        })?;
        let class = same_physics(work, &diagnosis.result, label)?;
        answers.push(Answer::new(
            &study.name,
            &diagnosis.result,
            label,
            class,
            *seconds,
        ));
    }
    let score = Score::of(answers, left_out);
    if let Some(out) = &out {
        out.write(|folder| {
            write_json(&folder.join("result.json"), &score)?;
            for (study, diagnosis, _, _) in &done {
                write_json(
                    &folder.join(format!("{}.json", study.name)),
                    &diagnosis.result,
                )?;
            }
            Ok(())
        })?;
    }
    let mut stdout = std::io::stdout().lock();
    if common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&score)?)?;
    } else {
        for line in score.lines() {
            writeln!(stdout, "{line}")?;
        }
    }
    Ok(())
}
