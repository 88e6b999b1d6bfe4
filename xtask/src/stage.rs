//! Stages of a longer run: each is one cargo call, timed, and the run ends with a summary.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::library::repository;

/// Features that bring in every engine and the networks.
pub const ALL_FEATURES: &str = "--features=mujoco,torch,parquet";

/// Stages that have run, in order.
#[derive(Default)]
pub struct Stages {
    done: Vec<(String, bool, Duration)>,
}

impl Stages {
    /// Runs `work` as a stage; true where it succeeded.
    pub fn run(&mut self, name: &str, work: impl FnOnce() -> Result<bool>) -> Result<bool> {
        eprintln!("==> {name}");
        let start = Instant::now();
        let passed = work()?;
        self.done.push((name.to_owned(), passed, start.elapsed()));
        Ok(passed)
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

    /// The summary: one line a stage, then the whole; true where all passed.
    pub fn finish(&self) -> bool {
        eprint!("\n{}", self.summary());
        self.passed()
    }

    fn passed(&self) -> bool {
        self.done.iter().all(|(_, passed, _)| *passed)
    }

    fn summary(&self) -> String {
        let mut lines = String::new();
        let verdict = |passed: bool| if passed { "ok" } else { "FAILED" };
        for (name, passed, time) in &self.done {
            let seconds = time.as_secs_f64();
            lines += &format!("{:<26}{:<8}{seconds:>7.1} s\n", name, verdict(*passed));
        }
        let total: Duration = self.done.iter().map(|(_, _, time)| *time).sum();
        let seconds = total.as_secs_f64();
        lines
            + &format!(
                "{:<26}{:<8}{seconds:>7.1} s\n",
                "all",
                verdict(self.passed())
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
        let summary = stages.summary();
        let words: Vec<Vec<&str>> = summary
            .lines()
            .map(|l| l.split_whitespace().collect())
            .collect();
        assert_eq!(words[0][..2], ["first", "FAILED"]);
        assert_eq!(words[1][..2], ["second", "ok"]);
        assert_eq!(words[2][..2], ["all", "FAILED"]);
        assert!(!stages.passed());
    }
}
