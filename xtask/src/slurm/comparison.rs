//! Checks the promises of a comparison that runs as a job array.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result, bail, ensure};

use super::cluster::{Cluster, NODES};

/// Files that must be the same, however the comparison was run.
const SAME: [&str; 5] = [
    "result.json",
    "runs.json",
    "table.md",
    "report.html",
    "config.toml",
];

/// A comparison with very short runs; its figures mean nothing.
const TINY: &str = "compare rod-balancing --backend mujoco --method random --method dr \
    --condition left --seeds 3 --set identifier.iterations=1 --set identifier.population=8 \
    --set identifier.sampling.rounds=1 --set identifier.sampling.draws=8 --set solver.iterations=1 \
    --set solver.population=2 --set solver.belief_samples=1";

/// Settings that make a task of the array last a few seconds.
const BRIEF: &[&str] = &["--set", "expected.rounds=1"];

/// Settings that make a task of the array outlast the half minute after which Slurm checks time
/// limits.
const LONG: &[&str] = &["--set", "expected.rounds=28"];

/// Number of runs of [`TINY`].
const RUNS: usize = 6;

/// Number of tasks of its array: one per node.
const TASKS: usize = 2;

/// Maximum time that an array may take.
const LIMIT: Duration = Duration::from_secs(400);

/// Time for which a requeued task is left alone, because its node must end it first.
const AGAIN: Duration = Duration::from_secs(10);

/// Checks everything.
///
/// # Errors
/// Returns the first promise that does not hold.
pub fn check(cluster: &Cluster<'_>, program: &Path) -> Result<()> {
    let test = Test { cluster, program };
    let clock = Instant::now();
    let told = |what: &str| eprintln!("slurm: {what} ({:.0} s)", clock.elapsed().as_secs_f64());
    test.asid("whole", BRIEF)?;
    told("one process is done");
    test.two_nodes_in_one_folder()?;
    told("two nodes that write into one folder give the bytes of one process");
    test.killed_and_queued_again()?;
    told("a task that is killed and one that is queued again go on where they stood");
    test.warned_before_the_limit()?;
    told("a task that is warned before its time limit finishes what runs and is queued again");
    Ok(())
}

struct Test<'t> {
    cluster: &'t Cluster<'t>,
    program: &'t Path,
}

