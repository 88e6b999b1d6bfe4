//! The task's motion primitive: pick the rod at a point, lay that point over the ledge, let go.

use asid_core::task::Coordinate;
use asid_core::{Result, Scene};
use asid_mjcf::cartesian::{CartesianController, CartesianSettings};
use nalgebra::Vector3;

use super::{LEDGE, ROD_HALF};
use crate::panda::{self, FINGER_OPEN};

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.02;

/// Height of the finger pads' middle when they grip the rod on the table, m.
const GRIP_HEIGHT: f64 = 0.02;

/// Gap between the ledge and the rod's underside at release, m.
const RELEASE_GAP: f64 = 0.0005;

/// Phases of the motion: name, duration (s), finger command at the end.
const PHASES: [(&str, f64, f64); 10] = [
    ("above", 0.70, FINGER_OPEN),
    ("down", 0.25, FINGER_OPEN),
    ("grasp", 0.25, 0.0),
    ("lift", 0.40, 0.0),
    ("carry", 0.90, 0.0),
    ("lower", 0.30, 0.0),
    ("settle", 0.10, 0.0),
    ("release", 0.20, FINGER_OPEN),
    ("rise", 0.30, FINGER_OPEN),
    ("wait", 1.00, FINGER_OPEN),
];

/// Start poses: the rod lies along the x axis, so that the gripper closes across it without a turn
/// of the wrist.
pub fn start() -> Vec<Coordinate> {
    let quarter = std::f64::consts::FRAC_PI_2;
    vec![
        Coordinate::new("x", "m", [0.495, 0.505]),
        Coordinate::new("y", "m", [-0.205, -0.195]),
        Coordinate::new("yaw", "rad", [-quarter - 0.03, -quarter + 0.03]),
    ]
}

/// Number of frames of a phase.
fn phase_frames(seconds: f64) -> usize {
    (seconds / FRAME_PERIOD).round() as usize
}

/// Number of frames of an attempt.
pub fn frames() -> usize {
    PHASES.iter().map(|p| phase_frames(p.1)).sum()
}

/// Name, start and end (s) of each phase.
pub fn phases() -> Vec<(String, f64, f64)> {
    let mut at = 0;
    PHASES
        .iter()
        .map(|(name, seconds, _)| {
            let from = at;
            at += phase_frames(*seconds);
            (
                (*name).to_owned(),
                from as f64 * FRAME_PERIOD,
                at as f64 * FRAME_PERIOD,
            )
        })
        .collect()
}

/// Commands of an attempt, `frames x actuators`.
///
/// The rod is believed to lie at `start` (x, y, yaw); `pick` is the point (m from its middle, along
/// it).
pub fn commands(scene: &Scene, home: &[f64], start: &[f64], pick: f64) -> Result<Vec<f64>> {
    let mut controller = CartesianController::new(
        scene,
        panda::END_EFFECTOR,
        home,
        CartesianSettings::default(),
    )?;
    let (sin, cos) = start[2].sin_cos();
    let over_rod = |z| Vector3::new(start[0] - sin * pick, start[1] + cos * pick, z);
    let rest = LEDGE[2] + ROD_HALF[2];
    let over_ledge = |z| Vector3::new(LEDGE[0], LEDGE[1], z);
    let targets = [
        over_rod(0.10),
        over_rod(GRIP_HEIGHT),
        over_rod(GRIP_HEIGHT),
        over_rod(0.14),
        over_ledge(rest + 0.03),
        over_ledge(rest + RELEASE_GAP),
        over_ledge(rest + RELEASE_GAP),
        over_ledge(rest + RELEASE_GAP),
        over_ledge(rest + 0.08),
        over_ledge(rest + 0.08),
    ];
    let nu = panda::ARM_JOINTS + 2;
    let mut ctrl = vec![0.0; frames() * nu];
    let mut rows = ctrl.chunks_exact_mut(nu);
    let mut finger_from = FINGER_OPEN;
    for (target, (_, seconds, finger_to)) in targets.into_iter().zip(PHASES) {
        let from = controller.position();
        let n = phase_frames(seconds);
        for (i, row) in rows.by_ref().take(n).enumerate() {
            let along = (i + 1) as f64 / n as f64;
            let (arm, fingers) = row.split_at_mut(panda::ARM_JOINTS);
            controller.follow(from.lerp(&target, minimum_jerk(along)), FRAME_PERIOD, arm);
            fingers.fill(finger_from + along * (finger_to - finger_from));
        }
        finger_from = finger_to;
    }
    Ok(ctrl)
}

/// Minimum-jerk polynomial from 0 to 1 (Flash and Hogan 1985).
fn minimum_jerk(u: f64) -> f64 {
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}
