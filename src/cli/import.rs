//! `asid import`: turns logs of another stack into a study of a model.

mod files;
mod opened;
mod page;
mod remarks;
mod table;
mod wired;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::{Episode, Error};
use asid_diagnosis::study::Study;
use asid_logs::counted::check_units;
use asid_logs::episode::{ColumnMapping, LogNotes, angles, of_table, read_as, wanted};
use asid_logs::propose::{Proposal, propose};
use asid_logs::{LogFormat, LogSettings, Numberless, RawLog};
use asid_mjcf::Plant;
use asid_results::naming::joined;

use super::failure;
use super::machine::{Subject, sensors};
use super::output::OutFolder;
use opened::{Opened, open};

/// Arguments of `import`.
#[derive(clap::Args)]
#[command(after_help = "\
A log is a CSV file of any names (or a folder of such files), or, in a build with --features logs, an MCAP file with messages of ROS 2 or JSON, a bag of \
ROS 2 (a folder, or a file of SQLite), a LeRobot dataset of version 2 or 3 (all its episodes, or one as DATASET#3), or a \
Parquet file.

Which column is which sensor or command is proposed by names, units, ranges and fit, and shown with the reasons. Correct a wrong \
mapping by --map, or in the study's [[column]]. The folder holds study.toml, import.html (each column over time), and \
model.xml where the model had no sensors; `asid diagnose DIR` runs on it. Without --out nothing is written.")]
pub struct Arguments {
    /// The logs, one an episode; the last third of them is held out, unless --test adds others
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The model: MJCF, or a refined model (TOML)
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// Import this log as well, and hold it out; it is not one of LOG (repeatable)
    #[arg(long, value_name = "LOG")]
    test: Vec<PathBuf>,
    /// Write the study into this folder, new or empty
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Read this topic only (repeatable) [default: all that hold numbers]
    #[arg(long, value_name = "TOPIC")]
    topic: Vec<String>,
    /// Read a sensor or command from this column, such as ctrl.elbow=/arm/target.data.1, or the
    /// stamps of a table: time=host_clock (repeatable)
    #[arg(long, value_name = "NAME=COLUMN")]
    map: Vec<String>,
    /// Write the episodes as CSV files of the model's own names and units, in place of references
    /// to the logs
    #[arg(long)]
    copy: bool,
    /// The engine that tries the mapping: see `asid list`
    #[arg(long, value_name = "NAME")]
    backend: Option<String>,
    /// Show no progress on standard error
    #[arg(long)]
    quiet: bool,
    /// Print the mapping as JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

/// A log that is imported.
pub struct Imported {
    /// Its path, with `#` and the episode's number in a dataset.
    pub path: PathBuf,
    /// Whether it is held out.
    pub test: bool,
    /// The log as recorded.
    pub raw: RawLog,
    /// The log as an episode of the model.
    pub episode: Episode,
    /// Sensors whose angles jumped by a turn, with the number of jumps that were taken out.
    pub turns: Vec<(String, usize)>,
}

/// Runs the import.
pub fn import(arguments: &Arguments) -> Result<()> {
    let subject = Subject::open(&arguments.model, arguments.backend.as_deref())?;
    if subject.study.is_some() {
        return Err(Error::File {
            path: arguments.model.clone(),
            message: "is a study; --model is an MJCF file or a refined model".into(),
        }
        .into());
    }
    let out = match &arguments.out {
        Some(out) => Some(OutFolder::claim(Some(out), "import")?),
        None => None,
    };
    let mut notes = Vec::new();
    let bare = subject.plant.layout.sensors.is_empty();
    let subject = sensors::with_sensors(subject, &mut notes)?;
    let mut given = given(&arguments.map)?;
    let stamps = given.iter().position(|(name, _)| name == "time");
    let settings = LogSettings {
        kind: None,
        topics: arguments.topic.clone(),
        stamps: stamps.map(|place| given.remove(place).1),
    };
    let (raw, settings) = open(&arguments.logs, &arguments.test, settings)?;
    let kind = settings.kind.unwrap_or(LogFormat::Csv);
    if kind == LogFormat::Csv && !arguments.topic.is_empty() {
        return Err(Error::Config {
            key: "--topic".into(),
            message: "a CSV file has no topics".into(),
        }
        .into());
    }
    if !kind.is_table() && settings.stamps.is_some() {
        return Err(Error::Config {
            key: "--map time".into(),
            message: "each message of a recording has its own stamp: it is for tables".into(),
        }
        .into());
    }
    if raw.is_empty() {
        return Err(Error::Failed("no log holds an episode".into()).into());
    }
    let scene = &subject.source.scene;
    let whole = RawLog::joined(raw.iter().map(|(_, log, _)| log));
    let mut proposal = propose(scene, &subject.plant, (&whole, kind), &given)?;
    notes.extend(whole.remarks.iter().cloned());
    let numberless: Vec<String> = whole.numberless.iter().map(Numberless::told).collect();
    let numberless = table::listed(&numberless);
    notes.extend(numberless.map(|n| format!("columns without a number are not read: {n}")));
    if let Err(error) = complete(&proposal, &whole) {
        if !arguments.json {
            table::show(&proposal, whole.stamps.as_deref())?;
        }
        return Err(error);
    }
    check_units(&subject.plant, &proposal.mappings())?;
    let mut imported = episodes(raw, &subject, &proposal)?;
    let written = wired::study(&subject, &imported, &proposal);
    let written = Study {
        train: fitted(&imported),
        ..written
    };
    remarks::refuse_short(&written, &subject.plant, &imported)?;
    let turns = imported.iter().flat_map(|one| one.turns.clone()).collect();
    let counted = LogNotes {
        turns,
        ..LogNotes::default()
    };
    notes.extend(counted.lines());
    if !arguments.quiet {
        failure::note("trying the mapping in the model");
    }
    let found = wired::look(&subject, &mut imported, &mut proposal, &whole)?;
    notes.extend(found);
    notes.extend(remarks::remarks(&imported, &proposal));
    let study = files::Files {
        subject: &subject,
        given: &arguments.model,
        bare,
        settings: &settings,
        proposal: &proposal,
        imported: &imported,
        copy: arguments.copy,
    };
    if let Some(out) = &out {
        let page = page::page(&study, &notes);
        out.write(|folder| study.write(folder, &out.path(), &page))?;
    }
    if arguments.json {
        return table::json(&proposal, whole.stamps.as_deref(), &notes, out.as_ref());
    }
    table::show(&proposal, whole.stamps.as_deref())?;
    notes.iter().for_each(|note| failure::note(note));
    let mut stdout = std::io::stdout().lock();
    let written = match out {
        Some(out) => study.written(&out.path()),
        None => "nothing is written without --out DIR".into(),
    };
    Ok(writeln!(stdout, "{written}")?)
}

/// The episodes that a study of these logs fits, by the paths of their logs.
fn fitted(imported: &[Imported]) -> Vec<(String, Episode)> {
    let all = files::episodes(imported).into_iter().enumerate();
    let fitted = all.filter(|(_, (_, held))| !held);
    fitted
        .map(|(i, (episode, _))| (i.to_string(), episode))
        .collect()
}

fn given(map: &[String]) -> Result<Vec<(String, String)>> {
    let one = |text: &String| {
        let (name, column) = text.split_once('=').ok_or_else(|| Error::Config {
            key: "--map".into(),
            message: format!("`{text}` is not NAME=COLUMN, such as ctrl.elbow=/arm/target.data.1"),
        })?;
        if name.is_empty() || column.is_empty() {
            return Err(Error::Config {
                key: "--map".into(),
                message: format!("`{text}` lacks a name: NAME=COLUMN has one on either side"),
            }
            .into());
        }
        Ok((name.to_owned(), column.to_owned()))
    };
    let all: Vec<(String, String)> = map.iter().map(one).collect::<Result<_>>()?;
    for (i, (name, column)) in all.iter().enumerate() {
        if let Some((_, other)) = all[..i].iter().find(|(n, c)| n == name && c != column) {
            return Err(Error::Config {
                key: "--map".into(),
                message: format!("gives `{name}` two columns, `{other}` and `{column}`"),
            }
            .into());
        }
    }
    Ok(all)
}

/// Refuses a mapping from which no diagnosis can start; `log` is where it was sought.
fn complete(proposal: &Proposal, log: &RawLog) -> Result<()> {
    let refuse = |message: String| {
        Err(Error::Config {
            key: "--map".into(),
            message: format!("{message}; {}", left(proposal, log)),
        }
        .into())
    };
    let missing = proposal.missing_commands();
    let quoted: Vec<String> = missing.iter().map(|name| format!("`{name}`")).collect();
    match *missing {
        [] => {}
        [name] => {
            return refuse(format!(
                "no column is the command of actuator `{name}`; a diagnosis needs what was sent: --map ctrl.{name}=COLUMN names it"
            ));
        }
        [first, ..] => {
            return refuse(format!(
                "no column is the command of the actuators {}; a diagnosis needs what was sent: name each, such as --map ctrl.{first}=COLUMN",
                joined(&quoted, "and")
            ));
        }
    }
    if proposal.readings() == 0 {
        return refuse("no column is a sensor of the model: --map SENSOR=COLUMN names one".into());
    }
    Ok(())
}

/// Text on the unused columns that may hold what is missing.
fn left(proposal: &Proposal, log: &RawLog) -> String {
    let unused = match table::listed(&proposal.unused) {
        None => "nothing is left in the log".to_owned(),
        Some(names) => format!("left are {names}"),
    };
    let numberless: Vec<String> = log.numberless.iter().map(Numberless::told).collect();
    match table::listed(&numberless) {
        None => unused,
        Some(names) => format!("{unused}; without a number are {names}"),
    }
}

/// The logs as episodes of the model.
fn episodes(raw: Vec<Opened>, subject: &Subject, proposal: &Proposal) -> Result<Vec<Imported>> {
    let mappings = proposal.mappings();
    let one = |(path, raw, test): Opened| {
        let (episode, notes) = episode(&path, &raw, &subject.plant, &mappings)?;
        Ok(Imported {
            path,
            test,
            raw,
            episode,
            turns: notes.turns,
        })
    };
    raw.into_iter().map(one).collect()
}

/// A log as an episode of a model, as a study would read it.
fn episode(
    path: &Path,
    raw: &RawLog,
    plant: &Plant,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes)> {
    let (layout, angles) = (&plant.layout, angles(plant, mappings));
    let columns = (mappings, &angles[..]);
    if raw.stamps.is_some() {
        return Ok(read_as(LogFormat::of(path), path, layout, columns)?);
    }
    let [commands, readings] = wanted(layout, mappings);
    let (table, streams) = raw.table(&commands, &readings, &angles);
    let (episode, mut notes) = of_table(path, &table, layout, columns)?;
    notes.turns.extend(streams.turns);
    Ok((episode, notes))
}
