//! How far the rows of a log are apart.

use asid_core::Episode;
use asid_readings::noise::median;

/// Median time between two rows of a log, s.
#[must_use]
pub fn row_time(episode: &Episode) -> f64 {
    let mut each: Vec<f64> = episode.time.windows(2).map(|t| t[1] - t[0]).collect();
    median(&mut each).unwrap_or(0.0)
}
