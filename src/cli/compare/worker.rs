//! Runs cells and stores their results, on any number of threads.

use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use asid_algorithms::explore::reused::Plans;
use asid_comparison::cell::{Cell, CellKey, Failure};
use asid_comparison::schedule;
use asid_comparison::store::Store;
use asid_core::Error;

use super::cell;
use super::progress::Progress;
use super::work::{ArmName, Arms, arm_name};
use crate::cli::failure;

/// Problems during a comparison.
#[derive(Default)]
struct Trouble {
    /// Arms whose cells cannot be run.
    ruled_out: Vec<ArmName>,
    /// The first error of a cell.
    first: Option<anyhow::Error>,
    /// The error of a result that could not be stored.
    unwritten: Option<anyhow::Error>,
}

/// Runs cells and stores their results.
pub struct Worker<'w> {
    store: &'w Store,
    arms: &'w Arms,
    /// All cells of the comparison.
    keys: &'w [CellKey],
    /// Plans of exploration that cells share.
    plans: Plans,
    progress: Progress,
    trouble: Mutex<Trouble>,
}

impl<'w> Worker<'w> {
    /// A worker for this many of the comparison's cells.
    pub fn new(
        store: &'w Store,
        arms: &'w Arms,
        keys: &'w [CellKey],
        quiet: bool,
        pending: usize,
    ) -> Self {
        Self {
            store,
            arms,
            keys,
            plans: Plans::default(),
            progress: Progress::new(quiet, pending),
            trouble: Mutex::default(),
        }
    }

    fn trouble(&self) -> std::sync::MutexGuard<'_, Trouble> {
        self.trouble.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs a cell; returns it with its seconds, or `None` if its arm was ruled out meanwhile.
    pub fn run(&self, key: &CellKey) -> Result<Option<(Cell, f64)>> {
        let name = arm_name(key);
        if self.trouble().ruled_out.contains(&name) {
            return Ok(None);
        }
        match self.arms.get(&name) {
            Some(Ok(arm)) => cell::run(arm, key, &self.plans).map(Some),
            Some(Err(why)) => Err(Error::Missing {
                what: format!("method `{}`", key.method),
                message: why.clone(),
            }
            .into()),
            None => Err(Error::Failed("no settings were resolved".into()).into()),
        }
    }

    /// Stores the result of a cell; returns whether it could be stored.
    pub fn done(
        &self,
        key: &CellKey,
        result: Result<Result<Option<(Cell, f64)>>, schedule::Panic>,
    ) -> bool {
        let panicked = |panic: schedule::Panic| Error::Failed(failure::of_panic(&*panic)).into();
        let kept = match result.unwrap_or_else(|panic| Err(panicked(panic))) {
            Ok(None) => Ok(()),
            Ok(Some((cell, wall_s))) => self.store.keep(&cell, Some(wall_s)),
            Err(error) => self.failed(key, error),
        };
        self.progress.advance(key);
        match kept {
            Ok(()) => true,
            Err(error) => {
                self.trouble().unwritten.get_or_insert(error.into());
                false
            }
        }
    }

    /// Whether every cell of an arm fails by this error. A cell has its own truth, its own real world
    /// and its own condition: what an engine or a setting refuses of these says nothing about others.
    fn holds_for_all(&self, key: &CellKey, error: &anyhow::Error) -> bool {
        match error.downcast_ref::<Error>() {
            Some(Error::File { path, .. }) => match self.arms.get(&arm_name(key)) {
                Some(Ok(arm)) => arm.names(path),
                _ => false,
            },
            Some(error) => error.is_lack(),
            None => false,
        }
    }

    /// Records why a cell failed. What all cells of its arm lack rules the arm out, unless one of them
    /// has a result.
    fn failed(&self, key: &CellKey, error: anyhow::Error) -> asid_core::Result<()> {
        let mut mates = self.keys.iter().filter(|k| k.arm_mate(key));
        let of_all =
            self.holds_for_all(key, &error) && !mates.any(|k| self.store.place(k).is_file());
        let reason = match self.arms.get(&arm_name(key)) {
            Some(Err(why)) => why.clone(),
            _ => format!("{error:#}"),
        };
        let mut trouble = self.trouble();
        if of_all {
            trouble.ruled_out.push(arm_name(key));
        }
        trouble.first.get_or_insert(error);
        drop(trouble);
        self.store.fail(&Failure {
            key: key.clone(),
            reason: reason.split_whitespace().collect::<Vec<_>>().join(" "),
            of_all,
        })
    }

    /// Ends the work and returns the first error of a cell.
    ///
    /// # Errors
    /// When a result could not be stored.
    pub fn end(self) -> Result<Option<anyhow::Error>> {
        self.progress.end();
        let trouble = self
            .trouble
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        trouble.unwritten.map_or(Ok(trouble.first), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: an engine that refused the truth of one seed left a method out of the table, and the
    /// number of threads decided which of its runs were lost. Cause: every wrong call in the first run
    /// of a method counted as one of all.
    #[test]
    fn what_one_run_cannot_have_rules_out_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let key = |method: &str, seed| CellKey {
            task: "t".into(),
            condition: "c".into(),
            method: method.into(),
            world: "matched".into(),
            backend: "b".into(),
            seed,
        };
        let text = |x: &str| x.to_owned();
        let truth = Error::Parameter {
            parameter: text("mass"),
            message: text("must be above 0"),
        };
        let scene = Error::Scene {
            scene: text("perturbed"),
            message: text("two geoms overlap"),
        };
        let lost = Error::File {
            path: "/tmp/log.csv".into(),
            message: text("gone"),
        };
        let setting = Error::Config {
            key: text("condition"),
            message: text("has no such range"),
        };
        let network = Error::Missing {
            what: text("a network"),
            message: text("none ships"),
        };
        let engine = Error::Incapable {
            backend: text("b"),
            what: text("weld"),
        };
        for (error, of_all) in [
            (truth, false),
            (scene, false),
            (lost, false),
            (setting, false),
            (network, true),
            (engine, true),
        ] {
            let method = error.to_string();
            let keys = [key(&method, 0), key(&method, 1)];
            let (store, arms) = (Store::new(folder.path()), Arms::new());
            let worker = Worker::new(&store, &arms, &keys, true, 2);
            assert!(worker.done(&keys[0], Ok(Err(error.into()))));
            assert_eq!(store.failure(&keys[0]).unwrap().unwrap().of_all, of_all);
            let ruled_out = worker.trouble().ruled_out.contains(&arm_name(&keys[1]));
            assert_eq!(ruled_out, of_all, "{method}");
        }
    }

    /// Symptom: on a full disk a comparison computed all of its runs and kept none. Cause: only its
    /// end told of a result that could not be stored.
    #[test]
    fn a_result_that_cannot_be_stored_is_told_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let key = CellKey {
            task: "t".into(),
            condition: "c".into(),
            method: "dr".into(),
            world: "matched".into(),
            backend: "b".into(),
            seed: 0,
        };
        let lost = |root: &std::path::Path| {
            let (store, arms, keys) = (Store::new(root), Arms::new(), [key.clone()]);
            let worker = Worker::new(&store, &arms, &keys, true, 1);
            let result = worker.run(&key);
            let stored = worker.done(&key, Ok(result));
            (stored, worker.end().is_err())
        };
        assert_eq!(lost(&folder.path().join("a")), (true, false));
        // A file where the folder should be.
        std::fs::write(folder.path().join("b"), "").unwrap();
        assert_eq!(lost(&folder.path().join("b")), (false, true));
    }
}
