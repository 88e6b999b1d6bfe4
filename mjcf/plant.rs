//! The machine as its document describes it: its tree, its drives, and what can touch what.
//!
//! Effects are attached to a machine, not to an engine. What they need to know of it (the law of a
//! servo, the parent of a body, the friction that counts in a contact) is therefore read from the
//! document, once for all engines.

mod drive;
mod jacobian;
mod limits;
mod poses;
mod reading;
mod sensor;
mod values;

use asid_core::error::{Error, Result};
use asid_core::layout::{JointKind, Layout};

pub use drive::{Drive, DriveLaw, ForceLimit, law};

/// A body.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantBody {
    /// Index of its parent; the world is its own parent.
    pub parent: usize,
    /// Its joints, as indices in [`Layout::joints`].
    pub joints: std::ops::Range<usize>,
    /// Mass, kg; 0 for a body without mass.
    pub mass: f64,
    /// Centre of mass in its frame, m.
    pub center: [f64; 3],
    /// Topmost body that it is rigidly fixed to; 0 where it cannot move.
    pub weld: usize,
}

/// A joint of the document.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantJoint {
    /// Index of the body that it moves.
    pub body: usize,
    /// Anchor in the body's frame, m.
    pub anchor: [f64; 3],
    /// Axis in the body's frame, of length one.
    pub axis: [f64; 3],
    /// Coordinate at which the body has its declared pose.
    pub reference: f64,
    /// Range of a hinge or slide, rad or m; `None` where it is not limited.
    pub range: Option<[f64; 2]>,
    /// Viscous friction, N s/m or N m s/rad.
    pub damping: f64,
    /// Dry friction, N or N m.
    pub frictionloss: f64,
    /// Rotor inertia, kg or kg m².
    pub armature: f64,
}

/// A geom of the document.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantGeom {
    /// Index of its body.
    pub body: usize,
    /// Sliding, torsional (m) and rolling (m) friction.
    pub friction: [f64; 3],
    /// Dimensions of its contacts: 3 sliding, 4 also torsional, 6 also rolling.
    pub condim: u32,
    /// Priority: the friction of the geom with the higher one counts.
    pub priority: i32,
    /// Whether the body's mass comes from its geoms, so that this geom's mass can be changed.
    pub has_mass: bool,
    /// That mass, kg; 0 where the body's mass does not come from its geoms.
    pub mass: f64,
    /// Centre of that mass in the body's frame, m.
    pub center: [f64; 3],
}

/// What a sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reads {
    /// A joint, by index in [`Layout::joints`].
    Joint(usize),
    /// A body's frame, or that of its inertia where both coincide, by index in
    /// [`Layout::bodies`].
    Body(usize),
    /// Something else.
    Other,
}

/// A machine: the document's tree, its drives, and the geoms that can touch.
#[derive(Clone, Debug)]
pub struct Plant {
    /// Names and indices.
    pub layout: Layout,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Bodies, in the layout's order.
    pub bodies: Vec<PlantBody>,
    /// Joints, in the layout's order.
    pub joints: Vec<PlantJoint>,
    /// Geoms, in the layout's order.
    pub geoms: Vec<PlantGeom>,
    /// Drives of the actuators, in the layout's order; `None` for one that is not a plain drive.
    pub drives: Vec<Option<Drive>>,
    /// What each sensor reads, in the layout's order.
    pub sensors: Vec<Reads>,
    /// Pairs of geoms that can touch, each once, the smaller index first.
    pub contacts: Vec<[usize; 2]>,
    /// Limits of the drives' forces that the document does not have, by the index of the actuator.
    pub force_limits: Vec<(usize, ForceLimit)>,
    /// Pose of each body in its parent's frame, as declared.
    poses: Vec<nalgebra::Isometry3<f64>>,
}

impl Plant {
    /// Drives of a joint, with the indices of their actuators.
    pub fn drives_of(&self, joint: usize) -> impl Iterator<Item = (usize, &Drive)> {
        let drives = self.drives.iter().enumerate();
        drives.filter_map(move |(i, d)| d.as_ref().filter(|d| d.joint == joint).map(|d| (i, d)))
    }

    /// Indices of the hinges and slides.
    pub fn scalar_joints(&self) -> impl Iterator<Item = usize> {
        let joints = self.layout.joints.iter().enumerate();
        joints
            .filter(|(_, j)| matches!(j.kind, JointKind::Hinge | JointKind::Slide))
            .map(|(i, _)| i)
    }

