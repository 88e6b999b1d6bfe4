//! Wall-clock and CPU time of a piece of work.

use std::ops::AddAssign;
use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};

/// Time that some work took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Wall-clock time, s.
    pub wall_s: f64,
    /// CPU time of all threads of this process, s.
    pub cpu_s: f64,
}

impl Cost {
    /// Infinite cost: the start of a search for a minimum.
    pub const ENDLESS: Self = Self {
        wall_s: f64::INFINITY,
        cpu_s: f64::INFINITY,
    };

    /// The smaller value of each time; other load on the machine only adds time.
    pub fn least(self, other: Self) -> Self {
        Self {
            wall_s: self.wall_s.min(other.wall_s),
            cpu_s: self.cpu_s.min(other.cpu_s),
        }
    }
}

impl AddAssign for Cost {
    fn add_assign(&mut self, other: Self) {
        self.wall_s += other.wall_s;
        self.cpu_s += other.cpu_s;
    }
}

/// Runs `work`; returns its result and its cost.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Cost) {
    let (start, cpu) = (Instant::now(), cpu_s());
    let out = work();
    let cost = Cost {
        wall_s: start.elapsed().as_secs_f64(),
        cpu_s: cpu_s() - cpu,
    };
    (out, cost)
}

/// CPU time that this process has used, s.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
