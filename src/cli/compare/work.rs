//! The work of a comparison: which cells are missing, and running them.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use asid_comparison::cell::{Cell, CellKey, Failure};
use asid_comparison::document::Document;
use asid_comparison::schedule;
use asid_comparison::settings::first_difference;
use asid_comparison::store::{Store, write};
use asid_core::Error;

use super::arm::Arm;
use super::cell::{COMMIT, VERSION};
use super::folder::{claim, contents, sum_up};
use super::progress::Progress;
use super::request::{document, missing_part};
use super::signals::{how_to_go_on, watch};
use super::train::Trainer;
use super::{Arguments, cell};
use crate::cli::{failure, session};

/// Task, method, world and engine: what shares its settings.
type ArmName = [String; 4];

/// The settings of every arm, or why it cannot be run.
type Arms = HashMap<ArmName, Result<Arm, String>>;

fn arm_name(key: &CellKey) -> ArmName {
    [&key.task, &key.method, &key.world, &key.backend].map(String::clone)
}

/// Runs what is missing of the comparison and sums it up once nothing is.
pub fn work(arguments: &Arguments) -> Result<()> {
    let document = document(arguments)?;
    let keys = document.plan.cells();
    let mut arms = arms(&document, &keys)?;
    probe(&keys, &arms)?;
    let store = claim(arguments.out.as_deref())?;
    same_comparison(arguments, &store, &document)?;
    if !document.plan.train {
        // Cells that do not belong here are told of before anything is written.
        pending(arguments, &store, &keys, &arms)?;
    }
    write(&store.config(), &document.text()?)?;
    let drain = watch(store.root())?;
    if document.plan.train {
        train(arguments, &store, &document, &keys, &mut arms)?;
    }
    for arm in arms.values().flatten() {
        store.keep_settings(&arm.hash, &arm.canonical)?;
    }
    let pending = pending(arguments, &store, &keys, &arms)?;
    if !pending.is_empty() && arguments.shard.is_none() {
        // What was said of fewer cells does not hold any more.
        let _ = std::fs::remove_file(store.root().join("result.json"));
    }
    let worker = Worker {
        store: &store,
        arms: &arms,
        progress: Progress::new(arguments.quiet, pending.len()),
        trouble: Mutex::default(),
    };
    let threads = match arguments.threads {
        Some(n) => n,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let work = |key: &CellKey| worker.run(key);
    let done = |key: &CellKey, result| worker.done(key, result);
    schedule::run(&pending, threads, &drain, work, done)?;
    worker.progress.end();
    let trouble = worker
        .trouble
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    if let Some(error) = trouble.unwritten {
        return Err(error);
    }
    finish(arguments, &store, &document, &keys, trouble.first)
}

/// Checks a comparison as far as can be told before any work.
///
/// # Errors
/// When a setting is wrong or an engine is missing.
pub fn check(document: &Document) -> Result<()> {
    let keys = document.plan.cells();
    let arms = arms(document, &keys)?;
    probe(&keys, &arms)
}

/// Trains what learns, once for all cells that use it; what cannot be trained is ruled out.
fn train(
    arguments: &Arguments,
    store: &Store,
    document: &Document,
    keys: &[CellKey],
    arms: &mut Arms,
) -> Result<()> {
    let trainer = Trainer {
        store,
        seed: document.plan.first_seed,
        threads: arguments.threads,
        quiet: arguments.quiet,
    };
    let mut done: Vec<ArmName> = Vec::new();
    for key in keys {
        let name = arm_name(key);
        let Some(Ok(arm)) = arms.get(&name) else {
            continue;
        };
        if done.contains(&name) {
            continue;
        }
        let method = arm.method.clone();
        let trained = match trainer.train(arm, key) {
            Ok(settings) if settings.is_empty() => None,
            Ok(settings) => Some(Ok(Arm::resolve(document, &method, key, &settings)?)),
            Err(error) => Some(Err(format!("{error:#}"))),
        };
        if let Some(arm) = trained {
            arms.insert(name.clone(), arm);
        }
        done.push(name);
    }
    Ok(())
}

/// What came in the way of a comparison.
#[derive(Default)]
struct Trouble {
    /// Arms of which no cell can be run.
    ruled_out: Vec<ArmName>,
    /// The first error of a cell, by the plan's order.
    first: Option<anyhow::Error>,
    /// A result that could not be kept.
    unwritten: Option<anyhow::Error>,
}

/// Runs cells and keeps what comes of them.
struct Worker<'w> {
    store: &'w Store,
    arms: &'w Arms,
    progress: Progress,
    trouble: Mutex<Trouble>,
}