    /// The free joint of a body, as an index in [`Layout::joints`].
    #[must_use]
    pub fn free_joint(&self, body: usize) -> Option<usize> {
        let joints = self.bodies[body].joints.clone();
        joints
            .into_iter()
            .find(|&j| self.layout.joints[j].kind == JointKind::Free)
    }

    /// Geoms that determine the mass of a body, as indices in [`Layout::geoms`].
    ///
    /// None where the document states the body's inertia, or the plant has no such body.
    pub fn geoms_with_mass(&self, body: &str) -> impl Iterator<Item = usize> {
        let body = self.layout.bodies.iter().position(|b| b == body);
        let geoms = self.geoms.iter().enumerate();
        geoms
            .filter(move |(_, g)| g.has_mass && body == Some(g.body))
            .map(|(i, _)| i)
    }

    /// Whether a body can move.
    #[must_use]
    pub fn moves(&self, body: usize) -> bool {
        self.bodies[body].weld != 0
    }

    /// The geom whose friction counts in a contact: by the higher priority, else the larger
    /// coefficient.
    #[must_use]
    pub fn dominant(&self, [a, b]: [usize; 2], entry: usize) -> usize {
        let (x, y) = (&self.geoms[a], &self.geoms[b]);
        match x.priority.cmp(&y.priority) {
            std::cmp::Ordering::Greater => a,
            std::cmp::Ordering::Less => b,
            std::cmp::Ordering::Equal if x.friction[entry] >= y.friction[entry] => a,
            std::cmp::Ordering::Equal => b,
        }
    }

    /// The actuator of this name: its index and its drive.
    ///
    /// # Errors
    /// When there is none, or it is not a plain drive of a joint.
    pub fn drive(&self, name: &str) -> Result<(usize, Drive)> {
        let i = self.layout.actuator(name)?;
        let drive = self.drives[i].ok_or_else(|| {
            Error::Failed(format!(
                "actuator `{name}` is no motor, position or velocity servo of a hinge or slide"
            ))
        })?;
        Ok((i, drive))
    }

    /// Index of the geom of this name.
    ///
    /// # Errors
    /// When there is none; the message lists near names.
    pub fn geom(&self, name: &str) -> Result<usize> {
        let names = &self.layout.geoms;
        names
            .iter()
            .position(|g| g == name)
            .ok_or_else(|| Error::unknown("geom", name, names.iter().map(String::as_str)))
    }

