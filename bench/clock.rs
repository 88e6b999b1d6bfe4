//! Wall-clock and CPU time of a piece of work.

use std::ops::AddAssign;
use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};

/// Seconds that something took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// By the clock on the wall.
    pub wall_s: f64,
    /// Of all threads of this process, on their cores.
    pub cpu_s: f64,
}

impl Cost {
    /// What no work undercuts: the start of a search for the least.
    pub const ENDLESS: Self = Self {
        wall_s: f64::INFINITY,
        cpu_s: f64::INFINITY,
    };

    /// The lesser of both times; other load on the machine only adds.
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

/// Does `work` and tells what it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Cost) {
    let (start, cpu) = (Instant::now(), cpu_s());
    let out = work();
    let cost = Cost {
        wall_s: start.elapsed().as_secs_f64(),
        cpu_s: cpu_s() - cpu,
    };
    (out, cost)
}

/// CPU time that this process has taken, s.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
