//! The work of a comparison, from the command line to the tables.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Result;
use asid_comparison::cell::{CellKey, Failure};
use asid_comparison::document::Document;
use asid_comparison::schedule;
use asid_comparison::shard::Shard;
use asid_comparison::store::{Store, write};
use asid_core::Error;

use super::arm::Arm;
use super::folder::{Contents, SummedUp, claim, contents, sum_up};
use super::methods::missing_part;
use super::request::document;
use super::resume::{check_versions, left_aside, pending, same_comparison};
use super::signals::{how_to_go_on, watch};
use super::train::Trainer;
use super::worker::Worker;
use super::{Arguments, cell};
use crate::cli::failure;

/// Task, method, world and engine: cells with the same four share their settings.
pub type ArmName = [String; 4];

/// The settings of every arm, or the reason why it cannot be run.
pub type Arms = HashMap<ArmName, Result<Arm, String>>;

/// The arm that a cell belongs to.
pub fn arm_name(key: &CellKey) -> ArmName {
    [&key.task, &key.method, &key.world, &key.backend].map(String::clone)
}

/// The outcome of the work.
pub struct Outcome {
    /// The summary, if the comparison is complete.
    pub summed: Option<SummedUp>,
    /// Failed runs, as one error.
    pub failed: Option<anyhow::Error>,
}

/// Runs the missing cells of the comparison, summarises it when complete, and prints it.
pub fn work(arguments: &Arguments) -> Result<()> {
    let Outcome { summed, failed } = run(arguments)?;
    if let Some(summed) = summed {
        summed.print(arguments.json)?;
    }
    failed.map_or(Ok(()), Err)
}