    /// Kind of a joint, by index.
    #[must_use]
    pub fn joint_kind(&self, joint: usize) -> JointKind {
        self.layout.joints[joint].kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::scene::Scene;

    const MACHINE: &str = r#"<mujoco><compiler angle="radian"/><worldbody>
      <geom name="floor" type="plane" size="1 1 1" friction="0.4 0.005 0.0001"/>
      <body name="a" pos="0 0 0.5"><joint name="turn" axis="0 0 1"/><geom name="a" size="0.1" mass="1"/>
        <body name="b" pos="0.4 0 0"><joint name="reach" type="slide" axis="1 0 0" frictionloss="2"/>
          <geom name="b" size="0.1" mass="2" pos="0.1 0 0"/></body></body>
      <body name="ball" pos="1 0 0.2"><freejoint name="fly"/><geom name="ball" size="0.1" friction="0.6 0 0"/></body>
      </worldbody>
      <actuator><motor name="m" joint="turn" gear="3" ctrlrange="-1 2"/>
        <position name="p" joint="reach" kp="20" kv="2" forcerange="-5 5"/></actuator>
      <sensor><jointpos name="angle" joint="turn"/><framepos name="at" objtype="xbody" objname="ball"/></sensor></mujoco>"#;

    fn plant() -> Plant {
        Plant::of(&Scene::from_xml("machine", MACHINE, &[]).unwrap()).unwrap()
    }

    #[test]
    fn drives_follow_their_laws() {
        let plant = plant();
        let (_, motor) = plant.drive("m").unwrap();
        assert_eq!(motor.force(5.0, 0.0, 0.0), 6.0);
        let (_, servo) = plant.drive("p").unwrap();
        assert!((servo.force(0.1, 0.02, 0.3) - (20.0 * 0.08 - 0.6)).abs() < 1e-12);
        assert_eq!(servo.force(10.0, 0.0, 0.0), 5.0);
        let command = servo.command_for(1.3, 0.02, 0.3).unwrap();
        assert!((servo.force(command, 0.02, 0.3) - 1.3).abs() < 1e-12);
    }

    #[test]
    fn a_body_touches_neither_its_parent_nor_itself() {
        let plant = plant();
        let name = |g: usize| plant.layout.geoms[g].clone();
        let pairs: Vec<_> = plant.contacts.iter().map(|p| p.map(name)).collect();
        let expected = [
            ["floor", "a"],
            ["floor", "b"],
            ["floor", "ball"],
            ["a", "ball"],
            ["b", "ball"],
        ];
        assert_eq!(pairs, expected.map(|p| p.map(String::from)));
        assert_eq!(plant.dominant([0, 3], 0), 3);
        assert_eq!(plant.dominant([0, 3], 1), 0);
    }

    #[test]
    fn sensors_know_what_they_read() {
        let plant = plant();
        assert_eq!(plant.sensors, [Reads::Joint(0), Reads::Body(3)]);
        assert_eq!(plant.bodies[2].mass, 2.0);
        assert_eq!(plant.bodies[2].center, [0.1, 0.0, 0.0]);
    }

    #[test]
    fn a_joint_has_its_range_where_the_document_limits_it() {
        let ranges = |compiler: &str, joints: &str| {
            let xml = format!(
                r#"<mujoco>{compiler}<default><default class="narrow"><joint range="-0.3 0.3"/></default></default>
                <worldbody><body><geom size="0.1" mass="1"/>{joints}</body></worldbody></mujoco>"#
            );
            let plant = Plant::of(&Scene::from_xml("machine", &xml, &[]).unwrap()).unwrap();
            plant.joints.iter().map(|j| j.range).collect::<Vec<_>>()
        };
        let radian = r#"<compiler angle="radian"/>"#;
        let of_class = r#"<joint class="narrow"/><joint class="narrow" limited="false"/><joint/>"#;
        assert_eq!(ranges(radian, of_class), [Some([-0.3, 0.3]), None, None]);
        // Angles are in degrees by default; lengths never are.
        let found = ranges(
            "",
            r#"<joint range="-90 45"/><joint type="slide" range="-2 1"/>"#,
        );
        let quarter = std::f64::consts::FRAC_PI_2;
        assert_eq!(found, [Some([-quarter, quarter / 2.0]), Some([-2.0, 1.0])]);
        let asked = r#"<compiler angle="radian" autolimits="false"/>"#;
        let joints = r#"<joint range="-1 1"/><joint range="-1 1" limited="true"/>"#;
        assert_eq!(ranges(asked, joints), [None, Some([-1.0, 1.0])]);
        let ball = r#"<joint type="ball" range="0 1" limited="true"/>"#;
        assert_eq!(ranges(radian, ball), [None]);
    }

    /// The Jacobian times a velocity is the finite difference of the point.
    #[test]
    fn the_point_jacobian_is_the_derivative_of_the_point() {
        let plant = plant();
        let nv = plant.layout.nv;
        let mut jacobian = vec![0.0; 6 * nv];
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.2, 0.9);
        let qpos = vec![0.4, 0.1, 1.0, 2.0, 3.0, turn.w, turn.i, turn.j, turn.k];
        let at = [0.05, -0.02, 0.1];
        for body in [2, 3] {
            let pose = plant.point_jacobian(&qpos, body, at, &mut jacobian);
            let tip = pose * nalgebra::Point3::from(at);
            let h = 1e-6;
            for dof in 0..nv {
                let mut moved = qpos.clone();
                match dof {
                    0..5 => moved[dof] += h,
                    _ => {
                        let axis = nalgebra::Vector3::ith(dof - 5, h);
                        let q = turn * nalgebra::UnitQuaternion::from_scaled_axis(axis);
                        moved[5..9].copy_from_slice(&[q.w, q.i, q.j, q.k]);
                    }
                }
                let other = plant.point_jacobian(&moved, body, at, &mut vec![0.0; 6 * nv]);
                let d = (other * nalgebra::Point3::from(at) - tip) / h;
                for k in 0..3 {
                    assert!(
                        (d[k] - jacobian[k * nv + dof]).abs() < 1e-5,
                        "{body} {dof} {k}"
                    );
                }
            }
        }
    }
}
