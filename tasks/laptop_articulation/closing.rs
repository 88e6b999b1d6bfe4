//! The task's motion primitive: move behind the lid, push it towards the base, and leave it there.

use asid_core::task::Coordinate;
use asid_core::{Result, Scene};
use asid_mjcf::cartesian::{CartesianController, CartesianSettings};
use nalgebra::Vector3;

use super::PLATE_HALF;
use crate::panda;

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.02;

/// Start position of the hand behind the hinge, m.
const BEHIND: f64 = 0.10;

/// Phases of the motion: name and duration, s.
const PHASES: [(&str, f64); 5] = [
    ("approach", 0.9),
    ("push", 1.4),
    ("hold", 0.1),
    ("retreat", 0.5),
    ("wait", 0.3),
];

/// The action: how far in front of the hinge the hand stops its push, m.
pub fn action() -> Vec<Coordinate> {
    vec![Coordinate::new("reach", "m", [0.0, 0.12])]
}

/// Start poses: the laptop stands open, with its hinge towards the arm.
pub fn start() -> Vec<Coordinate> {
    let quarter = std::f64::consts::FRAC_PI_2;
    vec![
        Coordinate::new("x", "m", [0.595, 0.605]),
        Coordinate::new("y", "m", [-0.005, 0.005]),
        Coordinate::new("yaw", "rad", [quarter - 0.03, quarter + 0.03]),
        Coordinate::new("lid", "rad", [1.7, 1.9]),
    ]
}

fn phase_frames(seconds: f64) -> usize {
    (seconds / FRAME_PERIOD).round() as usize
}

/// Number of frames of an attempt.
pub fn frames() -> usize {
    PHASES.iter().map(|p| phase_frames(p.1)).sum()
}

/// Name, start and end (s) of each phase.
pub fn phases() -> Vec<(String, f64, f64)> {
    let mut at = 0.0;
    PHASES
        .iter()
        .map(|(name, seconds)| {
            let from = at;
            at += seconds;
            ((*name).to_owned(), from, at)
        })
        .collect()
}

/// Commands of an attempt, `frames x actuators`.
///
/// The laptop is believed to stand at `start` (x, y, yaw, lid); the hand stops `reach` (m) in front
/// of the hinge.
pub fn commands(scene: &Scene, home: &[f64], start: &[f64], reach: f64) -> Result<Vec<f64>> {
    let mut controller = CartesianController::new(
        scene,
        panda::END_EFFECTOR,
        home,
        CartesianSettings::default(),
    )?;
    let height = controller.position().z;
    let (sin, cos) = start[2].sin_cos();
    // The hinge is at the base's +y edge; the front is towards -y.
    let in_front = |way: f64| {
        let y = PLATE_HALF[1] - way;
        Vector3::new(start[0] - sin * y, start[1] + cos * y, height)
    };
    let targets = [-BEHIND, reach, reach, -BEHIND, -BEHIND].map(in_front);
    let nu = panda::ARM_JOINTS + 2;
    let mut ctrl = vec![0.0; frames() * nu];
    let mut rows = ctrl.chunks_exact_mut(nu);
    for (target, (_, seconds)) in targets.into_iter().zip(PHASES) {
        let from = controller.position();
        let n = phase_frames(seconds);
        for (i, row) in rows.by_ref().take(n).enumerate() {
            let along = (i + 1) as f64 / n as f64;
            let arm = &mut row[..panda::ARM_JOINTS];
            controller.follow(from.lerp(&target, minimum_jerk(along)), FRAME_PERIOD, arm);
        }
    }
    Ok(ctrl)
}

/// Minimum-jerk polynomial from 0 to 1 (Flash and Hogan 1985).
fn minimum_jerk(u: f64) -> f64 {
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}