impl Worker<'_> {
    fn trouble(&self) -> std::sync::MutexGuard<'_, Trouble> {
        self.trouble.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A cell and its seconds; none where its arm was ruled out meanwhile.
    fn run(&self, key: &CellKey) -> Result<Option<(Cell, f64)>> {
        let name = arm_name(key);
        let arm = match self.arms.get(&name) {
            Some(Ok(arm)) => arm,
            Some(Err(why)) => return Err(missing(why.clone())),
            None => return Err(Error::Failed("no such arm".into()).into()),
        };
        if self.trouble().ruled_out.contains(&name) {
            return Ok(None);
        }
        cell::run(arm, key).map(Some)
    }

    fn done(&self, key: &CellKey, result: Result<Result<Option<(Cell, f64)>>, schedule::Panic>) {
        let result =
            result.unwrap_or_else(|panic| Err(Error::Failed(failure::of_panic(&*panic)).into()));
        let kept = match result {
            Ok(None) => Ok(()),
            Ok(Some((cell, wall_s))) => self.store.keep(&cell, Some(wall_s)),
            Err(error) => {
                // A call that is wrong for one cell of an arm is wrong for all of them.
                let usage = error.downcast_ref::<Error>().is_some_and(Error::is_usage);
                let failure = Failure {
                    key: key.clone(),
                    reason: format!("{error:#}")
                        .split_whitespace()
                        .collect::<Vec<_>>()
                        .join(" "),
                    of_all: usage,
                };
                let mut trouble = self.trouble();
                if usage {
                    trouble.ruled_out.push(arm_name(key));
                }
                trouble.first.get_or_insert(error);
                self.store.fail(&failure)
            }
        };
        if let Err(error) = kept {
            self.trouble().unwritten.get_or_insert(error.into());
        }
        self.progress.advance(key);
    }
}

fn missing(why: String) -> anyhow::Error {
    Error::Config {
        key: "method".into(),
        message: why,
    }
    .into()
}

/// The settings of every arm, or why it cannot be run in this build.
fn arms(document: &Document, keys: &[CellKey]) -> Result<Arms> {
    let mut arms = HashMap::new();
    for key in keys {
        let name = arm_name(key);
        if arms.contains_key(&name) {
            continue;
        }
        let Some(method) = document.plan.method(&key.method) else {
            continue;
        };
        let arm = match missing_part(method) {
            Some(why) => Err(why.to_string()),
            None => Ok(Arm::resolve(document, method, key, &[])?),
        };
        arms.insert(name, arm);
    }
    Ok(arms)
}

/// Opens one session of each task and engine, so that a wrong call ends before any work.
fn probe(keys: &[CellKey], arms: &Arms) -> Result<()> {
    let mut probed: Vec<(&str, &str)> = Vec::new();
    for key in keys {
        let pair = (&*key.task, &*key.backend);
        if let Some(Ok(arm)) = arms.get(&arm_name(key))
            && !probed.contains(&pair)
        {
            cell::open(arm, key)?;
            probed.push(pair);
        }
    }
    Ok(())
}

/// Cells of this share that are not there; those that are there must belong to this comparison.
fn pending(
    arguments: &Arguments,
    store: &Store,
    keys: &[CellKey],
    arms: &Arms,
) -> Result<Vec<CellKey>> {
    let mut engines: HashMap<&str, String> = HashMap::new();
    let mut pending = Vec::new();
    for (place, key) in keys.iter().enumerate() {
        match store.cell(key)? {
            Some(cell) => {
                if !engines.contains_key(&*key.backend) {
                    let backend = session::backend(&key.backend)?;
                    let engine = format!("{} {}", backend.name(), backend.version());
                    engines.insert(&key.backend, engine);
                }
                if let Some(Ok(arm)) = arms.get(&arm_name(key)) {
                    check_cell(store, &cell, arm, &engines[&*key.backend])?;
                }
            }
            None if arguments.shard.is_none_or(|s| s.holds(place)) => pending.push(key.clone()),
            None => {}
        }
    }
    Ok(pending)
}

