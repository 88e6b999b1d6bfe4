//! The machine as its document describes it: what moves what, and what can touch what.
//!
//! Effects are attached to a machine and not to an engine, so what they need to
//! know of it (the law of a servo, the parent of a body, the friction that wins in
//! a contact) is read from the document, once, for all engines.

use mjcf_rs::Model as Document;
use mjcf_rs::extras::ActuatorKind;

use crate::document;
use crate::error::{Error, Result};
use crate::layout::{JointKind, Layout};
use crate::mass::{GeomMass, MassProperties};
use crate::scene::Scene;

/// How an actuator turns its command into a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveLaw {
    /// The command is the force.
    Motor,
    /// A position servo: `kp (command - position) - kv speed`.
    Position {
        /// Position gain, N/m or N m/rad.
        kp: f64,
        /// Damping, N s/m or N m s/rad.
        kv: f64,
    },
    /// A velocity servo: `kv (command - speed)`.
    Velocity {
        /// Gain, N s/m or N m s/rad.
        kv: f64,
    },
}

/// An actuator on a hinge or slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Index in [`Layout::joints`].
    pub joint: usize,
    /// Its law, before the gear.
    pub law: DriveLaw,
    /// Ratio of the joint's force to the actuator's.
    pub gear: f64,
    /// Limits of the command.
    pub ctrl_range: Option<[f64; 2]>,
    /// Limits of the force, before the gear.
    pub force_range: Option<[f64; 2]>,
}

impl Drive {
    /// Force on the joint (N or N m) for a command, at a position and speed of the joint.
    #[must_use]
    pub fn force(&self, command: f64, position: f64, speed: f64) -> f64 {
        let clamp = |x: f64, range: Option<[f64; 2]>| range.map_or(x, |[a, b]| x.clamp(a, b));
        let command = clamp(command, self.ctrl_range);
        let (q, v) = (self.gear * position, self.gear * speed);
        let force = match self.law {
            DriveLaw::Motor => command,
            DriveLaw::Position { kp, kv } => kp * (command - q) - kv * v,
            DriveLaw::Velocity { kv } => kv * (command - v),
        };
        self.gear * clamp(force, self.force_range)
    }

    /// The command that makes the drive ask for a force on the joint (N or N m), before
    /// any limit; `None` where no command can.
    #[must_use]
    pub fn command_for(&self, force: f64, position: f64, speed: f64) -> Option<f64> {
        let (q, v) = (self.gear * position, self.gear * speed);
        let force = force / self.gear;
        let command = match self.law {
            DriveLaw::Motor => force,
            DriveLaw::Position { kp, kv } => q + (force + kv * v) / kp,
            DriveLaw::Velocity { kv } => v + force / kv,
        };
        command.is_finite().then_some(command)
    }

    /// Whether its command is a position, which it pursues.
    #[must_use]
    pub fn is_position_servo(&self) -> bool {
        matches!(self.law, DriveLaw::Position { .. })
    }
}

/// A body.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantBody {
    /// Index of its parent; the world is its own.
    pub parent: usize,
    /// Its joints, as indices in [`Layout::joints`].
    pub joints: std::ops::Range<usize>,
    /// Mass, kg; 0 where it has none of its own.
    pub mass: f64,
    /// Centre of mass in its frame, m.
    pub center: [f64; 3],
    /// Topmost body that it is rigidly joined to; 0 where it cannot move.
    pub weld: usize,
}

/// A joint of the document.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantJoint {
    /// Index of the body that it moves.
    pub body: usize,
    /// Anchor in the body's frame, m.
    pub anchor: [f64; 3],
    /// Axis in the body's frame.
    pub axis: [f64; 3],
    /// Coordinate at which the body is as declared.
    pub reference: f64,
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
    /// Whose friction counts.
    pub priority: i32,
    /// Whether its mass is its own, to be changed.
    pub has_mass: bool,
}

