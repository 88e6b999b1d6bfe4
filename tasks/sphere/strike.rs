//! The tasks' motion primitive: move behind the ball, push it up to a speed, and stop; the ball
//! rolls on.

use asid_core::{Result, Scene};
use asid_mjcf::cartesian::{CartesianController, CartesianSettings};
use nalgebra::Vector3;

use super::{BALL_RADIUS, FINGERS};
use crate::panda;

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.01;

/// Height of the finger pads' middle above the ball, m.
const CLEARANCE: f64 = 0.11;

/// Distance of the hand behind the ball before the stroke, m; they touch at 0.038 m.
const STANDOFF: f64 = 0.048;

/// Distances over which the paddle accelerates and stops, m.
const STROKE: [f64; 2] = [0.10, 0.05];

/// Times to rise, to move over the position behind the ball, to descend, and to wait there, s.
const APPROACH: [f64; 4] = [0.3, 0.6, 0.35, 0.1];

/// Parameters of a strike.
#[derive(Clone, Copy, Debug)]
pub struct Strike {
    /// Believed position of the ball, m.
    pub ball: [f64; 2],
    /// Position in which it must come to rest, m.
    pub goal: [f64; 2],
    /// Distance from ball to goal for which `speed` is meant, m.
    pub distance: f64,
    /// Speed of the paddle for a ball at that distance, m/s. For other distances it scales with the
    /// square root of the distance, since a ball under constant deceleration rolls a distance
    /// proportional to its speed squared.
    pub speed: f64,
    /// Direction of the strike, left of the goal, rad.
    pub aim: f64,
}

/// Number of frames of a phase.
fn phase_frames(seconds: f64) -> usize {
    (seconds / FRAME_PERIOD).round() as usize
}

/// Name, start and end (s) of each phase of an attempt of `seconds`.
pub fn phases(seconds: f64) -> Vec<(String, f64, f64)> {
    let mut at = 0.0;
    let mut phases: Vec<_> = ["rise", "over", "down", "wait"]
        .iter()
        .zip(APPROACH)
        .map(|(name, s)| {
            let from = at;
            at += s;
            ((*name).to_owned(), from, at)
        })
        .collect();
    phases.push(("strike and roll".into(), at, seconds));
    phases
}

/// Distance of the paddle `t` seconds into a stroke at `speed` (m/s), m.
fn way(speed: f64, t: f64) -> f64 {
    let [up, down] = STROKE;
    let [rise, fall] = [2.0 * up / speed, 2.0 * down / speed];
    if t < rise {
        0.5 * speed * t * t / rise
    } else {
        let t = (t - rise).min(fall);
        up + speed * t - 0.5 * speed * t * t / fall
    }
}

/// Commands of an attempt, `frames x actuators`.
pub fn commands(scene: &Scene, home: &[f64], strike: &Strike, frames: usize) -> Result<Vec<f64>> {
    let settings = CartesianSettings::default();
    let mut controller = CartesianController::new(scene, panda::END_EFFECTOR, home, settings)?;
    let ball = Vector3::new(strike.ball[0], strike.ball[1], BALL_RADIUS);
    let goal = Vector3::new(strike.goal[0], strike.goal[1], BALL_RADIUS);
    let length = (goal - ball).norm();
    let heading = (goal.y - ball.y).atan2(goal.x - ball.x) + strike.aim;
    let forward = Vector3::new(heading.cos(), heading.sin(), 0.0);
    let speed = strike.speed * (length / strike.distance).sqrt();
    let behind = ball - forward * STANDOFF;
    let high = |x: Vector3<f64>| Vector3::new(x.x, x.y, CLEARANCE);
    let home_at = controller.position();
    let targets = [high(home_at), high(behind), behind, behind];
    let nu = panda::ARM_JOINTS + 2;
    let mut ctrl = vec![0.0; frames * nu];
    let mut rows = ctrl.chunks_exact_mut(nu);
    for (target, seconds) in targets.into_iter().zip(APPROACH) {
        let from = controller.position();
        let n = phase_frames(seconds);
        for (i, row) in rows.by_ref().take(n).enumerate() {
            let along = minimum_jerk((i + 1) as f64 / n as f64);
            controller.follow(from.lerp(&target, along), FRAME_PERIOD, row);
        }
    }
    for (i, row) in rows.enumerate() {
        let along = way(speed, (i + 1) as f64 * FRAME_PERIOD);
        controller.follow(behind + forward * along, FRAME_PERIOD, row);
    }
    for row in ctrl.chunks_exact_mut(nu) {
        row[panda::ARM_JOINTS..].fill(FINGERS);
    }
    Ok(ctrl)
}

/// Minimum-jerk polynomial from 0 to 1 (Flash and Hogan 1985).
fn minimum_jerk(u: f64) -> f64 {
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_reaches_its_speed_and_stops() {
        let speed = 0.8;
        let dt = 1e-5;
        let fastest = (0..100_000)
            .map(|k| (way(speed, (k + 1) as f64 * dt) - way(speed, k as f64 * dt)) / dt)
            .fold(0.0, f64::max);
        assert!((fastest - speed).abs() < 1e-3);
        assert!((way(speed, 10.0) - 0.15).abs() < 1e-12);
    }
}
