//! Runs one case in a process of its own, with a time limit and a watch on its memory. The process
//! ends when this one ends.

use std::io::Read as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;
use asid_core::Error;
use signal_hook::consts::{SIGINT, SIGTERM};

/// Whether this process was told to stop.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Watches for SIGINT and SIGTERM from now on.
    pub fn watch() -> Result<Self> {
        let stop = Self::default();
        for signal in [SIGINT, SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&stop.0))
                .map_err(|e| Error::Failed(format!("cannot watch for signals: {e}")))?;
        }
        Ok(stop)
    }

    /// Returns an error if it was told to stop.
    pub fn check(&self) -> Result<()> {
        if self.0.load(Ordering::SeqCst) {
            let line =
                "stopped: finished cases are kept, and the same call goes on with the others";
            return Err(Error::Failed(line.into()).into());
        }
        Ok(())
    }
}

/// How a process ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Wall time, s.
    pub seconds: f64,
    /// Largest resident memory, MiB, where the system reports it.
    pub memory_mib: Option<f64>,
    /// Why it failed; `None` on success.
    pub failure: Option<String>,
    /// Whether the time limit ended it.
    pub over_limit: bool,
}

/// Interval at which a process is polled.
const LOOK: Duration = Duration::from_millis(20);

/// Ends the process when it goes out of scope, so that nothing runs on after an error.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Largest resident memory of a running process, MiB: Linux's high-water mark.
fn memory(process: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

/// Runs a command in a working folder; `limit` is in seconds. A process that was told to stop says
/// nothing about the case.
pub fn run(command: &mut Command, folder: &Path, limit: Option<f64>, stop: &Stop) -> Result<Ended> {
    stop.check()?;
    command
        .current_dir(folder)
        // These variables would reveal the folder in which this call was made.
        .env_remove("PWD")
        .env_remove("OLDPWD")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let clock = Instant::now();
    let child = command
        .spawn()
        .map_err(|e| Error::Failed(format!("a diagnosis cannot be started: {e}")))?;
    let mut guard = Guard(child);
    let pipe = guard.0.stderr.take();
    let said = std::thread::spawn(move || {
        let mut text = Vec::new();
        if let Some(mut pipe) = pipe {
            let _ = pipe.read_to_end(&mut text);
        }
        String::from_utf8_lossy(&text).into_owned()
    });
    let mut memory_mib = None;
    let (status, seconds) = loop {
        memory_mib = memory(guard.0.id()).or(memory_mib);
        let seconds = clock.elapsed().as_secs_f64();
        // The signal may have reached the child first.
        stop.check()?;
        let status = guard
            .0
            .try_wait()
            .map_err(|e| Error::Failed(e.to_string()))?;
        if status.is_some() || limit.is_some_and(|limit| seconds > limit) {
            break (status, seconds);
        }
        std::thread::sleep(LOOK);
    };
    stop.check()?;
    drop(guard);
    let said = said.join().unwrap_or_default();
    let last = said
        .lines()
        .rfind(|l| !l.trim().is_empty())
        .unwrap_or("it said nothing");
    let failure = match (status, limit) {
        (Some(status), _) if status.success() => None,
        (Some(status), _) => Some(match status.code() {
            Some(_) => last.to_owned(),
            None => format!("ended by the system ({status}): {last}"),
        }),
        (None, limit) => Some(format!("over the limit of {} s", limit.unwrap_or_default())),
    };
    Ok(Ended {
        seconds,
        memory_mib,
        failure,
        over_limit: status.is_none(),
    })
}

#[cfg(all(test, unix))]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn shell(script: &str, limit: Option<f64>) -> Ended {
        let folder = tempfile::tempdir().unwrap();
        run(
            Command::new("sh").args(["-c", script]),
            folder.path(),
            limit,
            &Stop::default(),
        )
        .unwrap()
    }

    #[test]
    fn a_process_ends_well_badly_or_at_its_limit() {
        assert_eq!(shell("exit 0", None).failure, None);
        let bad = shell("echo one >&2; echo two >&2; exit 3", None);
        assert_eq!(bad.failure.as_deref(), Some("two"));
        let long = shell("sleep 20", Some(0.2));
        assert!(long.over_limit && long.seconds < 5.0, "{long:?}");
        assert!(long.failure.unwrap().contains("limit of 0.2 s"));
    }

    #[test]
    fn a_process_does_not_outlive_the_word_to_stop() {
        let (folder, stop) = (tempfile::tempdir().unwrap(), Stop::default());
        let word = stop.clone();
        let clock = Instant::now();
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(200));
            word.0.store(true, Ordering::SeqCst);
        });
        let mut command = Command::new("sleep");
        let ended = run(command.arg("20"), folder.path(), None, &stop);
        assert!(ended.unwrap_err().to_string().contains("stopped"));
        assert!(clock.elapsed() < Duration::from_secs(10));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn its_memory_is_seen() {
        // A shell takes more than a tenth of a MiB and less than 100 MiB.
        let seen = shell("sleep 0.2", None).memory_mib.unwrap();
        assert!(seen > 0.1 && seen < 100.0, "{seen}");
    }
}