/// What a sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reads {
    /// A joint, by index in [`Layout::joints`].
    Joint(usize),
    /// A body's frame, by index in [`Layout::bodies`].
    Body(usize),
    /// Something else.
    Other,
}

/// A machine: the document's tree, its drives, and who can touch whom.
#[derive(Clone, Debug)]
pub struct Plant {
    /// Names and places.
    pub layout: Layout,
    /// Gravity, m/s².
    pub gravity: [f64; 3],
    /// Bodies, in the layout's order.
    pub bodies: Vec<PlantBody>,
    /// Joints, in the layout's order.
    pub joints: Vec<PlantJoint>,
    /// Geoms, in the layout's order.
    pub geoms: Vec<PlantGeom>,
    /// Actuators, in the layout's order; `None` for one that is no plain drive of a joint.
    pub drives: Vec<Option<Drive>>,
    /// Sensors, in the layout's order.
    pub sensors: Vec<Reads>,
    /// Pairs of geoms that can touch, each once, the smaller index first.
    pub contacts: Vec<[usize; 2]>,
    /// Pose of each body in its parent's frame, as declared.
    poses: Vec<nalgebra::Isometry3<f64>>,
}

impl Plant {
    /// Reads a scene.
    ///
    /// # Errors
    /// When the document is not valid MJCF.
    pub fn of(scene: &Scene) -> Result<Self> {
        let model = scene.description()?;
        let layout = document::layout(scene, &model)?;
        let mut bodies = Vec::with_capacity(model.bodies.len());
        let (mut joints, mut geoms) = (Vec::new(), Vec::new());
        for (i, entry) in model.bodies.iter().enumerate() {
            let body = &entry.body;
            let first = joints.len();
            joints.extend(body.joints.iter().map(|j| PlantJoint {
                body: i,
                anchor: j.pos,
                axis: j.axis,
                reference: j.ref_,
                frictionloss: j.frictionloss,
                armature: j.armature,
            }));
            geoms.extend(body.geoms.iter().map(|g| PlantGeom {
                body: i,
                friction: g.friction,
                condim: g.condim,
                priority: g.priority,
                has_mass: i > 0 && body.inertial.is_none() && GeomMass::of(g).is_some(),
            }));
            let (mass, center) = match &body.inertial {
                Some(inertial) => {
                    let p = inertial.pose.translation;
                    (inertial.mass, [p.x, p.y, p.z])
                }
                None => {
                    let masses: Vec<_> = body.geoms.iter().filter_map(GeomMass::of).collect();
                    let all = MassProperties::of_geoms(&masses);
                    (all.mass, all.center.into())
                }
            };
            let parent = entry.parent.unwrap_or(0);
            let weld = match entry.parent {
                Some(p) if body.joints.is_empty() => {
                    bodies.get(p).map_or(0, |b: &PlantBody| b.weld)
                }
                _ => i,
            };
            bodies.push(PlantBody {
                parent,
                joints: first..joints.len(),
                mass: if i == 0 { 0.0 } else { mass },
                center,
                weld,
            });
        }
        let drives = model
            .actuators
            .iter()
            .zip(&layout.actuators)
            .map(|(a, place)| drive(&model, &layout, a, place.ctrl_range))
            .collect();
        let sensors = model
            .sensors
            .iter()
            .map(|s| {
                let name = s.objname.as_deref().unwrap_or_default();
                let joint = layout.joints.iter().position(|j| j.name == name);
                let body = layout.bodies.iter().position(|b| b == name);
                match (s.kind.as_str(), joint, body) {
                    (kind, Some(j), _) if kind.starts_with("joint") => Reads::Joint(j),
                    (kind, _, Some(b)) if kind.starts_with("frame") => Reads::Body(b),
                    _ => Reads::Other,
                }
            })
            .collect();
        let contacts = contacts(&model, &layout, &bodies, &geoms);
        let poses = model
            .bodies
            .iter()
            .map(|entry| {
                let (t, q) = (entry.body.pose.translation, entry.body.pose.rotation);
                nalgebra::Isometry3::from_parts(
                    nalgebra::Translation3::new(t.x, t.y, t.z),
                    nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
                        q.w, q.x, q.y, q.z,
                    )),
                )
            })
            .collect();
        Ok(Self {
            layout,
            gravity: model.option.gravity,
            bodies,
            joints,
            geoms,
            drives,
            sensors,
            contacts,
            poses,
        })
    }

    /// Drives of a joint, as indices of actuators.
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

    /// Whether a body can move.
    #[must_use]
    pub fn moves(&self, body: usize) -> bool {
        self.bodies[body].weld != 0
    }

    /// Geom whose friction counts in a contact of two: the higher priority, else the larger.
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

    /// Pose `world_from_body` and Jacobian (`6 x nv`, row-major: linear then angular
    /// velocity of the body's point `at` per unit of each entry of `qvel`) in a state.
    /// `jacobian` is overwritten; it has `6 nv` entries.
    pub fn point_jacobian(
        &self,
        qpos: &[f64],
        body: usize,
        at: [f64; 3],
        jacobian: &mut [f64],
    ) -> nalgebra::Isometry3<f64> {
        use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
        let nv = self.layout.nv;
        jacobian.fill(0.0);
        let mut path = [0_usize; MAX_DEPTH];
        let mut depth = 0;
        let mut up = body;
        while up != 0 && depth < MAX_DEPTH {
            path[depth] = up;
            depth += 1;
            up = self.bodies[up].parent;
        }
        // Two passes: the pose of the point first, then the columns that need it.
        let mut tip = Vector3::zeros();
        let mut world = Isometry3::identity();
        for pass in 0..2 {
            world = Isometry3::identity();
            for &b in path[..depth].iter().rev() {
                world *= self.poses[b];
                for j in self.bodies[b].joints.clone() {
                    let (place, joint) = (&self.layout.joints[j], &self.joints[j]);
                    let q = &qpos[place.qpos..];
                    let mut set = |row: usize, column: usize, v: Vector3<f64>| {
                        for k in 0..3 {
                            jacobian[(row + k) * nv + column] = v[k];
                        }
                    };
                    match place.kind {
                        JointKind::Free => {
                            let turn = crate::signal::unit_quaternion(&q[3..7]);
                            world =
                                Isometry3::from_parts(Translation3::new(q[0], q[1], q[2]), turn);
                            if pass == 1 {
                                let arm = tip - world.translation.vector;
                                for k in 0..3 {
                                    let unit = Vector3::ith(k, 1.0);
                                    set(0, place.qvel + k, unit);
                                    let axis = turn * unit;
                                    set(0, place.qvel + 3 + k, axis.cross(&arm));
                                    set(3, place.qvel + 3 + k, axis);
                                }
                            }
                        }
                        JointKind::Ball => {
                            let anchor = Vector3::from(joint.anchor);
                            let turn = crate::signal::unit_quaternion(&q[..4]);
                            let pivot = world * Point3::from(anchor);
                            world *= Isometry3::from_parts(
                                Translation3::from(anchor - turn * anchor),
                                turn,
                            );
                            if pass == 1 {
                                let arm = tip - pivot.coords;
                                for k in 0..3 {
                                    let axis = world.rotation * Vector3::ith(k, 1.0);
                                    set(0, place.qvel + k, axis.cross(&arm));
                                    set(3, place.qvel + k, axis);
                                }
                            }
                        }
                        JointKind::Hinge | JointKind::Slide => {
                            let moved = q[0] - joint.reference;
                            let own = Unit::new_normalize(Vector3::from(joint.axis));
                            let axis = world.rotation * own.into_inner();
                            let anchor = Vector3::from(joint.anchor);
                            let pivot = world * Point3::from(anchor);
                            if place.kind == JointKind::Hinge {
                                let turn = UnitQuaternion::from_axis_angle(&own, moved);
                                world *= Isometry3::from_parts(
                                    Translation3::from(anchor - turn * anchor),
                                    turn,
                                );
                                if pass == 1 {
                                    set(0, place.qvel, axis.cross(&(tip - pivot.coords)));
                                    set(3, place.qvel, axis);
                                }
                            } else {
                                world *= Translation3::from(own.into_inner() * moved);
                                if pass == 1 {
                                    set(0, place.qvel, axis);
                                }
                            }
                        }
                    }
                }
            }
            tip = (world * Point3::from(Vector3::from(at))).coords;
        }
        world
    }
}

