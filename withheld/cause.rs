//! What a cause is: a physical effect that the study's model lacks, with a site and a size.

use crate::anatomy::{Anatomy, Drive, DriveKind, Joint, JointKind};
use crate::simulate::Typical;
use crate::world::{ReadingPath, World};

/// Relation of a cause to the catalogue of effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// An effect of the catalogue.
    Catalogue,
    /// An effect with an agreed name that a diagnosis may not have in its catalogue yet.
    Agreed,
    /// An effect of no catalogue; its name begins with `unknown:`.
    Unknown,
}

/// True values of an effect's parameters, by the catalogue's names.
pub type Values = Vec<(&'static str, f64)>;

/// A cause. Each has a file of its own.
pub trait Cause: Sync {
    /// Name of the effect, or `unknown:` and a name.
    fn name(&self) -> &'static str;
    /// Relation to the catalogue of effects.
    fn standing(&self) -> Standing {
        if self.name().starts_with("unknown:") {
            Standing::Unknown
        } else {
            Standing::Catalogue
        }
    }
    /// Elements of a machine on which it can act; an empty name stands for the whole machine.
    fn sites(&self, machine: &Anatomy) -> Vec<String>;
    /// Largest size that the generator tries, in the unit of the cause's main parameter. At size 0
    /// the cause is off.
    fn largest(&self, place: &Place<'_>) -> f64;
    /// Adds the cause to a world; returns the true values of its parameters.
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values;
}

/// The site of a cause, and the random numbers that are drawn once for it.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The machine.
    pub machine: &'a Anatomy,
    /// Typical motion and forces of the machine without the cause.
    pub typical: &'a Typical,
    /// Name of the element.
    pub site: &'a str,
    /// Uniform numbers in 0 to 1 for everything but the size: signs, angles, positions.
    pub draw: [f64; 4],
}

impl<'a> Place<'a> {
    /// Sign of a draw: 1 or -1.
    #[must_use]
    pub fn sign(&self, which: usize) -> f64 {
        if self.draw[which] < 0.5 { -1.0 } else { 1.0 }
    }

    /// A number between `low` and `high`, from a draw.
    #[must_use]
    pub fn between(&self, which: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.draw[which]
    }

    /// Factor of a multiplied quantity: `1 + size` or its inverse, by the first sign.
    #[must_use]
    pub fn factor(&self, size: f64) -> f64 {
        if self.sign(0) > 0.0 {
            1.0 + size
        } else {
            1.0 / (1.0 + size)
        }
    }

    /// Multiplies one value of an attribute of all geoms of the site's contact.
    pub fn scale_contact(
        &self,
        size: f64,
        attribute: &str,
        index: usize,
        world: &mut World,
    ) -> Values {
        let factor = self.factor(size);
        for geom in self.machine.touching(self.site) {
            world.edit_geom(geom, attribute, index, |old| factor * old);
        }
        vec![("factor", factor)]
    }

    /// Multiplies a gain of the site's actuator.
    pub fn scale_gain(&self, size: f64, gain: &str, world: &mut World) -> Values {
        let factor = self.factor(size);
        if let Some(e) = world.document.find_in_mut("actuator", self.site) {
            let old = e.number(gain).unwrap_or(0.0);
            e.set_numbers(gain, &[factor * old]);
        }
        vec![("factor", factor)]
    }

    /// Distorts each column of the site's sensor. Returns the values of the parameters.
    ///
    /// A scalar gets a drawn sign, and its parameter is called `name`. A vector is distorted along
    /// a drawn direction, and its parameters are called by its axes.
    pub fn along_columns(
        &self,
        size: f64,
        name: &'static str,
        world: &mut World,
        path: impl Fn(f64) -> Box<dyn ReadingPath>,
    ) -> Values {
        let alone = [name];
        let names: &[&'static str] = if self.columns().len() == 1 {
            &alone
        } else {
            &["x", "y", "z"]
        };
        let mut values = Vec::new();
        for ((column, name), share) in self.columns().zip(names).zip(self.direction()) {
            let value = if names.len() == 1 {
                self.sign(0) * size
            } else {
                share * size
            };
            world.readings.push((column, path(value)));
            values.push((*name, value));
        }
        values
    }

    /// Index of the joint that is the site, or that the site's actuator drives.
    #[must_use]
    pub fn joint_index(&self) -> usize {
        let machine = self.machine;
        machine
            .joint(self.site)
            .ok()
            .or_else(|| machine.drives[machine.drive(self.site).ok()?].joint)
            .unwrap_or(0)
    }

    /// The joint that is the site, or that the site's actuator drives.
    #[must_use]
    pub fn joint(&self) -> &'a Joint {
        &self.machine.joints[self.joint_index()]
    }

    /// Index of the actuator that is the site, or that drives the site's joint.
    #[must_use]
    pub fn drive_index(&self) -> usize {
        let machine = self.machine;
        let at = machine.drive(self.site).ok();
        at.or_else(|| machine.drive_of(self.joint_index()))
            .unwrap_or(0)
    }

    /// The actuator that is the site, or that drives the site's joint.
    #[must_use]
    pub fn drive(&self) -> &'a Drive {
        &self.machine.drives[self.drive_index()]
    }

    /// Columns of the site's sensor in a row of readings.
    #[must_use]
    pub fn columns(&self) -> std::ops::Range<usize> {
        let sensor = self.machine.sensor(self.site);
        let sensor = &self.machine.sensors[sensor.unwrap_or(0)];
        sensor.address..sensor.address + sensor.len
    }

    /// Typical speed of the joint, rad/s or m/s; at least a hundredth.
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.typical.speed[self.joint().dof].max(0.01)
    }

    /// Typical force at the joint, N m or N: that of its drives, or its weight.
    #[must_use]
    pub fn force(&self) -> f64 {
        let dof = self.joint().dof;
        self.typical.drive[dof]
            .max(self.typical.weight[dof])
            .max(1e-3)
    }

    /// Standard deviation of the actuator's command.
    #[must_use]
    pub fn command(&self) -> f64 {
        self.typical.command[self.drive_index()].max(1e-6)
    }

    /// Standard deviation of the sensor's reading: the largest of its columns.
    #[must_use]
    pub fn spread(&self) -> f64 {
        let all = self.columns().map(|c| self.typical.spread[c]);
        all.fold(0.0, f64::max).max(1e-6)
    }

    /// Standard deviation of the joint's position, rad or m; at least a hundredth.
    #[must_use]
    pub fn roam(&self) -> f64 {
        self.typical.roam[self.joint().qpos].max(0.01)
    }

    /// Mean and standard deviation of a body's position along an axis of the world, m.
    ///
    /// They are 0 and 0.1 m for a body without a free joint.
    #[must_use]
    pub fn whereabouts(&self, body: usize, axis: usize) -> [f64; 2] {
        let name = &self.machine.bodies[body];
        let mut joints = self.machine.joints.iter();
        match joints.find(|j| j.body == *name && j.kind == JointKind::Free) {
            Some(j) => [
                self.typical.mean[j.qpos + axis],
                self.typical.roam[j.qpos + axis],
            ],
            None => [0.0, 0.1],
        }
    }

    /// A unit vector in space, from the first two draws.
    #[must_use]
    pub fn direction(&self) -> [f64; 3] {
        let z = 2.0 * self.draw[0] - 1.0;
        let [x, y] = self.heading(1);
        let flat = (1.0 - z * z).sqrt();
        [flat * x, flat * y, z]
    }

    /// Index of the body that is the site, or whose joint is the site.
    #[must_use]
    pub fn body(&self) -> usize {
        let machine = self.machine;
        let own = machine.body(self.site).ok();
        let of_joint = machine.joint(self.site).ok();
        own.or_else(|| machine.body(&machine.joints[of_joint?].body).ok())
            .unwrap_or(0)
    }

    /// A unit vector in the plane, at the angle of a draw.
    #[must_use]
    pub fn heading(&self, which: usize) -> [f64; 2] {
        let (sin, cos) = (std::f64::consts::TAU * self.draw[which]).sin_cos();
        [cos, sin]
    }
}

