//! Motions, designed once and stored in files.

use std::path::Path;
use std::time::Instant;

use asid::cli::MotionSetup;
use asid::core::progress::Silent;
use asid::sysid::method::Method;
use serde::{Deserialize, Serialize};

use crate::Outcome;
use crate::machine::Machine;

/// A motion and its expected result.
#[derive(Clone, Serialize, Deserialize)]
pub struct Motion {
    /// Commands, `frames x nu`.
    pub commands: Vec<f64>,
    /// Expected standard deviation of each unknown, in standard deviations of the prior.
    pub expected: Vec<f64>,
    /// The limit that it breaks where no scale keeps all limits.
    pub broken: Option<String>,
    /// The limit that a larger motion would break.
    pub next_limit: Option<String>,
    /// Best cost after each round.
    pub course: Vec<f64>,
    /// Wall time of the design, s.
    pub wall_s: f64,
    /// Processor time of all threads, s.
    ///
    /// The wall time grows on a computer that does other work.
    pub cpu_s: f64,
    /// Physics steps.
    pub steps: u64,
}

impl Motion {
    /// Root mean square of the expected standard deviations.
    pub fn figure(&self) -> f64 {
        root_mean_square(&self.expected)
    }
}

/// Root mean square.
pub fn root_mean_square(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// The motion of a method and a seed, read from its file if it exists.
pub fn designed(
    machine: &Machine,
    setup: &mut MotionSetup<'_>,
    (label, method): (&str, Method),
    seed: u64,
    folder: &Path,
) -> Outcome<Motion> {
    let file = folder.join(format!("{label}-{seed}-motion.json"));
    if file.is_file() {
        return Ok(serde_json::from_str(&std::fs::read_to_string(file)?)?);
    }
    let (clock, cpu, steps) = (Instant::now(), cpu_seconds(), setup.player.steps());
    let found = setup.design(&machine.config, method, seed, &Silent)?;
    let motion = Motion {
        commands: found.commands,
        expected: found.by_slopes.deviations(),
        broken: found.excess.worst.map(|(what, _)| what),
        next_limit: found.next_limit,
        course: found.course,
        wall_s: clock.elapsed().as_secs_f64(),
        cpu_s: cpu_seconds() - cpu,
        steps: setup.player.steps() - steps,
    };
    std::fs::write(file, serde_json::to_string(&motion)?)?;
    Ok(motion)
}

/// Processor time of this program so far, s; 0 where the system has no `/proc` like Linux.
fn cpu_seconds() -> f64 {
    /// Ticks per second of the times in `/proc`, fixed by the kernel's interface.
    const TICKS: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name, which is in brackets, user and system time are the 12th and 13th entries.
    let behind = text.rsplit(')').next().unwrap_or_default();
    let entries = behind.split_whitespace().skip(11).take(2);
    entries.filter_map(|x| x.parse::<f64>().ok()).sum::<f64>() / TICKS
}
