//! The parts of a machine, read from its model: the places at which a cause can act.

mod parts;

pub use parts::{Drive, DriveKind, Joint, JointKind, Reads, Sensor};

use mujoco_rs::wrappers::mj_model::MjtObjBase;

use crate::document::Element;
use crate::engine;
use crate::error::{Error, Result};
use crate::machine::{Machine, Shows};
use parts::{drive, joint_kind, reads};

/// A machine and the parts of its model.
#[derive(Clone, Debug)]
pub struct Anatomy {
    /// The machine.
    pub machine: Machine,
    /// Its model.
    pub document: Element,
    /// Joints, in the model's order.
    pub joints: Vec<Joint>,
    /// Actuators, in the model's order.
    pub drives: Vec<Drive>,
    /// Sensors, in the model's order.
    pub sensors: Vec<Sensor>,
    /// Bodies, in the model's order; the first is the world.
    pub bodies: Vec<String>,
    /// Geoms, in the model's order.
    pub geoms: Vec<String>,
    /// Reference position `qpos0`.
    pub qpos0: Vec<f64>,
    /// Number of degrees of freedom.
    pub nv: usize,
    /// Time step of the study's model, s.
    pub timestep: f64,
}

impl Anatomy {
    /// Reads the parts of a machine from its model.
    ///
    /// # Errors
    /// If MuJoCo refuses the model, or if the model lacks an element that the machine names.
    pub fn of(machine: &Machine) -> Result<Self> {
        let refused = |message: String| Error::Model {
            machine: machine.name.to_owned(),
            message,
        };
        let document = Element::parse(machine.model).map_err(refused)?;
        let model = engine::compile(machine.model).map_err(refused)?;
        let missing = |element: &str, name: &str| Error::Element {
            machine: machine.name.to_owned(),
            element: element.to_owned(),
            name: name.to_owned(),
        };
        let find = |kind, element: &str, name: &str| {
            engine::index(&model, kind, name).ok_or_else(|| missing(element, name))
        };
        let mut found: Vec<(&Element, &str)> = Vec::new();
        document.walk(&mut |e, body| found.push((e, body)));
        let world = found.iter().position(|(e, _)| e.tag == "worldbody");
        let world = &found[world.unwrap_or(0)..];
        let mut joints = Vec::new();
        let bodies = engine::names(&model, MjtObjBase::mjOBJ_BODY, model.nbody());
        let geoms = engine::names(&model, MjtObjBase::mjOBJ_GEOM, model.ngeom());
        for (e, body) in world {
            let name = e.get("name").unwrap_or_default().to_owned();
            match e.tag.as_str() {
                tag if e.get("name").is_some() => {
                    let Some(kind) = joint_kind(tag, e) else {
                        continue;
                    };
                    // References to joints, further down in the document, have the same tag but no
                    // name.
                    let id = find(MjtObjBase::mjOBJ_JOINT, "joint", &name)?;
                    joints.push(Joint {
                        kind,
                        body: (*body).to_owned(),
                        qpos: model.jnt_qposadr()[id] as usize,
                        dof: model.jnt_dofadr()[id] as usize,
                        armature: e.number("armature").unwrap_or(0.0),
                        damping: e.number("damping").unwrap_or(0.0),
                        name,
                    });
                }
                _ => {}
            }
        }
        let section = |tag: &str| document.find(tag, None).map_or(&[][..], |s| &s.children);
        let drives = section("actuator").iter().map(|e| drive(e, &joints));
        let drives = drives.collect::<Vec<_>>();
        let mut sensors = Vec::new();
        for e in section("sensor") {
            let name = e.get("name").unwrap_or_default();
            let id = find(MjtObjBase::mjOBJ_SENSOR, "sensor", name)?;
            let noise = machine.noise.iter().find(|(n, _)| *n == name);
            let noise = noise.ok_or_else(|| missing("noise of the sensor", name))?.1;
            sensors.push(Sensor {
                name: name.to_owned(),
                kind: e.tag.clone(),
                reads: reads(&model, id, &joints),
                address: model.sensor_adr()[id] as usize,
                len: model.sensor_dim()[id] as usize,
                // A rotation by a small angle changes a quaternion by half of that angle.
                noise: if e.tag == "framequat" {
                    noise / 2.0
                } else {
                    noise
                },
            });
        }
        for command in machine.commands {
            if !drives.iter().any(|d| d.name == command.actuator) {
                return Err(missing("actuator", command.actuator));
            }
        }
        let anatomy = Self {
            machine: *machine,
            joints,
            drives,
            sensors,
            bodies,
            geoms,
            qpos0: model.qpos0().to_vec(),
            nv: model.nv() as usize,
            timestep: model.opt().timestep,
            document: document.clone(),
        };
        for start in machine.starts {
            anatomy.joint(start.joint)?;
        }
        for contact in machine.contacts {
            for geom in contact.movers.iter().chain([&contact.site]) {
                anatomy.geom(geom)?;
            }
        }
        Ok(anatomy)
    }

