//! A comparison as a Slurm job array.
//!
//! Each task of the array works on its share, and all write into one folder. The last one to finish
//! finds all cells and writes the tables. Some time before the limit Slurm sends `SIGUSR1`. The
//! program then starts no new cell and finishes the running ones, and the task is queued again for
//! the rest. A task that is killed and queued again continues where it stopped.

use std::fmt::Write as _;
use std::path::Path;

/// Content of the batch script.
#[derive(Clone, Debug)]
pub struct Script<'a> {
    /// Path of the program.
    pub program: &'a Path,
    /// The comparison's folder, with its `config.toml`.
    pub out: &'a Path,
    /// Number of tasks of the array.
    pub jobs: usize,
    /// Threads per task.
    pub threads: usize,
    /// Further options of sbatch; they override the script's own.
    pub options: &'a [String],
}

/// Time before the limit at which a task is told to start nothing new, s: longer than a run of any
/// built-in task on one thread.
const GRACE: u32 = 300;

impl Script<'_> {
    /// Returns the script's text.
    #[must_use]
    pub fn text(&self) -> String {
        let mut head = String::new();
        let own = [
            "--job-name=asid-compare".to_owned(),
            format!("--array=1-{}", self.jobs),
            format!("--cpus-per-task={}", self.threads),
            format!("--output={}", log_of_tasks(self.out)),
            "--open-mode=append".to_owned(),
            "--requeue".to_owned(),
            format!("--signal=B:USR1@{GRACE}"),
        ];
        // sbatch uses the first of two equal options.
        let given = |o: &str| o.split('=').next().unwrap_or(o).to_owned();
        let wins = |o: &String| !self.options.iter().any(|x| given(x) == given(o));
        for option in self.options.iter().chain(own.iter().filter(|o| wins(o))) {
            let _ = writeln!(head, "#SBATCH {option}");
        }
        format!(
            r#"#!/bin/bash
{head}
# Before the time limit: begin nothing new, finish what runs, and queue the rest again.
drained=
trap 'drained=1; kill -USR1 "$child" 2>/dev/null' USR1
trap 'kill -TERM "$child" 2>/dev/null' TERM INT
echo "share $SLURM_ARRAY_TASK_ID of {jobs} on $SLURMD_NODENAME"
{program} compare --config {config} --trust-plugins --out {folder} \
  --shard "$SLURM_ARRAY_TASK_ID/{jobs}" --threads {threads} --quiet &
child=$!
# A signal ends `wait` before the program has ended.
while wait "$child"; status=$?; kill -0 "$child" 2>/dev/null; do :; done
if [ -n "$drained" ] && [ "$status" -ne 0 ]; then
  scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}"
fi
exit "$status"
"#,
            program = quoted(self.program),
            config = quoted(&self.out.join("config.toml")),
            folder = quoted(self.out),
            jobs = self.jobs,
            threads = self.threads,
        )
    }
}

/// Path of each task's log file, escaped for an `#SBATCH` option.
///
/// sbatch reads a backslash as an escape of the next character, in quotes too. In a file name `%A`
/// and `%a` are the numbers of array and task, and `%%` is `%`.
fn log_of_tasks(out: &Path) -> String {
    let out = out.display().to_string().replace('%', "%%");
    let out = out.replace('\\', r"\\").replace('"', r#"\""#);
    format!("\"{out}/slurm/%A_%a.log\"")
}

/// Quotes a path as one shell word.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_says_what_is_run_and_given_options_win() {
        let script = Script {
            program: Path::new("/opt/my asid"),
            out: Path::new("/data/it's"),
            jobs: 4,
            threads: 2,
            options: &[
                "--time=01:00:00".to_owned(),
                "--signal=B:USR1@60".to_owned(),
            ],
        };
        let text = script.text();
        assert!(text.starts_with("#!/bin/bash\n#SBATCH --time=01:00:00\n"));
        assert!(text.contains("#SBATCH --array=1-4\n"));
        assert!(text.contains("--signal=B:USR1@60") && !text.contains("USR1@300"));
        assert!(text.contains(r"'/opt/my asid' compare --config '/data/it'\''s/config.toml'"));
        assert!(text.contains("--shard \"$SLURM_ARRAY_TASK_ID/4\" --threads 2"));
        assert!(text.contains("#SBATCH --output=\"/data/it's/slurm/%A_%a.log\"\n"));
    }

    /// Without quotes sbatch ends the option at a space or `#`. It refuses a single quote and
    /// replaces `%j` by the job number.
    #[test]
    fn logs_of_tasks_go_to_a_folder_of_any_name() {
        for (folder, option) in [
            ("/data/my runs #2", r#""/data/my runs #2/slurm/%A_%a.log""#),
            ("/data/90%job", r#""/data/90%%job/slurm/%A_%a.log""#),
            (r#"/a "b""#, r#""/a \"b\"/slurm/%A_%a.log""#),
        ] {
            assert_eq!(log_of_tasks(Path::new(folder)), option);
        }
    }
}