/// Runs the missing cells of the comparison and summarises it when complete.
///
/// # Errors
/// When a setting is wrong, a file cannot be written, or the work was stopped.
pub fn run(arguments: &Arguments) -> Result<Outcome> {
    let document = document(arguments)?;
    let keys = document.plan.cells();
    let mut arms = arms(&document, &keys)?;
    probe(&keys, &arms)?;
    let store = claim(arguments.out.as_deref())?;
    same_comparison(arguments, &store, &document)?;
    // Report cells that do not belong here before anything is written.
    if document.plan.train {
        check_versions(&store, &keys)?;
    } else {
        pending(arguments, &store, &keys, &arms)?;
    }
    left_aside(&store, &keys)?;
    write(&store.config(), &document.text()?)?;
    let drain = watch(store.root(), arguments.shard)?;
    if document.plan.train {
        train(arguments, &store, &document, (&keys, &mut arms), &drain)?;
        if drain.load(Ordering::SeqCst) {
            return finish(arguments, &store, &document, &keys, None);
        }
    }
    for arm in arms.values().flatten() {
        store.keep_settings(&arm.hash, &arm.canonical)?;
    }
    let pending = pending(arguments, &store, &keys, &arms)?;
    if !pending.is_empty() && arguments.shard.is_none() {
        // A summary of fewer cells is no longer valid.
        let _ = std::fs::remove_file(store.root().join("result.json"));
    }
    let worker = Worker::new(&store, &arms, &keys, arguments.quiet, pending.len());
    let threads = match arguments.threads {
        Some(n) => n,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let work = |key: &CellKey| worker.run(key);
    let done = |key: &CellKey, result| {
        if !worker.done(key, result) {
            // What cannot be stored need not be computed.
            drain.store(true, Ordering::SeqCst);
        }
    };
    schedule::run(&pending, threads, &drain, work, done)?;
    let first = worker.end()?;
    finish(arguments, &store, &document, &keys, first)
}

/// Checks a comparison as far as possible before any work.
///
/// # Errors
/// When a setting is wrong or an engine is missing.
pub fn check(document: &Document) -> Result<()> {
    let keys = document.plan.cells();
    let arms = arms(document, &keys)?;
    probe(&keys, &arms)
}

/// Trains what learns, once for all cells that use it; what cannot be trained is ruled out.
///
/// No further training begins once `drain` is set.
fn train(
    arguments: &Arguments,
    store: &Store,
    document: &Document,
    (keys, arms): (&[CellKey], &mut Arms),
    drain: &AtomicBool,
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
        if drain.load(Ordering::SeqCst) {
            break;
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

/// The settings of every arm, or the reason why this build cannot run it.
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

/// Opens one session for each task and engine, so that a wrong call ends before any work.
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

/// Summarises a complete comparison; otherwise reports what is missing.
fn finish(
    arguments: &Arguments,
    store: &Store,
    document: &Document,
    keys: &[CellKey],
    first: Option<anyhow::Error>,
) -> Result<Outcome> {
    let there = contents(store, keys)?;
    let counted = format!("{} of {} runs are there", there.cells.len(), keys.len());
    if !there.missing.is_empty() {
        let how = how_to_go_on(store.root(), arguments.shard);
        let is_done = |s: &Shard| !there.missing.iter().any(|&place| s.holds(place));
        let Some(shard) = arguments.shard.filter(is_done) else {
            return Err(Error::Failed(format!("stopped; {counted}; {how}")).into());
        };
        failure::note(&format!(
            "share {shard} is done; {counted} in {}; with the other shares, `asid compare --merge` \
             puts folders together",
            store.root().display()
        ));
        return Ok(Outcome {
            summed: None,
            failed: failed_runs(&there, keys, |place| shard.holds(place)),
        });
    }
    if there.cells.is_empty() {
        let nothing = || Error::Failed("no run could be done".into()).into();
        return Err(first.unwrap_or_else(nothing));
    }
    // Processes that write into one folder may have begun at the same time.
    check_versions(store, keys)?;
    Ok(Outcome {
        summed: Some(sum_up(store, document, &there)?),
        failed: failed_runs(&there, keys, |_| true),
    })
}

/// The failed runs at places that are `counted`, as one error. A method that is left out with a
/// reason is no failure.
fn failed_runs(
    there: &Contents,
    keys: &[CellKey],
    counted: impl Fn(usize) -> bool,
) -> Option<anyhow::Error> {
    let place = |failure: &Failure| keys.iter().position(|key| *key == failure.key);
    let failed = there.single_failures();
    let failed: Vec<&Failure> = failed
        .filter(|failure| place(failure).is_some_and(&counted))
        .collect();
    failed.first().map(|failure| {
        Error::Failed(format!(
            "{} of {} runs failed, the first of them {}: {}; the same command tries them again",
            failed.len(),
            keys.len(),
            failure.key.words(),
            failure.reason
        ))
        .into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a share ended well, though one of its runs had failed. Cause: failures were told
    /// only where the whole comparison was there.
    #[test]
    fn a_share_tells_of_its_own_failed_runs() {
        let key = |seed: u64| CellKey {
            task: "t".into(),
            condition: "c".into(),
            method: "dr".into(),
            world: "matched".into(),
            backend: "b".into(),
            seed,
        };
        let failed = |seed: u64, of_all: bool| Failure {
            key: key(seed),
            reason: "why".into(),
            of_all,
        };
        let keys = [0, 1, 2, 3].map(key);
        let of = |failures: Vec<Failure>, share: &str| {
            let there = Contents {
                cells: Vec::new(),
                failures,
                missing: Vec::new(),
            };
            let share: Shard = share.parse().unwrap();
            let error = failed_runs(&there, &keys, |place| share.holds(place));
            error.map(|e| e.to_string())
        };
        let said = of(vec![failed(1, false), failed(3, false)], "2/2").unwrap();
        assert!(
            said.starts_with("2 of 4 runs failed") && said.contains("seed 1: why"),
            "{said}"
        );
        assert_eq!(of(vec![failed(1, false)], "1/2"), None);
        // A method that cannot be run at all is left out.
        assert_eq!(of(vec![failed(0, true)], "1/2"), None);
    }
}
