//! What a diagnosis' settings may be.

use anyhow::Result;
use asid_core::registry::find;
use asid_effects::EffectEntry;

use super::super::super::settings::wrong;
use super::super::Arguments;
use super::Config;

impl Config {
    /// Refuses values out of their domain, and settings that exclude each other.
    ///
    /// A message names a setting as the user gave it: as an option, or as a key.
    pub(super) fn check(&self, arguments: &Arguments) -> Result<()> {
        if self.minutes.is_some_and(|m| !(m.is_finite() && m > 0.0)) {
            let key = named("minutes", arguments.minutes.is_some());
            return Err(wrong(&key, "is a number above 0"));
        }
        if !(self.false_alarms > 0.0 && self.false_alarms < 1.0) {
            let key = named("false_alarms", arguments.false_alarms.is_some());
            return Err(wrong(
                &key,
                "is a probability between 0 and 1, such as 0.01",
            ));
        }
        for name in &self.without {
            find::<EffectEntry>(name)?;
        }
        if self.search.has_a_zero() {
            return Err(wrong("search", "every number is at least 1"));
        }
        if self.task.is_none() && arguments.common.preset.is_some() {
            return Err(wrong("--preset", "goes with a task"));
        }
        let logs = [
            ("train", &self.train, !arguments.train.is_empty()),
            ("test", &self.test, !arguments.test.is_empty()),
        ];
        if let Some((key, _, by_option)) = logs.iter().find(|(_, files, _)| !files.is_empty())
            && self.task.is_none()
        {
            let message =
                "goes with --task: a study names its logs itself, under `train` and `test`";
            return Err(wrong(&named(key, *by_option), message));
        }
        if !self.train.is_empty() && self.experiments.is_some_and(|n| n > 0) {
            let key = named("experiments", arguments.experiments.is_some());
            let logs = named("train", !arguments.train.is_empty());
            let message = format!(
                "these episodes are played in the simulated real world that the logs come from, and these logs are given: leave out \
                 `{key}`, or `{logs}`"
            );
            return Err(wrong(&key, message));
        }
        Ok(())
    }

    /// Refuses settings of runs where no task is run.
    pub(super) fn refuse_runs(&self, arguments: &Arguments) -> Result<()> {
        let given = [
            ("runs", self.runs.is_some(), arguments.runs.is_some()),
            ("seeds", self.seeds.is_some(), arguments.seeds.is_some()),
            (
                "experiments",
                self.experiments.is_some(),
                arguments.experiments.is_some(),
            ),
        ];
        let key = match given.iter().find(|(_, is_given, _)| *is_given) {
            Some((key, _, by_option)) => named(key, *by_option),
            None if arguments.describes_a_run() => "--task".to_owned(),
            None => return Ok(()),
        };
        let message = if self.task.is_some() {
            "is of runs that make logs of the task, and its logs are given: leave out one of the two"
        } else {
            "a study's machine cannot be run from here: runs, seeds, experiments, algorithms and what describes a simulated real \
             world go with --task"
        };
        Err(wrong(&key, message))
    }
}

/// Name of a setting in a message: that of the option where the command line has it, else the key
/// of the file or of `--set`.
fn named(key: &str, by_option: bool) -> String {
    if by_option {
        format!("--{}", key.replace('_', "-"))
    } else {
        key.to_owned()
    }
}
