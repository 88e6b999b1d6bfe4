//! Exploration commands of every task with the arm: displacements move the hand in the plane, over
//! the scene, at a fixed height.

use asid_core::task::{Commander, Coordinate};
use asid_core::{Result, Scene};
use asid_mjcf::cartesian::{CartesianController, CartesianSettings};
use nalgebra::Vector3;

use crate::panda;

/// Length of a frame, s.
pub const FRAME_PERIOD: f64 = 0.02;

/// Frames per control step (10 Hz).
pub const FRAMES: usize = 5;

/// Largest entry of an action, m.
pub const LARGEST: f64 = 0.1;

/// Entries of an action: the hand's displacement in the plane.
#[must_use]
pub fn action() -> Vec<Coordinate> {
    ["dx", "dy"]
        .map(|name| Coordinate::new(name, "m", [-LARGEST, LARGEST]))
        .into()
}

/// Speed and workspace of the hand in a task.
#[derive(Clone, Copy, Debug)]
pub struct Steering {
    /// Largest speed, m/s. The published controller reaches 0.75 m/s.
    pub speed: f64,
    /// Workspace along x, m.
    pub x: [f64; 2],
    /// Workspace along y, m.
    pub y: [f64; 2],
    /// Largest distance from the arm's base, m.
    pub reach: f64,
    /// Command of each finger, m from the middle; 0 for the closed gripper.
    pub fingers: f64,
}

impl Steering {
    /// Creates a commander that starts at the home posture.
    ///
    /// # Errors
    /// When the scene has no arm.
    pub fn commander(self, scene: &Scene, home: &[f64]) -> Result<Box<dyn Commander>> {
        let settings = CartesianSettings::default();
        Ok(Box::new(Hand {
            controller: CartesianController::new(scene, panda::END_EFFECTOR, home, settings)?,
            steering: self,
        }))
    }

    /// The nearest point of the workspace.
    fn clamp(&self, x: Vector3<f64>) -> Vector3<f64> {
        let [px, py] = [
            x.x.clamp(self.x[0], self.x[1]),
            x.y.clamp(self.y[0], self.y[1]),
        ];
        let shrink = (self.reach / px.hypot(py)).min(1.0);
        Vector3::new(px * shrink, py * shrink, x.z)
    }
}

/// The commander of the hand.
struct Hand {
    controller: CartesianController,
    steering: Steering,
}

impl Commander for Hand {
    fn reset(&mut self) {
        self.controller.reset();
    }

    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]) {
        let [x, y] = [0, 1].map(|i| action[i].clamp(-LARGEST, LARGEST));
        let way = Vector3::new(x, y, 0.0);
        let step = FRAMES as f64 * FRAME_PERIOD;
        let way = way * (self.steering.speed * step / way.norm().max(1e-12)).min(1.0);
        let velocity = way / step;
        let nu = ctrl.len() / FRAMES;
        for row in ctrl.chunks_exact_mut(nu) {
            let (arm, fingers) = row.split_at_mut(panda::ARM_JOINTS);
            let clamp = |x| self.steering.clamp(x);
            self.controller.steer(velocity, clamp, FRAME_PERIOD, arm);
            fingers.fill(self.steering.fingers);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_stays_in_its_box_and_within_reach() {
        let steering = Steering {
            speed: 0.4,
            x: [0.3, 0.7],
            y: [-0.4, 0.4],
            reach: 0.74,
            fingers: 0.0,
        };
        let inside = Vector3::new(0.5, 0.1, 0.14);
        assert_eq!(steering.clamp(inside), inside);
        let corner = steering.clamp(Vector3::new(2.0, -2.0, 0.14));
        assert!((corner.xy().norm() - 0.74).abs() < 1e-12);
        assert!((corner.y / corner.x + 0.4 / 0.7).abs() < 1e-12);
    }
}
