//! Stages of a longer run: each is one cargo call, timed, and the run ends with a summary.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::library::repository;

/// Features with every engine and the networks.
pub const ALL_FEATURES: &str = "--features=mujoco,torch,logs";

/// Package argument with which a part of the workspace uses the whole workspace's third-party
/// crates.
///
/// These are then built only once.
pub const SHARED: &str = "--package=asid-third-party";

/// How a stage ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Passed,
    Failed,
    /// It could not run here, which is no failure.
    LeftOut,
}

/// Finished stages, in order.
#[derive(Default)]
pub struct Stages {
    done: Vec<(String, Outcome, Duration)>,
}

impl Stages {
    /// Runs `work` as a stage; true if it succeeds.
    pub fn run(&mut self, name: &str, work: impl FnOnce() -> Result<bool>) -> Result<bool> {
        eprintln!("==> {name}");
        let start = Instant::now();
        let passed = work()?;
        let outcome = if passed {
            Outcome::Passed
        } else {
            Outcome::Failed
        };
        self.done.push((name.to_owned(), outcome, start.elapsed()));
        Ok(passed)
    }

    /// Records that a stage could not run here, with the reason.
    pub fn leave_out(&mut self, name: &str, reason: &str) {
        eprintln!("==> {name}: left out: {reason}");
        let entry = (name.to_owned(), Outcome::LeftOut, Duration::ZERO);
        self.done.push(entry);
    }

    /// Runs `cargo <arguments>` in the repository's root as a stage.
    pub fn cargo(&mut self, name: &str, arguments: &[&str], env: &[(&str, &str)]) -> Result<bool> {
        self.run(name, || {
            let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
            let status = Command::new(cargo)
                .args(arguments)
                .envs(env.iter().copied())
                .current_dir(repository())
                .status()
                .context("cannot start cargo")?;
            Ok(status.success())
        })
    }

    /// Prints the summary: one line per stage, then the total. True if all passed.
    pub fn finish(&self) -> bool {
        eprint!("\n{}", self.summary());
        self.passed()
    }

    fn passed(&self) -> bool {
        self.done.iter().all(|(_, o, _)| *o != Outcome::Failed)
    }

    fn summary(&self) -> String {
        let mut lines = String::new();
        let verdict = |outcome: Outcome| match outcome {
            Outcome::Passed => "ok",
            Outcome::Failed => "FAILED",
            Outcome::LeftOut => "left out",
        };
        for (name, outcome, time) in &self.done {
            let seconds = time.as_secs_f64();
            lines += &format!("{:<26}{:<8}{seconds:>7.1} s\n", name, verdict(*outcome));
        }
        let total: Duration = self.done.iter().map(|(_, _, time)| *time).sum();
        let seconds = total.as_secs_f64();
        lines
            + &format!(
                "{:<26}{:<8}{seconds:>7.1} s\n",
                "all",
                if self.passed() { "ok" } else { "FAILED" }
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failure_fails_the_whole_and_later_stages_still_run() {
        let mut stages = Stages::default();
        assert!(!stages.run("first", || Ok(false)).unwrap());
        assert!(stages.run("second", || Ok(true)).unwrap());
        stages.leave_out("third", "no toolchain");
        let summary = stages.summary();
        let words: Vec<Vec<&str>> = summary
            .lines()
            .map(|l| l.split_whitespace().collect())
            .collect();
        assert_eq!(words[0][..2], ["first", "FAILED"]);
        assert_eq!(words[1][..2], ["second", "ok"]);
        assert_eq!(words[2][..3], ["third", "left", "out"]);
        assert_eq!(words[3][..2], ["all", "FAILED"]);
        assert!(!stages.passed());
        let mut lacking = Stages::default();
        lacking.leave_out("third", "no toolchain");
        assert!(lacking.passed(), "what cannot be run here is no failure");
    }
}
