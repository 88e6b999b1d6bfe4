//! Poses of all bodies in a state: forward kinematics of the whole tree.
//!
//! It serves pictures, and everything else that must not depend on an engine.

use asid_core::layout::JointKind;
use asid_core::signal::unit_quaternion;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::Plant;

impl Plant {
    /// Pose of each body, `world_from_body`, in the layout's order, in a state `qpos` (`nq`).
    #[must_use]
    pub fn poses(&self, qpos: &[f64]) -> Vec<Isometry3<f64>> {
        let mut all: Vec<Isometry3<f64>> = Vec::with_capacity(self.bodies.len());
        for (b, body) in self.bodies.iter().enumerate() {
            // A parent comes before its children.
            let parent = all.get(body.parent).copied();
            let mut world = parent.unwrap_or_else(Isometry3::identity) * self.poses[b];
            for j in body.joints.clone() {
                world = self.moved(world, j, &qpos[self.layout.joints[j].qpos..]);
            }
            all.push(world);
        }
        all
    }

    /// The pose of a body after one of its joints; `q` begins with the joint's coordinates.
    fn moved(&self, world: Isometry3<f64>, joint: usize, q: &[f64]) -> Isometry3<f64> {
        let own = &self.joints[joint];
        let anchor = Vector3::from(own.anchor);
        let about = |turn: UnitQuaternion<f64>| {
            world * Isometry3::from_parts(Translation3::from(anchor - turn * anchor), turn)
        };
        let axis = || Unit::new_normalize(Vector3::from(own.axis));
        match self.layout.joints[joint].kind {
            JointKind::Free => {
                let place = Point3::new(q[0], q[1], q[2]);
                Isometry3::from_parts(Translation3::from(place), unit_quaternion(&q[3..7]))
            }
            JointKind::Ball => about(unit_quaternion(&q[..4])),
            JointKind::Hinge => about(UnitQuaternion::from_axis_angle(
                &axis(),
                q[0] - own.reference,
            )),
            JointKind::Slide => {
                world * Translation3::from(axis().into_inner() * (q[0] - own.reference))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use asid_core::scene::Scene;

    use super::*;

    /// Equals the chain of the Jacobian, which a finite difference checks.
    #[test]
    fn all_bodies_are_where_their_chains_end() {
        let xml = r#"<mujoco><compiler angle="radian"/><worldbody>
          <body pos="0 0 0.5"><joint axis="0 0 1"/><geom size="0.1"/>
            <body pos="0.4 0 0" quat="0.9 0.1 0.2 0.3"><joint type="slide" axis="1 0 0"/><joint axis="0 1 0" pos="0.1 0 0" ref="0.2"/>
              <geom size="0.1"/><body pos="0 0.1 0"><joint type="ball" pos="0 0 0.1"/><geom size="0.1"/></body></body></body>
          <body pos="1 0 0.2"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("tree", xml, &[]).unwrap()).unwrap();
        let turn = UnitQuaternion::from_euler_angles(0.3, -0.2, 0.9);
        let q = [turn.w, turn.i, turn.j, turn.k];
        let qpos = [&[0.4, 0.1, 0.7][..], &q, &[1.0, 2.0, 3.0], &q].concat();
        let poses = plant.poses(&qpos);
        let mut jacobian = vec![0.0; 6 * plant.layout.nv];
        for (body, pose) in poses.iter().enumerate() {
            let chain = plant.point_jacobian(&qpos, body, [0.0; 3], &mut jacobian);
            assert!((pose.inverse() * chain).translation.vector.norm() < 1e-12);
            assert!(pose.rotation.angle_to(&chain.rotation) < 1e-7, "{body}");
        }
    }

    /// Symptom: the end of a chain of 80 links was where its last 64 links alone would end.
    ///
    /// Cause: the path to a body had 64 places.
    #[test]
    fn the_end_of_a_long_chain_is_where_all_its_links_place_it() {
        let links = 80;
        let open = r#"<body pos="0.1 0 0"><joint axis="0 1 0"/><geom size="0.01"/>"#.repeat(links);
        let close = "</body>".repeat(links);
        let xml = format!("<mujoco><worldbody>{open}{close}</worldbody></mujoco>");
        let plant = Plant::of(&Scene::from_xml("chain", &xml, &[]).unwrap()).unwrap();
        let qpos = vec![0.01; links];
        let mut jacobian = vec![0.0; 6 * links];
        let chain = plant.point_jacobian(&qpos, links, [0.0; 3], &mut jacobian);
        let end = plant.poses(&qpos)[links];
        assert!((end.translation.vector - chain.translation.vector).norm() < 1e-9);
        // The first hinge turns the end about the y axis through its own place.
        let arm = end.translation.vector - Vector3::new(0.1, 0.0, 0.0);
        assert!((jacobian[0] - arm.z).abs() < 1e-9);
        assert!((jacobian[2 * links] + arm.x).abs() < 1e-9);
    }
}
