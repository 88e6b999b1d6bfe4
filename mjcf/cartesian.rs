//! Cartesian control of an arm with joint servos: damped least squares on *commanded* joints.
//!
//! The controller is feed-forward: it integrates its own reference and never reads measured joints.
//! The commands of an episode are therefore a function of its actions alone, the same for every
//! engine, and a log of the commands defines the episode.
//!
//! A position servo with damping trails its command by `(kv + damping) / kp` seconds (0.1 s and
//! more for a Panda as it is used here). The commands lead the reference by that time, so that the
//! arm itself follows the reference.

use nalgebra::{DMatrix, Isometry3, SMatrix, SVector, UnitQuaternion, Vector3};

use crate::kinematics::{Chain, MAX_LINKS};
use asid_core::error::{Error, Result};
use asid_core::scene::Scene;

/// Gains and limits of the controller.
#[derive(Clone, Copy, Debug)]
pub struct CartesianSettings {
    /// Damping of the least squares; larger values are smoother near singular postures.
    pub damping: f64,
    /// Rate at which an error of position or rotation decays, 1/s.
    pub gain: f64,
    /// Rate at which the joints return to the home posture in the null space of the task, 1/s.
    pub posture_gain: f64,
    /// Largest acceleration of the reference, m/s².
    pub max_acceleration: f64,
    /// Largest speed of a joint, rad/s.
    pub max_joint_speed: f64,
}

impl Default for CartesianSettings {
    fn default() -> Self {
        Self {
            damping: 0.02,
            gain: 10.0,
            posture_gain: 1.0,
            max_acceleration: 5.0,
            max_joint_speed: 2.175,
        }
    }
}

/// Moves a site along a reference, with the orientation of the home posture.
#[derive(Clone, Debug)]
pub struct CartesianController {
    chain: Chain,
    settings: CartesianSettings,
    home: Vec<f64>,
    lead: Vec<f64>,
    ranges: Vec<Option<[f64; 2]>>,
    rotation: UnitQuaternion<f64>,
    start: Vector3<f64>,
    q: Vec<f64>,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    jacobian: DMatrix<f64>,
}

impl CartesianController {
    /// A controller of `site` that starts at the joint positions `home` (one for each joint, rad or
    /// m).
    ///
    /// # Errors
    /// When the scene has no such chain, `home` does not fit it, or one of its joints has no
    /// position servo.
    pub fn new(
        scene: &Scene,
        site: &str,
        home: &[f64],
        settings: CartesianSettings,
    ) -> Result<Self> {
        let chain = Chain::to_site(scene, site)?;
        if chain.len() != home.len() {
            return Err(Error::Shape(format!(
                "the chain to `{site}` has {} joints, the home posture {}",
                chain.len(),
                home.len()
            )));
        }
        let pose = chain.forward(home, None);
        let (lead, ranges) = servos(scene, &chain)?.into_iter().unzip();
        Ok(Self {
            lead,
            ranges,
            rotation: pose.rotation,
            start: pose.translation.vector,
            position: pose.translation.vector,
            velocity: Vector3::zeros(),
            q: home.to_vec(),
            jacobian: DMatrix::zeros(6, chain.len()),
            home: home.to_vec(),
            chain,
            settings,
        })
    }

    /// Returns to the home posture, at rest.
    pub fn reset(&mut self) {
        self.q.copy_from_slice(&self.home);
        self.position = self.start;
        self.velocity = Vector3::zeros();
    }

    /// Position of the reference, m.
    #[must_use]
    pub fn position(&self) -> Vector3<f64> {
        self.position
    }

    /// Pose `world_from_site` at the reference's joints.
    #[must_use]
    pub fn pose(&self) -> Isometry3<f64> {
        self.chain.forward(&self.q, None)
    }

    /// Moves the reference for `dt` seconds towards the velocity `wanted` (m/s), and writes the
    /// commands.
    ///
    /// The acceleration is limited, and `clamp` limits the position. There is one command for each
    /// joint.
    pub fn steer(
        &mut self,
        wanted: Vector3<f64>,
        clamp: impl Fn(Vector3<f64>) -> Vector3<f64>,
        dt: f64,
        ctrl: &mut [f64],
    ) {
        let change = wanted - self.velocity;
        let limit = self.settings.max_acceleration * dt;
        let change = if change.norm() > limit {
            change * (limit / change.norm())
        } else {
            change
        };
        let next = clamp(self.position + (self.velocity + change) * dt);
        self.follow(next, dt, ctrl);
    }