/// Deepest chain of bodies.
const MAX_DEPTH: usize = 64;

fn drive(
    model: &Document,
    layout: &Layout,
    actuator: &mjcf_rs::extras::Actuator,
    ctrl_range: Option<[f64; 2]>,
) -> Option<Drive> {
    let name = actuator.joint.as_deref()?;
    let joint = layout.joints.iter().position(|j| j.name == name)?;
    if !matches!(
        layout.joints[joint].kind,
        JointKind::Hinge | JointKind::Slide
    ) {
        return None;
    }
    let law = match actuator.kind {
        ActuatorKind::Motor => DriveLaw::Motor,
        ActuatorKind::Position => DriveLaw::Position {
            kp: actuator.kp.unwrap_or(1.0),
            kv: actuator.kv.unwrap_or(0.0),
        },
        ActuatorKind::Velocity => DriveLaw::Velocity {
            kv: actuator.kv.unwrap_or(1.0),
        },
        _ => return None,
    };
    let limited = actuator
        .force_limited
        .resolve(model.compiler.autolimits, actuator.force_range.is_some());
    Some(Drive {
        joint,
        law,
        gear: actuator.gear[0],
        ctrl_range,
        force_range: actuator.force_range.filter(|_| limited),
    })
}

/// MuJoCo's rules: contact bits in either direction, no contact between a body and what it
/// is welded to or its parent (unless that is fixed), excluded and explicit pairs.
fn contacts(
    model: &Document,
    layout: &Layout,
    bodies: &[PlantBody],
    geoms: &[PlantGeom],
) -> Vec<[usize; 2]> {
    let all: Vec<_> = model.bodies.iter().flat_map(|b| &b.body.geoms).collect();
    let body = |name: &str| layout.bodies.iter().position(|b| b == name);
    let excluded: Vec<_> = model
        .contact
        .excludes
        .iter()
        .map(|e| (body(&e.body1), body(&e.body2)))
        .collect();
    let explicit: Vec<_> = model
        .contact
        .pairs
        .iter()
        .map(|p| {
            let find = |name: &str| layout.geoms.iter().position(|g| g == name);
            (find(&p.geom1), find(&p.geom2))
        })
        .collect();
    let mut found = Vec::new();
    for a in 0..geoms.len() {
        for b in a + 1..geoms.len() {
            let (p, q) = (geoms[a].body, geoms[b].body);
            let (u, v) = (bodies[p].weld, bodies[q].weld);
            let above = |w: usize| bodies[bodies[w].parent].weld;
            let family = (u != 0 && v != 0) && (u == above(v) || v == above(u));
            let bits = all[a].contype & all[b].conaffinity != 0
                || all[b].contype & all[a].conaffinity != 0;
            let among = |pairs: &[(Option<usize>, Option<usize>)], x: usize, y: usize| {
                pairs.contains(&(Some(x), Some(y))) || pairs.contains(&(Some(y), Some(x)))
            };
            let meets = bits && u != v && !family && !among(&excluded, p, q);
            if meets || among(&explicit, a, b) {
                found.push([a, b]);
            }
        }
    }
    found
}

impl Plant {
    /// Index of the actuator of this name with its drive.
    ///
    /// # Errors
    /// When there is none, or it is no plain drive of a joint.
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
