//! CPU time, which is independent of other load on the machine.

use std::time::Duration;

/// Length of a clock tick in `/proc/self/stat`, s: Linux fixes it at 1/100 for programs (proc(5),
/// `USER_HZ`).
const TICK_S: f64 = 0.01;

/// CPU time of this thread.
#[must_use]
pub fn of_thread() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

/// CPU time of this process, s, with the resolution of a tick.
#[must_use]
pub fn of_process() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in brackets may contain blanks; user and system time are the 14th and 15th field.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |place: usize| fields.get(place)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) * TICK_S)
}
