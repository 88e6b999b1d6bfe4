//! Exploration's commands: the paddle is moved over the floor at the height of the ball's middle.

use asid_core::cartesian::{CartesianController, CartesianSettings};
use asid_core::task::Commander;
use asid_core::{Result, Scene};
use nalgebra::Vector3;

use super::FINGERS;
use crate::panda;

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.02;

/// Frames of a control step (10 Hz).
pub const FRAMES: usize = 5;

/// Longest way of a control step, m (0.4 m/s).
const MAX_STEP: f64 = 0.04;

/// Where the hand may go: x, y, and distance from the arm's base, m. A ball fits between the hand and each wall.
const WORKSPACE_X: [f64; 2] = [0.30, 0.70];
const WORKSPACE_Y: [f64; 2] = [-0.46, 0.26];
const REACH: f64 = 0.74;

/// Commander of exploration.
pub struct Steering {
    controller: CartesianController,
}

impl Steering {
    /// A commander that starts at the home posture.
    ///
    /// # Errors
    /// When the scene has no arm.
    pub fn new(scene: &Scene, home: &[f64]) -> Result<Self> {
        let settings = CartesianSettings::default();
        Ok(Self {
            controller: CartesianController::new(scene, panda::END_EFFECTOR, home, settings)?,
        })
    }
}

impl Commander for Steering {
    fn reset(&mut self) {
        self.controller.reset();
    }

    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]) {
        let way = Vector3::new(action[0].clamp(-0.1, 0.1), action[1].clamp(-0.1, 0.1), 0.0);
        let way = way * (MAX_STEP / way.norm().max(1e-12)).min(1.0);
        let velocity = way / (FRAMES as f64 * FRAME_PERIOD);
        let nu = ctrl.len() / FRAMES;
        for row in ctrl.chunks_exact_mut(nu) {
            let (arm, fingers) = row.split_at_mut(panda::ARM_JOINTS);
            self.controller.steer(velocity, clamp, FRAME_PERIOD, arm);
            fingers.fill(FINGERS);
        }
    }
}

/// The nearest point of the workspace.
fn clamp(x: Vector3<f64>) -> Vector3<f64> {
    let [x, y, z] = [
        x.x.clamp(WORKSPACE_X[0], WORKSPACE_X[1]),
        x.y.clamp(WORKSPACE_Y[0], WORKSPACE_Y[1]),
        x.z,
    ];
    let shrink = (REACH / x.hypot(y)).min(1.0);
    Vector3::new(x * shrink, y * shrink, z)
}
