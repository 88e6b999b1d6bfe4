//! Cartesian control of an arm with joint servos: damped least squares on the
//! *commanded* joints.
//!
//! The controller is feed-forward: it integrates its own commanded joints and
//! never looks at measured ones. The commands of an episode are therefore a
//! function of its actions alone, the same for every engine, and a log of the
//! commands is the episode.

use nalgebra::{DMatrix, Isometry3, SMatrix, SVector, UnitQuaternion, Vector3};

use crate::error::Result;
use crate::kinematics::Chain;
use crate::scene::Scene;

/// How the controller turns a pose error into joint steps.
#[derive(Clone, Copy, Debug)]
pub struct CartesianSettings {
    /// Damping of the least squares; larger is smoother near singular postures.
    pub damping: f64,
    /// Newton steps a call of [`CartesianController::track`].
    pub iterations: usize,
    /// Largest joint step of one iteration, rad.
    pub max_step: f64,
}

impl Default for CartesianSettings {
    fn default() -> Self {
        Self {
            damping: 0.02,
            iterations: 3,
            max_step: 0.1,
        }
    }
}

/// Commanded joints that follow a commanded pose of a site.
#[derive(Clone, Debug)]
pub struct CartesianController {
    chain: Chain,
    settings: CartesianSettings,
    home: Vec<f64>,
    q: Vec<f64>,
    jacobian: DMatrix<f64>,
}

impl CartesianController {
    /// A controller of `site`, starting at the joints `home` (one a joint of the chain, rad or m).
    ///
    /// # Errors
    /// When the scene has no such chain or `home` does not fit it.
    pub fn new(
        scene: &Scene,
        site: &str,
        home: &[f64],
        settings: CartesianSettings,
    ) -> Result<Self> {
        let chain = Chain::to_site(scene, site)?;
        if chain.len() != home.len() {
            return Err(crate::Error::Shape(format!(
                "the chain to `{site}` has {} joints, the home posture {}",
                chain.len(),
                home.len()
            )));
        }
        let n = chain.len();
        Ok(Self {
            chain,
            settings,
            home: home.to_vec(),
            q: home.to_vec(),
            jacobian: DMatrix::zeros(6, n),
        })
    }

    /// Puts the commanded joints back to the home posture.
    pub fn reset(&mut self) {
        self.q.copy_from_slice(&self.home);
    }

    /// The commanded joints.
    #[must_use]
    pub fn joints(&self) -> &[f64] {
        &self.q
    }

    /// `world_from_site` at the commanded joints.
    #[must_use]
    pub fn pose(&self) -> Isometry3<f64> {
        self.chain.forward(&self.q, None)
    }

    /// Moves the commanded joints towards `world_from_site`; what the damped step
    /// does not reach in this call is left for the next.
    pub fn track(&mut self, position: Vector3<f64>, rotation: UnitQuaternion<f64>) {
        for _ in 0..self.settings.iterations {
            let pose = self.chain.forward(&self.q, Some(&mut self.jacobian));
            let linear = position - pose.translation.vector;
            let angular = (rotation * pose.rotation.inverse()).scaled_axis();
            let mut error = SVector::<f64, 6>::zeros();
            error.fixed_rows_mut::<3>(0).copy_from(&linear);
            error.fixed_rows_mut::<3>(3).copy_from(&angular);
            // dq = J^T (J J^T + damping^2)^-1 e
            let mut gram = SMatrix::<f64, 6, 6>::identity() * self.settings.damping.powi(2);
            for i in 0..6 {
                for j in 0..6 {
                    for k in 0..self.q.len() {
                        gram[(i, j)] += self.jacobian[(i, k)] * self.jacobian[(j, k)];
                    }
                }
            }
            let Some(factor) = gram.cholesky() else {
                return;
            };
            let y = factor.solve(&error);
            let mut largest = 0.0_f64;
            let mut step = [0.0; 32];
            for k in 0..self.q.len() {
                step[k] = (0..6).map(|i| self.jacobian[(i, k)] * y[i]).sum();
                largest = largest.max(step[k].abs());
            }
            let scale = if largest > self.settings.max_step {
                self.settings.max_step / largest
            } else {
                1.0
            };
            for (q, s) in self.q.iter_mut().zip(step) {
                *q += scale * s;
            }
            self.chain.clamp(&mut self.q);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reaches_a_pose_within_reach() {
        let mut xml = String::from(r#"<mujoco><compiler angle="radian"/><worldbody>"#);
        let axes = [
            "0 0 1", "0 1 0", "0 0 1", "0 1 0", "0 0 1", "0 1 0", "0 0 1",
        ];
        for (i, axis) in axes.iter().enumerate() {
            xml += &format!(
                r#"<body pos="0 0 0.2"><joint name="j{i}" axis="{axis}"/><geom size="0.05"/>"#
            );
        }
        xml += r#"<site name="ee" pos="0 0 0.1"/>"#;
        xml += &"</body>".repeat(7);
        xml += "</worldbody></mujoco>";
        let scene = Scene::from_xml("arm", &xml, &[]).unwrap();
        let home = [0.1, 0.5, 0.0, 1.0, 0.0, 0.6, 0.0];
        let mut controller =
            CartesianController::new(&scene, "ee", &home, CartesianSettings::default()).unwrap();
        let start = controller.pose();
        let goal = start.translation.vector + Vector3::new(0.05, -0.08, 0.02);
        for k in 1..=20 {
            let along = f64::from(k) / 20.0;
            controller.track(start.translation.vector.lerp(&goal, along), start.rotation);
        }
        for _ in 0..5 {
            controller.track(goal, start.rotation);
        }
        let reached = controller.pose();
        assert!((reached.translation.vector - goal).norm() < 1e-4);
        assert!(reached.rotation.angle_to(&start.rotation) < 1e-3);
        controller.reset();
        assert_eq!(controller.joints(), home);
    }
}
