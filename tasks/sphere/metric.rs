//! Success of a strike: the distance from the goal at which the ball comes to rest.

use asid_core::task::Outcome;

use super::strike::FRAME_PERIOD;

/// Entries of a row of readings: the ball's position.
pub const WIDTH: usize = 3;

/// A ball that moved less than this in the last [`REST_FRAMES`] is at rest, m (10 mm/s).
const REST_WAY: f64 = 0.001;

/// Frames over which rest is judged: 0.1 s.
const REST_FRAMES: usize = 10;

/// Distance and cost of an attempt that diverged, m.
const LOST_COST: f64 = 2.0;

/// Distance of the ball from the goal in the plane, m.
pub fn distance(row: &[f64], goal: [f64; 2]) -> f64 {
    (row[0] - goal[0]).hypot(row[1] - goal[1])
}

/// Weight of the speed of a ball that passes the line behind the goal, s: it turns the speed into a
/// cost in metres.
const OVERSHOOT: f64 = 1.0;

/// The goal in which the ball must come to rest.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Position of its centre, m.
    pub at: [f64; 2],
    /// Largest distance of a success, m.
    pub radius: f64,
}

/// Outcome of an attempt: the distance in the last row; a success requires that the ball is at
/// rest.
///
/// `line` is a y coordinate behind the goal. Every ball that is too fast ends at the same wall, so
/// the cost includes the speed at which it passes that line. This leads a search back to the goal.
pub fn outcome(readings: &[f64], goal: Goal, line: Option<f64>) -> Outcome {
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
    let value = distance(last, goal.at);
    Outcome {
        value,
        success: rests && value <= goal.radius,
        cost: value + OVERSHOOT * line.map_or(0.0, |y| speed_at(readings, y)),
    }
}

/// Speed at which the ball passes a y coordinate towards lower ones, m/s; 0 where it does not reach
/// it.
fn speed_at(readings: &[f64], y: f64) -> f64 {
    let mut steps = readings
        .chunks_exact(WIDTH)
        .zip(readings.chunks_exact(WIDTH).skip(1));
    let past = steps.find(|(before, after)| before[1] > y && after[1] <= y);
    past.map_or(0.0, |(before, after)| {
        distance(after, [before[0], before[1]]) / FRAME_PERIOD
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn to(at: [f64; 2]) -> Goal {
        Goal { at, radius: 0.05 }
    }

    #[test]
    fn a_ball_at_rest_in_the_goal_is_a_success_and_one_that_passes_is_none() {
        let goal = to([0.1, -0.2]);
        let still: Vec<f64> = [0.13, -0.24, 0.03].repeat(40);
        let there = outcome(&still, goal, None);
        assert!(there.success && (there.value - 0.05).abs() < 1e-12);
        let mut passing = still.clone();
        for (k, row) in passing.chunks_exact_mut(WIDTH).enumerate() {
            row[0] = 0.1 - 0.01 * (39 - k) as f64;
        }
        let passes = outcome(&passing, goal, None);
        assert!(!passes.success && passes.value < 0.05);
        assert!(!outcome(&[0.2, -0.2, 0.03].repeat(40), goal, None).success);
        assert!(!outcome(&[f64::NAN; 120], goal, None).success);
    }

    #[test]
    fn a_faster_ball_at_the_same_wall_costs_more() {
        let to_the_wall = |way: f64| -> Vec<f64> {
            let y = |k: usize| (-way * k as f64).max(-0.5);
            (0..200).flat_map(|k| [0.0, y(k), 0.03]).collect()
        };
        let tried = |way: f64| outcome(&to_the_wall(way), to([0.0, -0.38]), Some(-0.46));
        let (slow, fast) = (tried(0.004), tried(0.008));
        assert_eq!(slow.value, fast.value);
        assert!((slow.cost - slow.value - 0.4).abs() < 1e-9);
        assert!((fast.cost - fast.value - 0.8).abs() < 1e-9);
        let short: Vec<f64> = [0.0, -0.40, 0.03].repeat(40);
        let rests = outcome(&short, to([0.0, -0.38]), Some(-0.46));
        assert_eq!(rests.cost, rests.value);
    }
}
