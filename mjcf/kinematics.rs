//! Forward kinematics of one chain of a scene, read from its document.
//!
//! The controller of the arm must be the same for every engine, so its kinematics come from the
//! scene and not from an engine.

use mjcf_rs::body::JointType;
use nalgebra::{DMatrix, Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use asid_core::error::{Error, Result};
use asid_core::scene::Scene;

/// One joint of a chain.
#[derive(Clone, Debug)]
struct Link {
    /// Pose of the joint's body in the frame of the previous link, at zero angle.
    previous_from_body: Isometry3<f64>,
    /// Anchor in the body's frame, m.
    anchor: Vector3<f64>,
    /// Axis in the body's frame.
    axis: Unit<Vector3<f64>>,
    /// Hinge (true) or slide (false).
    hinge: bool,
    /// Coordinate at which the body has its declared pose.
    reference: f64,
    /// Limits of the coordinate, if any.
    range: Option<[f64; 2]>,
}

/// The joints between the world and a site, in order.
#[derive(Clone, Debug)]
pub struct Chain {
    links: Vec<Link>,
    last_from_site: Isometry3<f64>,
    names: Vec<String>,
}

fn isometry(pose: &mjcf_rs::Pose) -> Isometry3<f64> {
    let (t, q) = (pose.translation, pose.rotation);
    Isometry3::from_parts(
        Translation3::new(t.x, t.y, t.z),
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}

impl Chain {
    /// The chain from the world to the site of this name.
    ///
    /// # Errors
    /// When there is no such site, or the chain has more than [`MAX_LINKS`] joints. Also when a
    /// joint of it is neither hinge nor slide, or a body on it has several joints.
    pub fn to_site(scene: &Scene, site: &str) -> Result<Self> {
        let model = scene.description()?;
        let fail = |message: String| Error::Scene {
            scene: scene.name().to_owned(),
            message,
        };
        let (body, index) = model
            .site_by_name(site)
            .ok_or_else(|| fail(format!("has no site `{site}`")))?;
        let mut path = vec![body];
        let mut at = body;
        while let Some(parent) = model.bodies[at].parent {
            path.push(parent);
            at = parent;
        }
        path.reverse();
        let mut links = Vec::new();
        let mut names = Vec::new();
        let mut pending = Isometry3::identity();
        for id in path {
            let b = &model.bodies[id].body;
            pending *= isometry(&b.pose);
            let joint = match &b.joints[..] {
                [] => continue,
                [joint] => joint,
                _ => {
                    let body = b.name.clone().unwrap_or_default();
                    return Err(fail(format!(
                        "body `{body}` has several joints; a chain takes one a body"
                    )));
                }
            };
            let name = joint.name.clone().unwrap_or_default();
            let hinge = match joint.type_ {
                JointType::Hinge => true,
                JointType::Slide => false,
                _ => {
                    return Err(fail(format!(
                        "joint `{name}` is neither a hinge nor a slide"
                    )));
                }
            };
            links.push(Link {
                previous_from_body: pending,
                anchor: Vector3::from(joint.pos),
                axis: Unit::new_normalize(Vector3::from(joint.axis)),
                hinge,
                reference: joint.ref_,
                range: joint.range,
            });
            names.push(name);
            pending = Isometry3::identity();
        }
        if links.len() > MAX_LINKS {
            return Err(fail(format!(
                "the chain to site `{site}` has more than {MAX_LINKS} joints"
            )));
        }
        let last_from_site = pending * isometry(&model.bodies[body].body.sites[index].pose);
        Ok(Self {
            links,
            last_from_site,
            names,
        })
    }

    /// Number of joints, `n`.
    #[must_use]
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Whether the site is fixed to the world.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Names of the joints, from the world to the site.
    #[must_use]
    pub fn joints(&self) -> &[String] {
        &self.names
    }

    /// Clamps coordinates to the joints' limits.
    pub fn clamp(&self, q: &mut [f64]) {
        for (x, link) in q.iter_mut().zip(&self.links) {
            if let Some([low, high]) = link.range {
                *x = x.clamp(low, high);
            }
        }
    }

    /// Pose `world_from_site` at the coordinates `q` (rad or m, `n`), and its Jacobian.
    ///
    /// If given, `jacobian` (`6 x n`) receives the site's linear, then angular velocity in the
    /// world frame per unit of each joint's velocity.
    pub fn forward(&self, q: &[f64], jacobian: Option<&mut DMatrix<f64>>) -> Isometry3<f64> {
        let mut world = Isometry3::identity();
        let mut axes = [(Vector3::zeros(), Vector3::zeros(), true); MAX_LINKS];
        for (i, (link, &x)) in self.links.iter().zip(q).enumerate() {
            world *= link.previous_from_body;
            let moved = x - link.reference;
            axes[i] = (
                (world * nalgebra::Point3::from(link.anchor)).coords,
                world.rotation * link.axis.into_inner(),
                link.hinge,
            );
            world *= if link.hinge {
                let turn = UnitQuaternion::from_axis_angle(&link.axis, moved);
                Isometry3::from_parts(Translation3::from(link.anchor - turn * link.anchor), turn)
            } else {
                Isometry3::from_parts(
                    Translation3::from(link.axis.into_inner() * moved),
                    UnitQuaternion::identity(),
                )
            };
        }
        let site = world * self.last_from_site;
        if let Some(jacobian) = jacobian {
            let tip = site.translation.vector;
            for (i, (anchor, axis, hinge)) in axes.iter().take(self.len()).enumerate() {
                let (linear, angular) = if *hinge {
                    (axis.cross(&(tip - anchor)), *axis)
                } else {
                    (*axis, Vector3::zeros())
                };
                for k in 0..3 {
                    jacobian[(k, i)] = linear[k];
                    jacobian[(k + 3, i)] = angular[k];
                }
            }
        }
        site
    }
}

/// Most joints of a chain: the size of its buffers.
pub const MAX_LINKS: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = r#"<mujoco><compiler angle="radian"/><worldbody>
      <body pos="0 0 0.5"><joint name="a" axis="0 0 1"/><geom size="0.1"/>
        <body pos="0.4 0 0"><joint name="b" axis="0 1 0" pos="0.01 0 0.02"/><geom size="0.1"/>
          <body pos="0.3 0 0" quat="0.9 0.1 0.2 0.3"><joint name="c" type="slide" axis="1 0 0"/><geom size="0.1"/>
            <site name="tip" pos="0.05 0 0"/></body></body></body></worldbody></mujoco>"#;

    #[test]
    fn a_planar_arm_reaches_where_trigonometry_says() {
        let scene = Scene::from_xml(
            "arm",
            r#"<mujoco><compiler angle="radian"/><worldbody><body><joint name="a" axis="0 0 1"/><geom size="0.1"/>
               <body pos="0.4 0 0"><joint name="b" axis="0 0 1"/><geom size="0.1"/><site name="tip" pos="0.3 0 0"/></body></body></worldbody></mujoco>"#,
            &[],
        )
        .unwrap();
        let chain = Chain::to_site(&scene, "tip").unwrap();
        let (a, b) = (0.7_f64, -0.4_f64);
        let tip = chain.forward(&[a, b], None).translation.vector;
        assert!((tip.x - (0.4 * a.cos() + 0.3 * (a + b).cos())).abs() < 1e-12);
        assert!((tip.y - (0.4 * a.sin() + 0.3 * (a + b).sin())).abs() < 1e-12);
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_pose() {
        let scene = Scene::from_xml("arm", ARM, &[]).unwrap();
        let chain = Chain::to_site(&scene, "tip").unwrap();
        assert_eq!(chain.joints(), ["a", "b", "c"]);
        let q = [0.3, -0.5, 0.1];
        let mut jacobian = DMatrix::zeros(6, 3);
        chain.forward(&q, Some(&mut jacobian));
        let h = 1e-6;
        for i in 0..3 {
            let (mut up, mut down) = (q, q);
            up[i] += h;
            down[i] -= h;
            let (up, down) = (chain.forward(&up, None), chain.forward(&down, None));
            let linear = (up.translation.vector - down.translation.vector) / (2.0 * h);
            let angular = (up.rotation * down.rotation.inverse()).scaled_axis() / (2.0 * h);
            for k in 0..3 {
                // The truncation error of central differences is about h^2 = 1e-12, rounding about
                // 1e-10.
                assert!((jacobian[(k, i)] - linear[k]).abs() < 1e-8);
                assert!((jacobian[(k + 3, i)] - angular[k]).abs() < 1e-8);
            }
        }
    }
}