    /// Moves the reference to `next` (m) within `dt` seconds, and writes one command for each
    /// joint.
    pub fn follow(&mut self, next: Vector3<f64>, dt: f64, ctrl: &mut [f64]) {
        let s = &self.settings;
        self.velocity = (next - self.position) / dt;
        let pose = self.chain.forward(&self.q, Some(&mut self.jacobian));
        let linear = self.velocity + s.gain * (self.position - pose.translation.vector);
        let angular = s.gain * (self.rotation * pose.rotation.inverse()).scaled_axis();
        let n = self.q.len();
        // Towards the target by J^T (J J^T + damping^2)^-1, and home in the null space of J.
        let mut posture = [0.0; MAX_LINKS];
        let mut error = SVector::<f64, 6>::zeros();
        error.fixed_rows_mut::<3>(0).copy_from(&linear);
        error.fixed_rows_mut::<3>(3).copy_from(&angular);
        for k in 0..n {
            posture[k] = s.posture_gain * (self.home[k] - self.q[k]);
            for i in 0..6 {
                error[i] -= self.jacobian[(i, k)] * posture[k];
            }
        }
        let mut gram = SMatrix::<f64, 6, 6>::identity() * s.damping.powi(2);
        for i in 0..6 {
            for j in 0..6 {
                for k in 0..n {
                    gram[(i, j)] += self.jacobian[(i, k)] * self.jacobian[(j, k)];
                }
            }
        }
        let y = gram
            .cholesky()
            .map_or_else(SVector::zeros, |factor| factor.solve(&error));
        let mut speed = [0.0; MAX_LINKS];
        let mut fastest = 0.0_f64;
        for k in 0..n {
            speed[k] = posture[k] + (0..6).map(|i| self.jacobian[(i, k)] * y[i]).sum::<f64>();
            fastest = fastest.max(speed[k].abs());
        }
        let scale = (s.max_joint_speed / fastest.max(1e-12)).min(1.0);
        let before: [f64; MAX_LINKS] =
            std::array::from_fn(|k| self.q.get(k).copied().unwrap_or(0.0));
        for k in 0..n {
            self.q[k] += scale * speed[k] * dt;
        }
        self.chain.clamp(&mut self.q);
        for k in 0..n {
            let really = (self.q[k] - before[k]) / dt;
            ctrl[k] = before[k] + really * (dt / 2.0 + self.lead[k]);
        }
        for (c, range) in ctrl.iter_mut().zip(&self.ranges) {
            if let Some([low, high]) = range {
                *c = c.clamp(*low, *high);
            }
        }
        // Where the joints are too slow, the reference waits for them.
        self.position += (next - self.position) * scale;
        self.velocity *= scale;
    }
}

/// For each joint of the chain: the lag (s) behind its servo's command, and the command's range.
fn servos(scene: &Scene, chain: &Chain) -> Result<Vec<(f64, Option<[f64; 2]>)>> {
    let model = scene.description()?;
    chain
        .joints()
        .iter()
        .map(|name| {
            let servo = model
                .actuators
                .iter()
                .find(|a| a.joint.as_deref() == Some(name) && a.kp.is_some_and(|kp| kp > 0.0));
            let Some((servo, kp)) = servo.and_then(|a| Some((a, a.kp?))) else {
                return Err(Error::Scene {
                    scene: scene.name().to_owned(),
                    message: format!("joint `{name}` has no position servo with a gain kp"),
                });
            };
            let damping = model
                .joint_by_name(name)
                .map_or(0.0, |(body, i)| model.bodies[body].body.joints[i].damping);
            let lead = (servo.kv.unwrap_or(0.0) + damping) / kp;
            Ok((lead, servo.ctrl_range))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arm() -> CartesianController {
        let mut xml = String::from(r#"<mujoco><compiler angle="radian"/><worldbody>"#);
        let axes = [
            "0 0 1", "0 1 0", "0 0 1", "0 1 0", "0 0 1", "0 1 0", "0 0 1",
        ];
        for (i, axis) in axes.iter().enumerate() {
            xml += &format!(
                r#"<body pos="0 0 0.2"><joint name="j{i}" axis="{axis}" damping="5"/><geom size="0.05"/>"#
            );
        }
        xml += r#"<site name="ee" pos="0 0 0.1"/>"#;
        xml += &"</body>".repeat(7);
        xml += "</worldbody><actuator>";
        for i in 0..7 {
            xml += &format!(r#"<position name="j{i}" joint="j{i}" kp="1000" kv="95"/>"#);
        }
        xml += "</actuator></mujoco>";
        let scene = Scene::from_xml("arm", &xml, &[]).unwrap();
        let home = [0.1, 0.5, 0.0, 1.0, 0.0, 0.6, 0.0];
        CartesianController::new(&scene, "ee", &home, CartesianSettings::default()).unwrap()
    }

    #[test]
    fn the_reference_reaches_a_pose_and_keeps_its_orientation() {
        let mut controller = arm();
        let (start, rotation) = (controller.position(), controller.pose().rotation);
        let goal = start + Vector3::new(0.05, -0.08, 0.02);
        let mut ctrl = [0.0; 7];
        for k in 1..=50 {
            controller.follow(start.lerp(&goal, f64::from(k) / 50.0), 0.02, &mut ctrl);
        }
        for _ in 0..50 {
            controller.follow(goal, 0.02, &mut ctrl);
        }
        // The damping leaves damping^2 / sigma^2 of the posture's pull: about 0.1 mm and 1 mrad
        // here.
        assert!((controller.pose().translation.vector - goal).norm() < 1e-3);
        assert!(controller.pose().rotation.angle_to(&rotation) < 1e-2);
        controller.reset();
        assert_eq!(controller.position(), start);
    }

    #[test]
    fn commands_lead_by_the_servo_lag() {
        let mut controller = arm();
        let mut ctrl = [0.0; 7];
        let dt = 0.02;
        let q0 = controller.q.clone();
        controller.follow(
            controller.position() + Vector3::new(0.0, 0.002, 0.0),
            dt,
            &mut ctrl,
        );
        for k in 0..7 {
            // (kv + damping) / kp = 0.1 s, and half a row.
            let speed = (controller.q[k] - q0[k]) / dt;
            assert!((ctrl[k] - (q0[k] + speed * (0.1 + dt / 2.0))).abs() < 1e-12);
        }
    }

    #[test]
    fn the_reference_keeps_to_the_largest_acceleration() {
        let mut controller = arm();
        let mut ctrl = [0.0; 7];
        let mut last = Vector3::zeros();
        for _ in 0..6 {
            let from = controller.position();
            controller.steer(Vector3::new(0.3, 0.0, 0.0), |x| x, 0.02, &mut ctrl);
            let velocity = (controller.position() - from) / 0.02;
            assert!((velocity - last).norm() <= 5.0 * 0.02 + 1e-9);
            last = velocity;
        }
        assert!((last.x - 0.3).abs() < 1e-9);
    }
}