    fn place<T>(
        &self,
        all: &[T],
        element: &str,
        name: &str,
        is: impl Fn(&T) -> bool,
    ) -> Result<usize> {
        all.iter().position(is).ok_or_else(|| Error::Element {
            machine: self.machine.name.to_owned(),
            element: element.to_owned(),
            name: name.to_owned(),
        })
    }

    /// Index of a joint.
    ///
    /// # Errors
    /// If there is no joint of that name.
    pub fn joint(&self, name: &str) -> Result<usize> {
        self.place(&self.joints, "joint", name, |j| j.name == name)
    }

    /// Index of an actuator.
    ///
    /// # Errors
    /// If there is no actuator of that name.
    pub fn drive(&self, name: &str) -> Result<usize> {
        self.place(&self.drives, "actuator", name, |d| d.name == name)
    }

    /// Index of a sensor.
    ///
    /// # Errors
    /// If there is no sensor of that name.
    pub fn sensor(&self, name: &str) -> Result<usize> {
        self.place(&self.sensors, "sensor", name, |s| s.name == name)
    }

    /// Index of a body.
    ///
    /// # Errors
    /// If there is no body of that name.
    pub fn body(&self, name: &str) -> Result<usize> {
        self.place(&self.bodies, "body", name, |b| b == name)
    }

    /// Index of a geom.
    ///
    /// # Errors
    /// If there is no geom of that name.
    pub fn geom(&self, name: &str) -> Result<usize> {
        self.place(&self.geoms, "geom", name, |g| g == name)
    }

    /// The drive of a joint, if exactly one drive acts on it.
    #[must_use]
    pub fn drive_of(&self, joint: usize) -> Option<usize> {
        let mut all = (0..self.drives.len()).filter(|&d| self.drives[d].joint == Some(joint));
        let first = all.next()?;
        all.next().is_none().then_some(first)
    }

    /// Sites of the contacts for which `shows` is true.
    #[must_use]
    pub fn contact_sites(&self, shows: impl Fn(&Shows) -> bool) -> Vec<String> {
        let contacts = self.machine.contacts.iter();
        contacts
            .filter(|c| shows(&c.shows))
            .map(|c| c.site.to_owned())
            .collect()
    }

    /// Geoms of a contact: the site, then the geoms that touch it.
    #[must_use]
    pub fn touching(&self, site: &str) -> Vec<&'static str> {
        let mut contacts = self.machine.contacts.iter();
        let contact = contacts.find(|c| c.site == site);
        contact.map_or_else(Vec::new, |c| [&[c.site], c.movers].concat())
    }

    /// Indices of the geoms of a contact.
    #[must_use]
    pub fn touching_indices(&self, site: &str) -> Vec<usize> {
        let all = self.touching(site);
        all.iter().filter_map(|g| self.geom(g).ok()).collect()
    }

    /// The body on which a contact's friction acts: the first free body, or else the first body
    /// named like a touching geom.
    #[must_use]
    pub fn mover(&self, site: &str) -> usize {
        let movers = self.touching(site);
        let own = movers.iter().skip(1).find_map(|g| self.body(g).ok());
        let mut joints = self.joints.iter();
        let free = joints.find(|j| j.kind == JointKind::Free);
        free.and_then(|j| self.body(&j.body).ok())
            .or(own)
            .unwrap_or(0)
    }

    /// Whether the machine can move for any length of time: it has no free body and no contacts.
    #[must_use]
    pub fn is_tireless(&self) -> bool {
        let free = self.joints.iter().any(|j| j.kind == JointKind::Free);
        !free && self.machine.contacts.is_empty()
    }

    /// Whether the machine is one free body without drives and without contacts. Both engines move
    /// such a body alike.
    #[must_use]
    pub fn is_free_flight(&self) -> bool {
        let free = self.joints.len() == 1 && self.joints[0].kind == JointKind::Free;
        free && self.bodies.len() == 2 && self.drives.is_empty() && self.machine.contacts.is_empty()
    }

    /// Number of values in a row of readings.
    #[must_use]
    pub fn width(&self) -> usize {
        self.sensors.iter().map(|s| s.len).sum()
    }
}