/// Names of the joints that are hinges or slides.
#[must_use]
pub fn scalar_joints(machine: &Anatomy) -> Vec<String> {
    let joints = machine.joints.iter();
    joints
        .filter(|j| j.kind != JointKind::Free)
        .map(|j| j.name.clone())
        .collect()
}

/// Names of the hinges.
#[must_use]
pub fn hinges(machine: &Anatomy) -> Vec<String> {
    let joints = machine.joints.iter();
    joints
        .filter(|j| j.kind == JointKind::Hinge)
        .map(|j| j.name.clone())
        .collect()
}

/// Names of the joints that exactly one actuator drives.
#[must_use]
pub fn driven_joints(machine: &Anatomy) -> Vec<String> {
    (0..machine.joints.len())
        .filter(|&j| machine.drive_of(j).is_some())
        .map(|j| machine.joints[j].name.clone())
        .collect()
}

/// Names of the joints that can have a transmission between drive and joint.
///
/// Their drive is a servo, or a motor whose rotor has inertia.
#[must_use]
pub fn geared_joints(machine: &Anatomy) -> Vec<String> {
    (0..machine.joints.len())
        .filter(|&j| {
            machine.drive_of(j).is_some_and(|d| {
                machine.drives[d].kind == DriveKind::Position || machine.joints[j].armature > 0.0
            })
        })
        .map(|j| machine.joints[j].name.clone())
        .collect()
}

/// Whether a cause is a transmission between drive and joint. A joint can have only one.
#[must_use]
pub fn is_transmission(cause: &dyn Cause) -> bool {
    matches!(cause.name(), "backlash" | "joint-compliance")
}

/// Names of all actuators.
#[must_use]
pub fn drives(machine: &Anatomy) -> Vec<String> {
    machine.drives.iter().map(|d| d.name.clone()).collect()
}

/// Names of the actuators that drive a single joint.
#[must_use]
pub fn joint_drives(machine: &Anatomy) -> Vec<String> {
    let drives = machine.drives.iter();
    drives
        .filter(|d| d.joint.is_some())
        .map(|d| d.name.clone())
        .collect()
}

/// Names of the sensors whose readings are numbers.
#[must_use]
pub fn sensors(machine: &Anatomy) -> Vec<String> {
    let sensors = machine.sensors.iter();
    sensors
        .filter(|s| !s.is_orientation())
        .map(|s| s.name.clone())
        .collect()
}

/// Names of the bodies that have joints of their own.
#[must_use]
pub fn moving_bodies(machine: &Anatomy) -> Vec<String> {
    let mut bodies: Vec<String> = machine.joints.iter().map(|j| j.body.clone()).collect();
    bodies.dedup();
    bodies
}

/// Names of the free bodies.
#[must_use]
pub fn free_bodies(machine: &Anatomy) -> Vec<String> {
    let joints = machine.joints.iter();
    joints
        .filter(|j| j.kind == JointKind::Free)
        .map(|j| j.body.clone())
        .collect()
}