/// Whether a cell that is there is one that would be run now.
fn check_cell(store: &Store, cell: &Cell, arm: &Arm, engine: &str) -> Result<()> {
    let method = (
        &arm.method.explorer,
        &arm.method.identifier,
        &arm.method.solver,
    );
    let difference = if (&cell.explorer, &cell.identifier, &cell.solver) != method {
        format!("as {}+{}+{}", cell.explorer, cell.identifier, cell.solver)
    } else if cell.settings != arm.hash {
        let now = arm.canonical.parse::<toml::Table>().ok();
        match (store.settings(&cell.settings), now) {
            (Some(then), Some(now)) => {
                format!("with other settings: {}", first_difference(&then, &now))
            }
            _ => format!("with other settings, {}", cell.settings),
        }
    } else if (&*cell.versions.git, &*cell.versions.asid) != (COMMIT, VERSION) {
        format!("by commit {} ({})", cell.versions.git, cell.versions.asid)
    } else if cell.versions.engine != engine {
        format!("on {}", cell.versions.engine)
    } else {
        return Ok(());
    };
    Err(Error::File {
        path: store.place(&cell.key),
        message: format!("was made {difference}; choose another --out"),
    }
    .into())
}

/// Whether the folder is new or holds a comparison that this one goes on with.
fn same_comparison(arguments: &Arguments, store: &Store, document: &Document) -> Result<()> {
    if !store.is_begun() {
        return Ok(());
    }
    let there = Document::read(&store.config())?;
    let refuse = |message: String| {
        Err(Error::File {
            path: store.root().to_owned(),
            message: format!("{message}; choose another --out"),
        }
        .into())
    };
    if there.settings != document.settings {
        let which = first_difference(&there.settings, &document.settings);
        return refuse(format!("was made with other settings: {which}"));
    }
    for (what, then, now) in [
        ("--quick", there.plan.quick, document.plan.quick),
        ("--train", there.plan.train, document.plan.train),
    ] {
        if then != now {
            let with = if then { "with" } else { "without" };
            return refuse(format!("was made {with} {what}"));
        }
    }
    if arguments.shard.is_some() && there != *document {
        return refuse("holds another comparison than this share is of".into());
    }
    Ok(())
}

/// Sums up where nothing is missing, and says what is where something is.
fn finish(
    arguments: &Arguments,
    store: &Store,
    document: &Document,
    keys: &[CellKey],
    first: Option<anyhow::Error>,
) -> Result<()> {
    let there = contents(store, keys)?;
    let counted = format!("{} of {} runs are there", there.cells.len(), keys.len());
    if there.missing > 0 {
        let how = how_to_go_on(store.root());
        let of_share = |(place, key): (usize, &CellKey)| -> Result<bool> {
            let mine = arguments.shard.is_some_and(|s| s.holds(place));
            Ok(mine && store.cell(key)?.is_none() && store.failure(key)?.is_none())
        };
        let mut open = 0;
        for entry in keys.iter().enumerate() {
            open += usize::from(of_share(entry)?);
        }
        let Some(shard) = arguments.shard.filter(|_| open == 0) else {
            return Err(Error::Failed(format!("stopped; {counted}; {how}")).into());
        };
        failure::note(&format!(
            "share {shard} is done; {counted} in {}; with the other shares, `asid compare --merge` \
             puts folders together",
            store.root().display()
        ));
        return Ok(());
    }
    if there.cells.is_empty() {
        let nothing = || Error::Failed("no run could be done".into()).into();
        return Err(first.unwrap_or_else(nothing));
    }
    sum_up(arguments, store, document, &there)?;
    let failed: Vec<&Failure> = there.failures.iter().filter(|f| !f.of_all).collect();
    match failed.first() {
        Some(failure) => Err(Error::Failed(format!(
            "{} of {} runs failed, the first of them {}: {}; the same command tries them again",
            failed.len(),
            keys.len(),
            failure.key.words(),
            failure.reason
        ))
        .into()),
        None => Ok(()),
    }
}