impl Test<'_> {
    fn out(&self, name: &str) -> PathBuf {
        self.cluster.work().join(name)
    }

    /// Runs the comparison in a folder; returns its output.
    fn asid(&self, out: &str, more: &[&str]) -> Result<String> {
        let mut command = self.cluster.command(self.program);
        command.args(TINY.split_whitespace());
        let output = command
            .args(["--quiet", "--out", out])
            .args(more)
            .output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "asid: {}", said.trim());
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// Submits the comparison; returns the number of the array.
    fn submit(&self, out: &str, options: &[&str]) -> Result<String> {
        let tasks = TASKS.to_string();
        let common = ["--submit", "slurm", "--jobs", &tasks];
        let said = self.asid(out, &[&common, options].concat())?;
        let number = said.split_whitespace().last().unwrap_or_default();
        ensure!(
            number.parse::<u64>().is_ok(),
            "sbatch said `{}`",
            said.trim()
        );
        Ok(number.to_owned())
    }

    /// The finished cells, with their modification times.
    fn cells(&self, out: &str) -> BTreeMap<String, SystemTime> {
        let entries = fs::read_dir(self.out(out).join("cells"))
            .into_iter()
            .flatten();
        let of = |e: fs::DirEntry| {
            let name = e
                .file_name()
                .into_string()
                .ok()
                .filter(|n| !n.starts_with('.'))?;
            Some((name, e.metadata().ok()?.modified().ok()?))
        };
        entries.filter_map(|e| of(e.ok()?)).collect()
    }

    /// Output of the tasks of an array.
    fn said(&self, out: &str) -> Result<String> {
        let mut text = String::new();
        for entry in fs::read_dir(self.out(out).join("slurm"))? {
            text += &fs::read_to_string(entry?.path())?;
        }
        Ok(text)
    }

    fn until(&self, out: &str, what: &str, there: impl Fn() -> Result<bool>) -> Result<()> {
        let begun = Instant::now();
        while !there()? {
            if begun.elapsed() > LIMIT {
                let said = self.said(out).unwrap_or_default();
                bail!(
                    "{out}: no {what} after {} s; its tasks said:\n{said}",
                    LIMIT.as_secs()
                );
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(())
    }

    /// Waits until no task of an array is left; makes requeued tasks begin soon.
    fn ended(&self, out: &str, array: &str) -> Result<()> {
        let waiting: RefCell<BTreeMap<String, Instant>> = RefCell::default();
        self.until(out, "end", || {
            // Slurm forgets a finished job after a while.
            let arguments = ["--noheader", "--format=%i %t", "--jobs", array];
            let states = self.cluster.slurm("squeue", &arguments).unwrap_or_default();
            let mut waiting = waiting.borrow_mut();
            for line in states.lines() {
                let Some((job, state)) = line.split_once(' ') else {
                    continue;
                };
                if state != "PD" {
                    waiting.remove(job);
                } else if waiting
                    .entry(job.to_owned())
                    .or_insert_with(Instant::now)
                    .elapsed()
                    > AGAIN
                {
                    self.hurry(job);
                    waiting.remove(job);
                }
            }
            Ok(states.trim().is_empty())
        })
    }

    /// Removes the two minutes for which Slurm delays a requeued job.
    fn hurry(&self, job: &str) {
        let job = format!("JobId={job}");
        let _ = self
            .cluster
            .slurm("scontrol", &["update", &job, "StartTime=now"]);
    }

    /// Checks that the folder holds the same bytes as the result of one process.
    fn same(&self, out: &str, whole: &str) -> Result<()> {
        for file in SAME {
            let read = |folder: &str| {
                let path = self.out(folder).join(file);
                fs::read(&path).with_context(|| {
                    format!(
                        "{}; its tasks said:\n{}",
                        path.display(),
                        self.said(folder).unwrap_or_default()
                    )
                })
            };
            ensure!(
                read(whole)? == read(out)?,
                "{file} of {out} is not that of one process"
            );
        }
        Ok(())
    }

    /// Checks that none of these cells was computed again.
    fn kept(&self, out: &str, before: &BTreeMap<String, SystemTime>) -> Result<()> {
        let after = self.cells(out);
        for (name, time) in before {
            ensure!(after.get(name) == Some(time), "{out}: {name} was run again");
        }
        Ok(())
    }

    fn two_nodes_in_one_folder(&self) -> Result<()> {
        let array = self.submit("array", BRIEF)?;
        self.ended("array", &array)?;
        self.same("array", "whole")?;
        let said = self.said("array")?;
        for node in NODES {
            ensure!(
                said.contains(&format!("on {node}")),
                "no task ran on {node}: {said}"
            );
        }
        Ok(())
    }

    fn killed_and_queued_again(&self) -> Result<()> {
        let array = self.submit("killed", BRIEF)?;
        self.until("killed", "first cells", || {
            Ok(self.cells("killed").len() >= 3)
        })?;
        let (first, second) = (format!("{array}_1"), format!("{array}_2"));
        self.cluster
            .slurm("scancel", &["--signal=KILL", "--full", &first])?;
        self.cluster.slurm("scontrol", &["requeue", &second])?;
        let before = self.cells("killed");
        ensure!(
            before.len() < RUNS,
            "the tasks ended before they could be stopped"
        );
        self.ended("killed", &array)?;
        // The requeued task has finished its share; that of the killed task is missing.
        ensure!(
            !self.out("killed").join("result.json").exists(),
            "a killed task had ended"
        );
        let again = self.submit("killed", BRIEF)?;
        self.ended("killed", &again)?;
        self.kept("killed", &before)?;
        self.same("killed", "whole")
    }

    /// Slurm may warn up to a minute early, so here the warning comes soon after the start.
    fn warned_before_the_limit(&self) -> Result<()> {
        self.asid("whole-long", LONG)?;
        let limit = ["--sbatch=--time=1", "--sbatch=--signal=B:USR1@57"];
        let array = self.submit("warned", &[LONG, &limit].concat())?;
        let told = || {
            Ok(self
                .said("warned")
                .is_ok_and(|s| s.contains("runs that have begun are finished")))
        };
        self.until("warned", "warning", told)?;
        let before = self.cells("warned");
        self.ended("warned", &array)?;
        self.kept("warned", &before)?;
        self.same("warned", "whole-long")
    }
}
