//! How far from the goal the ball comes to rest.

use asid_core::task::Outcome;

/// Entries of a row of readings: the ball's position.
pub const WIDTH: usize = 3;

/// Largest distance of a success: the goal's radius, m.
pub const GOAL_RADIUS: f64 = 0.05;

/// A ball that moved by less in the last [`REST_FRAMES`] is at rest, m (10 mm/s).
const REST_WAY: f64 = 0.001;

/// Frames over which rest is judged: 0.1 s.
const REST_FRAMES: usize = 10;

/// Distance and cost of an attempt that diverged, m.
const LOST_COST: f64 = 2.0;

/// Distance of the ball from the goal in the plane, m.
pub fn distance(row: &[f64], goal: [f64; 2]) -> f64 {
    (row[0] - goal[0]).hypot(row[1] - goal[1])
}

/// What came of an attempt: the distance in the last row, if the ball rests there.
pub fn outcome(readings: &[f64], goal: [f64; 2]) -> Outcome {
    let rows = readings.len() / WIDTH;
    let row = |k: usize| &readings[k * WIDTH..][..WIDTH];
    let last = row(rows - 1);
    if last.iter().any(|x| !x.is_finite()) {
        return Outcome {
            value: LOST_COST,
            success: false,
            cost: LOST_COST,
        };
    }
    let before = row(rows.saturating_sub(1 + REST_FRAMES));
    let rests = distance(last, [before[0], before[1]]) < REST_WAY;
    let value = distance(last, goal);
    Outcome {
        value,
        success: rests && value <= GOAL_RADIUS,
        cost: value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_at_rest_in_the_goal_is_a_success_and_one_that_passes_is_none() {
        let goal = [0.1, -0.2];
        let still: Vec<f64> = [0.13, -0.24, 0.03].repeat(40);
        let there = outcome(&still, goal);
        assert!(there.success && (there.value - 0.05).abs() < 1e-12);
        let mut passing = still.clone();
        for (k, row) in passing.chunks_exact_mut(WIDTH).enumerate() {
            row[0] = 0.1 - 0.01 * (39 - k) as f64;
        }
        let passes = outcome(&passing, goal);
        assert!(!passes.success && passes.value < 0.05);
        assert!(!outcome(&[0.2, -0.2, 0.03].repeat(40), goal).success);
        assert!(!outcome(&[f64::NAN; 120], goal).success);
    }
}
