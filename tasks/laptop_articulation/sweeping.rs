//! Exploration's commands: the closed gripper is swept over the table at a height at which it passes
//! over the base and meets the lid.

use asid_core::cartesian::{CartesianController, CartesianSettings};
use asid_core::task::Commander;
use asid_core::{Result, Scene};
use nalgebra::Vector3;

use crate::panda;

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.02;

/// Frames of a control step (10 Hz).
const FRAMES: usize = 5;

/// Longest way of a control step, m (0.5 m/s).
const MAX_STEP: f64 = 0.05;

/// Where the hand may go: x, y, and distance from the arm's base, m.
const WORKSPACE_X: [f64; 2] = [0.25, 0.75];
const WORKSPACE_Y: [f64; 2] = [-0.5, 0.45];
const REACH: f64 = 0.76;

/// Commander of the sweep.
pub struct Sweeping {
    controller: CartesianController,
}

impl Sweeping {
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

impl Commander for Sweeping {
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
            fingers.fill(0.0);
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
