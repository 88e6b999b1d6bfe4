//! Where readings are missing: sensors by name, logs by file.

use crate::data::Logs;

use super::MISSING;

/// Maximum number of named sensors and logs; the rest is only counted.
const NAMED: usize = 4;

/// Names the sensors that lack more than the accepted share of a log, with the log, largest share
/// first; as the end of a sentence.
#[must_use]
pub(super) fn named(logs: [&Logs; 2]) -> String {
    let mut found: Vec<(f64, String)> = logs.into_iter().flat_map(lacking).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    if found.is_empty() {
        return String::new();
    }
    let each = found.iter().take(NAMED);
    let each = each.map(|(share, place)| format!("{:.0} % of {place}", 100.0 * share));
    let mut each: Vec<String> = each.collect();
    if found.len() > NAMED {
        each.push(format!("{} more", found.len() - NAMED));
    }
    format!(": {}", each.join(", "))
}

/// Returns the sensors and logs with more than the accepted share of missing readings, each with
/// that share.
fn lacking(logs: &Logs) -> Vec<(f64, String)> {
    let (present, n) = (logs.present(), logs.entries.len());
    let mut found = Vec::new();
    for (i, episode) in logs.episodes.iter().enumerate() {
        let of_log = &present[logs.offset(i)..][..n * episode.plan.rows()];
        for (place, sensor) in logs.sensors.iter().enumerate() {
            let own = of_log.iter().zip(logs.entries.iter().cycle());
            let own: Vec<bool> = own
                .filter(|(_, e)| e.sensor == place)
                .map(|(p, _)| *p)
                .collect();
            let there = own.iter().filter(|p| **p).count();
            let share = 1.0 - there as f64 / own.len().max(1) as f64;
            if share > MISSING {
                found.push((share, format!("`{}` in {}", sensor.name, episode.name)));
            }
        }
    }
    found
}
