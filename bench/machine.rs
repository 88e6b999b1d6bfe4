//! Circumstances of a measurement: what, where and when. Without them a number means nothing.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

/// The circumstances of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Circumstances {
    /// Command line.
    pub command: String,
    /// UTC, as in ISO 8601.
    pub date: String,
    /// Commit, with `+changes` if the working tree differs from it.
    pub git: String,
    /// Model of the CPU.
    pub cpu: String,
    /// Cores that this process may use.
    pub cores: usize,
    /// Operating system and architecture.
    pub system: String,
    /// Mean number of running or waiting processes over the minute before the measurement.
    pub load: Option<f64>,
    /// Versions by name.
    pub versions: BTreeMap<String, String>,
}

impl Circumstances {
    /// The present circumstances; `engines` are names and versions of the engines.
    pub fn now(command: String, engines: &[(String, String)]) -> Self {
        let mut versions: BTreeMap<String, String> = engines.iter().cloned().collect();
        versions.insert("asid".into(), env!("CARGO_PKG_VERSION").into());
        if let Some(rustc) = output("rustc", &["--version"]) {
            versions.insert("rustc".into(), rustc.trim_start_matches("rustc ").into());
        }
        Self {
            command,
            date: date(),
            git: git(),
            cpu: cpu().unwrap_or_else(|| "unknown".into()),
            cores: cores(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            load: load(),
            versions,
        }
    }

    /// One sentence for readers.
    pub fn sentence(&self) -> String {
        let versions: Vec<String> = self
            .versions
            .iter()
            .map(|(name, version)| format!("{name} {version}"))
            .collect();
        let load = self
            .load
            .map_or_else(String::new, |l| format!(", load {l:.1} at the start"));
        format!(
            "{}, commit {}; {} cores of {}, {}{load}; {}.",
            self.date,
            if self.git.is_empty() {
                "unknown"
            } else {
                &self.git
            },
            self.cores,
            self.cpu,
            self.system,
            versions.join(", ")
        )
    }
}

/// Cores that this process may use.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let out = Command::new(program)
        .args(arguments)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")))
        .output()
        .ok()
        .filter(|o| o.status.success())?;
    Some(String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

fn git() -> String {
    let Some(hash) = output("git", &["rev-parse", "--short=12", "HEAD"]) else {
        return String::new();
    };
    match output("git", &["status", "--porcelain", "--untracked-files=no"]) {
        Some(changes) if !changes.is_empty() => hash + "+changes",
        _ => hash,
    }
}

fn cpu() -> Option<String> {
    let info = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = info.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn load() -> Option<f64> {
    let text = fs::read_to_string("/proc/loadavg").ok()?;
    text.split(' ').next()?.parse().ok()
}

/// The present time, UTC, to the second.
fn date() -> String {
    let seconds = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |d| d.as_secs());
    let (year, month, day) = civil(seconds / 86_400);
    let (h, m, s) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    format!("{year}-{month:02}-{day:02}T{h:02}:{m:02}:{s:02}Z")
}

/// Year, month and day from a number of days since 1970 (Hinnant, "chrono-compatible low-level date
/// algorithms").
fn civil(days: u64) -> (u64, u64, u64) {
    let z = days + 719_468;
    let (era, doe) = (z / 146_097, z % 146_097);
    let yoe = (doe - doe / 1460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let month = if mp < 10 { mp + 3 } else { mp - 9 };
    let year = yoe + era * 400 + u64::from(month <= 2);
    (year, month, doy - (153 * mp + 2) / 5 + 1)
}

#[cfg(test)]
mod tests {
    use super::civil;

    #[test]
    fn days_become_dates() {
        assert_eq!(civil(0), (1970, 1, 1));
        assert_eq!(civil(11_016), (2000, 2, 29));
        assert_eq!(civil(20_454), (2026, 1, 1));
    }
}
