//! The task's motion primitive: the closed gripper moves behind the puck and strikes it once.

use asid_core::{Result, Scene};
use asid_mjcf::cartesian::{CartesianController, CartesianSettings};
use nalgebra::Vector3;

use super::PUCK_RADIUS;
use crate::panda;

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.01;

/// Range of the strength of a strike: doublings of [`MIDDLE_SPEED`].
///
/// The puck's distance is proportional to the squared speed over the friction. A step of strength
/// therefore has the same relative effect at every friction and for either zone.
pub const STRENGTH: [f64; 2] = [-1.0, 1.0];

/// Speed of a strike of strength 0, m/s.
const MIDDLE_SPEED: f64 = 0.4;

/// Distance from the middle of the closed finger pads to their front, m.
const PAD_FRONT: f64 = 0.014;

/// Distance over which the hand accelerates, m. It ends before the hand meets the puck.
const RUN_UP: f64 = 0.035;

/// Distance at constant speed, m; the hand meets the puck in its middle.
const STROKE: f64 = 0.02;

/// Distance over which the hand stops, m.
const RUN_OUT: f64 = 0.03;

/// Time that the hand takes to move behind the puck, s.
const APPROACH: f64 = 0.4;
/// Time that the hand waits there, s.
const STAND: f64 = 0.1;
/// Time from the start of the strike to the end of the attempt, s: a puck on the lowest friction
/// has come to rest.
const WATCH: f64 = 5.0;

/// Number of frames of an attempt.
pub fn frames() -> usize {
    ((APPROACH + STAND + WATCH) / FRAME_PERIOD).round() as usize
}

/// Name, start and end (s) of each phase.
pub fn phases() -> Vec<(String, f64, f64)> {
    let strike = APPROACH + STAND;
    vec![
        ("approach".into(), 0.0, APPROACH),
        ("stand".into(), APPROACH, strike),
        ("strike and slide".into(), strike, strike + WATCH),
    ]
}

/// Distance of the hand `t` seconds after the start of the strike, m.
///
/// It accelerates uniformly to `speed`, moves at constant speed, and stops uniformly.
fn way(speed: f64, t: f64) -> f64 {
    let (up, stroke, out) = (2.0 * RUN_UP / speed, STROKE / speed, 2.0 * RUN_OUT / speed);
    if t < up {
        return RUN_UP * (t / up).powi(2);
    }
    if t < up + stroke {
        return RUN_UP + speed * (t - up);
    }
    let left = (1.0 - (t - up - stroke) / out).max(0.0);
    RUN_UP + STROKE + RUN_OUT * (1.0 - left * left)
}

/// Speed of a strike, m/s: 0.2 to 0.8.
fn speed(strength: f64) -> f64 {
    MIDDLE_SPEED * strength.exp2()
}

/// Commands of an attempt, `frames x actuators`.
///
/// The puck is believed to lie at `start` (x, y, yaw); the strike has the given `strength`.
pub fn commands(scene: &Scene, home: &[f64], start: &[f64], strength: f64) -> Result<Vec<f64>> {
    let settings = CartesianSettings::default();
    let mut controller = CartesianController::new(scene, panda::END_EFFECTOR, home, settings)?;
    let from = controller.position();
    // The fingers stay closed: open ones would throw a puck aside if they did not meet it in its
    // middle.
    let meets = start[0] - PUCK_RADIUS - PAD_FRONT;
    let behind = Vector3::new(meets - RUN_UP - 0.5 * STROKE, start[1], from.z);
    let nu = panda::ARM_JOINTS + 2;
    let mut ctrl = vec![0.0; frames() * nu];
    for (i, row) in ctrl.chunks_exact_mut(nu).enumerate() {
        let t = (i + 1) as f64 * FRAME_PERIOD;
        let u = (t / APPROACH).min(1.0);
        let target = if t <= APPROACH + STAND {
            from.lerp(&behind, u * u * u * (10.0 - 15.0 * u + 6.0 * u * u))
        } else {
            behind + Vector3::x() * way(speed(strength), t - APPROACH - STAND)
        };
        controller.follow(target, FRAME_PERIOD, &mut row[..panda::ARM_JOINTS]);
    }
    Ok(ctrl)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_moves_at_the_speed_of_the_strike_where_it_meets_the_puck() {
        for speed in STRENGTH.map(speed) {
            let meets = 2.0 * RUN_UP / speed + 0.5 * STROKE / speed;
            let h = 1e-4;
            let measured = (way(speed, meets + h) - way(speed, meets - h)) / (2.0 * h);
            assert!((measured - speed).abs() < 1e-9);
            assert!((way(speed, meets) - RUN_UP - 0.5 * STROKE).abs() < 1e-9);
            assert!((way(speed, 100.0) - RUN_UP - STROKE - RUN_OUT).abs() < 1e-12);
        }
    }
}
