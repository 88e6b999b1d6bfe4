//! From a target's name to entries of model fields.
//!
//! Each target is resolved once, when a batch is made, into a [`Column`]: which
//! entries of which field take its value, or which part of which body's mass
//! properties it is.

use asid_core::Target;
use asid_core::layout::{Joint, JointKind};
use asid_core::{Error, Result};
use mujoco_rs::mujoco_c::{mjtBias, mjtGain};
use mujoco_rs::wrappers::mj_model::{MjModel, MjtGeomBase};

use crate::compiled::Compiled;
use crate::contact::overruled;
use crate::field::Field;
use crate::inertia::{BodyGeoms, BodyInertia, Origin, origin};

/// Values that make sense for a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Domain {
    Any,
    NonNegative,
    Positive,
    Negative,
}

/// What a parameter is to its body's mass properties.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Mass of one of its geoms.
    GeomMass(usize),
    /// Place of one of its geoms along an axis.
    GeomPosition(usize, usize),
    /// Its mass.
    Mass,
    /// Its centre along an axis.
    Center(usize),
    /// One of its principal moments.
    Moment(usize),
}

impl Part {
    /// True where a geom is changed and the body follows.
    #[must_use]
    pub fn of_geom(self) -> bool {
        matches!(self, Self::GeomMass(_) | Self::GeomPosition(..))
    }
}

/// A target, resolved in a model.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name.
    pub target: Target,
    /// Value in the scene as it is.
    pub nominal: f64,
    domain: Domain,
    /// Entries that take the value times a factor.
    pub entries: Vec<(Field, usize, f64)>,
    /// Part of a body's mass properties.
    pub part: Option<(usize, Part)>,
    /// The geoms of that body, where they make its mass properties.
    pub geoms: Option<BodyGeoms>,
    /// Joint whose axis it is a part of, and which.
    pub axis: Option<(usize, usize)>,
    /// Whether constants of the model follow from it.
    pub derives: bool,
}

impl Column {
    /// Finds what a target changes.
    ///
    /// # Errors
    /// [`Error::UnknownName`] where no element has the name,
    /// [`Error::Parameter`] where it has no such attribute to change.
    pub fn resolve(compiled: &Compiled, target: &Target) -> Result<Self> {
        let resolver = Resolver { compiled, target };
        match target.element.as_str() {
            "geom" => resolver.geom(),
            "body" => resolver.body(),
            "joint" => resolver.joint(),
            "actuator" => resolver.actuator(),
            "option" => resolver.option(),
            _ => Err(resolver.no_attribute("")),
        }
    }

    /// Checks a value.
    ///
    /// # Errors
    /// [`Error::Parameter`] where it is not finite or not physical.
    pub fn check(&self, value: f64) -> Result<()> {
        let (good, wanted) = match self.domain {
            Domain::Any => (true, "finite"),
            Domain::NonNegative => (value >= 0.0, "at least 0"),
            Domain::Positive => (value > 0.0, "above 0"),
            Domain::Negative => (value < 0.0, "below 0, as in the scene"),
        };
        if good && value.is_finite() {
            return Ok(());
        }
        Err(parameter(
            &self.target,
            &format!("{value} must be finite and {wanted}"),
        ))
    }
}

/// An error about a parameter.
pub fn parameter(target: &Target, message: &str) -> Error {
    Error::Parameter {
        parameter: target.to_string(),
        message: message.to_owned(),
    }
}

/// Resolves one target.
struct Resolver<'a> {
    compiled: &'a Compiled,
    target: &'a Target,
}

impl Resolver<'_> {
    fn model(&self) -> &MjModel {
        &self.compiled.model
    }

    fn no_attribute(&self, known: &str) -> Error {
        let Target {
            element, attribute, ..
        } = self.target;
        let known = if known.is_empty() {
            String::new()
        } else {
            format!("; known: {known}")
        };
        parameter(
            self.target,
            &format!("`{attribute}` of a {element} cannot be changed{known}"),
        )
    }

    /// The target's index, checked against the attribute's length.
    fn index(&self, len: usize) -> Result<usize> {
        if self.target.index < len {
            return Ok(self.target.index);
        }
        Err(parameter(
            self.target,
            &format!(
                "index {} of an attribute with {len} entries",
                self.target.index
            ),
        ))
    }

    fn column(&self, nominal: f64, domain: Domain, entries: Vec<(Field, usize, f64)>) -> Column {
        Column {
            target: self.target.clone(),
            nominal,
            domain,
            entries,
            part: None,
            geoms: None,
            axis: None,
            derives: false,
        }
    }

    fn geom(&self) -> Result<Column> {
        let names = &self.compiled.layout.geoms;
        let geom = names
            .iter()
            .position(|n| *n == self.target.name)
            .ok_or_else(|| {
                Error::unknown("geom", &self.target.name, names.iter().map(String::as_str))
            })?;
        let model = self.model();
        match self.target.attribute.as_str() {
            "friction" => {
                let i = self.index(3)?;
                if let Some(why) = overruled(model, &self.compiled.layout, geom) {
                    return Err(parameter(
                        self.target,
                        &format!("it would have no effect: {why}"),
                    ));
                }
                let nominal = model.geom_friction()[geom][i];
                let entry = (Field::GeomFriction, 3 * geom + i, 1.0);
                Ok(self.column(nominal, Domain::NonNegative, vec![entry]))
            }
            "solref" => {
                let i = self.index(2)?;
                let nominal = model.geom_solref()[geom][i];
                // Negative numbers are MuJoCo's other meaning of the pair, so a
                // value keeps the sign that the scene has.
                let domain = if nominal < 0.0 {
                    Domain::Negative
                } else {
                    Domain::Positive
                };
                let entry = (Field::GeomSolref, 2 * geom + i, 1.0);
                Ok(self.column(nominal, domain, vec![entry]))
            }
            "pos" => self.geom_position(geom),
            "mass" => self.geom_mass(geom),
            _ => Err(self.no_attribute("friction, pos, mass, solref")),
        }
    }

    fn geom_position(&self, geom: usize) -> Result<Column> {
        let axis = self.index(3)?;
        let model = self.model();
        if matches!(
            model.geom_type()[geom],
            MjtGeomBase::mjGEOM_MESH | MjtGeomBase::mjGEOM_SDF
        ) {
            return Err(parameter(
                self.target,
                "the place of a mesh cannot be changed",
            ));
        }
        let entry = (Field::GeomPos, 3 * geom + axis, 1.0);
        let mut column = self.column(model.geom_pos()[geom][axis], Domain::Any, vec![entry]);
        column.derives = true;
        let body = model.geom_bodyid()[geom] as usize;
        match self.origin(body)? {
            Origin::Geoms(geoms) => {
                let place = place(&geoms, geom, self.target)?;
                column.part = Some((body, Part::GeomPosition(place, axis)));
                column.geoms = Some(geoms);
            }
            Origin::Inertial => {}
            Origin::Other(why) => return Err(parameter(self.target, &why)),
        }
        Ok(column)
    }

    fn geom_mass(&self, geom: usize) -> Result<Column> {
        self.index(1)?;
        let body = self.model().geom_bodyid()[geom] as usize;
        let name = &self.compiled.layout.bodies[body];
        let why = match self.origin(body)? {
            Origin::Geoms(geoms) => {
                let place = place(&geoms, geom, self.target)?;
                let mut column =
                    self.column(geoms.masses[place].mass, Domain::NonNegative, Vec::new());
                column.part = Some((body, Part::GeomMass(place)));
                column.geoms = Some(geoms);
                column.derives = true;
                return Ok(column);
            }
            Origin::Inertial if body == 0 => "the world has no mass".to_owned(),
            Origin::Inertial => format!(
                "body `{name}` has its mass from <inertial>, so that its geoms have none; use body/{name}/mass"
            ),
            Origin::Other(why) => why,
        };
        Err(parameter(self.target, &why))
    }

    fn origin(&self, body: usize) -> Result<Origin> {
        let Compiled {
            scene,
            model,
            layout,
        } = self.compiled;
        origin(scene, model, body, &layout.bodies[body])
    }

    fn body(&self) -> Result<Column> {
        let body = self.compiled.layout.body(&self.target.name)?;
        if body == 0 {
            return Err(parameter(
                self.target,
                "the world has neither place nor mass properties",
            ));
        }
        if self.target.attribute == "pos" {
            return self.body_position(body);
        }
        let now = BodyInertia::of(self.model(), body);
        let (nominal, domain, part) = match self.target.attribute.as_str() {
            "mass" => {
                self.index(1)?;
                (now.mass, Domain::Positive, Part::Mass)
            }
            "ipos" => {
                let i = self.index(3)?;
                (now.ipos[i], Domain::Any, Part::Center(i))
            }
            "inertia" => {
                let i = self.index(3)?;
                (now.inertia[i], Domain::Positive, Part::Moment(i))
            }
            _ => return Err(self.no_attribute("pos, mass, ipos, inertia")),
        };
        let mut column = self.column(nominal, domain, Vec::new());
        column.part = Some((body, part));
        column.derives = true;
        Ok(column)
    }

    /// The place of a body in its parent.
    fn body_position(&self, body: usize) -> Result<Column> {
        let i = self.index(3)?;
        let name = &self.compiled.layout.bodies[body];
        let joints = &self.compiled.layout.joints;
        if joints
            .iter()
            .any(|j| j.body == *name && j.kind == JointKind::Free)
        {
            return Err(parameter(
                self.target,
                "the place of a free body is its state, and no parameter",
            ));
        }
        let entry = (Field::BodyPos, 3 * body + i, 1.0);
        let mut column = self.column(self.model().body_pos()[body][i], Domain::Any, vec![entry]);
        column.derives = true;
        Ok(column)
    }

    fn joint(&self) -> Result<Column> {
        let joint = self.compiled.layout.joint(&self.target.name)?;
        match self.target.attribute.as_str() {
            "pos" => return self.anchor(joint),
            "axis" => return self.axis(joint),
            "range" => return self.range(joint),
            "springref" => return self.spring_reference(joint),
            _ => {}
        }
        self.index(1)?;
        let dofs = joint.qvel..joint.qvel + joint.kind.qvel_len();
        let model = self.model();
        let (field, nominal) = match self.target.attribute.as_str() {
            "damping" => (Field::DofDamping, model.dof_damping()[joint.qvel]),
            "frictionloss" => (Field::DofFrictionloss, model.dof_frictionloss()[joint.qvel]),
            "armature" => (Field::DofArmature, model.dof_armature()[joint.qvel]),
            "stiffness" => {
                let id = self.joint_id(joint);
                let entry = (Field::JntStiffness, id, 1.0);
                return Ok(self.column(
                    model.jnt_stiffness()[id],
                    Domain::NonNegative,
                    vec![entry],
                ));
            }
            _ => {
                return Err(self.no_attribute(
                    "pos, axis, range, damping, frictionloss, stiffness, springref, armature",
                ));
            }
        };
        let entries = dofs.map(|dof| (field, dof, 1.0)).collect();
        let mut column = self.column(nominal, Domain::NonNegative, entries);
        column.derives = field == Field::DofArmature;
        Ok(column)
    }

    fn joint_id(&self, joint: &Joint) -> usize {
        let joints = &self.compiled.layout.joints;
        joints
            .iter()
            .position(|j| j.name == joint.name)
            .unwrap_or(0)
    }

    /// The place of a hinge's axis.
    fn anchor(&self, joint: &Joint) -> Result<Column> {
        let axis = self.index(3)?;
        if joint.kind != JointKind::Hinge {
            return Err(parameter(
                self.target,
                "only the anchor of a hinge can be changed",
            ));
        }
        let id = self.joint_id(joint);
        let entry = (Field::JntPos, 3 * id + axis, 1.0);
        let mut column = self.column(self.model().jnt_pos()[id][axis], Domain::Any, vec![entry]);
        column.derives = true;
        Ok(column)
    }

    /// Only a hinge or a slide has some attributes.
    fn scalar(&self, joint: &Joint) -> Result<usize> {
        if matches!(joint.kind, JointKind::Hinge | JointKind::Slide) {
            return Ok(self.joint_id(joint));
        }
        Err(parameter(
            self.target,
            &format!(
                "only the `{}` of a hinge or slide can be changed",
                self.target.attribute
            ),
        ))
    }

    /// A part of an axis, which is scaled to one when all parts are known.
    fn axis(&self, joint: &Joint) -> Result<Column> {
        let (id, i) = (self.scalar(joint)?, self.index(3)?);
        let mut column = self.column(self.model().jnt_axis()[id][i], Domain::Any, Vec::new());
        column.axis = Some((id, i));
        column.derives = true;
        Ok(column)
    }

    /// An end of a joint's range.
    fn range(&self, joint: &Joint) -> Result<Column> {
        let (id, i) = (self.scalar(joint)?, self.index(2)?);
        if !self.model().jnt_limited()[id] {
            return Err(parameter(
                self.target,
                "it would have no effect: the joint is not limited",
            ));
        }
        let entry = (Field::JntRange, 2 * id + i, 1.0);
        Ok(self.column(self.model().jnt_range()[id][i], Domain::Any, vec![entry]))
    }

    /// Where a joint's spring rests.
    fn spring_reference(&self, joint: &Joint) -> Result<Column> {
        self.scalar(joint)?;
        self.index(1)?;
        let nominal = self.model().qpos_spring()[joint.qpos];
        let entry = (Field::QposSpring, joint.qpos, 1.0);
        Ok(self.column(nominal, Domain::Any, vec![entry]))
    }

    /// An end of the range of an actuator's force.
    fn force_range(&self, actuator: usize) -> Result<Column> {
        let i = self.index(2)?;
        if !self.model().actuator_forcelimited()[actuator] {
            return Err(parameter(
                self.target,
                "it would have no effect: the actuator's force is not limited",
            ));
        }
        let entry = (Field::ActuatorForcerange, 2 * actuator + i, 1.0);
        let nominal = self.model().actuator_forcerange()[actuator][i];
        Ok(self.column(nominal, Domain::Any, vec![entry]))
    }

    fn actuator(&self) -> Result<Column> {
        let actuator = self.compiled.layout.actuator(&self.target.name)?;
        let model = self.model();
        let (gains, biases) = (model.actuator_gainprm(), model.actuator_biasprm());
        let (gain, bias) = (gains[actuator], biases[actuator]);
        let (gain_at, bias_at) = (actuator * gain.len(), actuator * bias.len());
        let servo = model.actuator_gaintype()[actuator] == mjtGain::mjGAIN_FIXED
            && model.actuator_biastype()[actuator] == mjtBias::mjBIAS_AFFINE;
        // A position servo pulls with kp (ctrl - q) - kv dq, a velocity servo
        // with kv (ctrl - dq).
        let position = servo && bias[1] != 0.0 && gain[0] == -bias[1];
        let velocity = servo && bias[1] == 0.0 && bias[2] != 0.0 && gain[0] == -bias[2];
        let attribute = self.target.attribute.as_str();
        match attribute {
            "gear" => {
                let i = self.index(6)?;
                let entry = (Field::ActuatorGear, 6 * actuator + i, 1.0);
                let mut column =
                    self.column(model.actuator_gear()[actuator][i], Domain::Any, vec![entry]);
                column.derives = true;
                Ok(column)
            }
            "forcerange" => self.force_range(actuator),
            "kp" if position => {
                self.index(1)?;
                let entries = vec![
                    (Field::ActuatorGainprm, gain_at, 1.0),
                    (Field::ActuatorBiasprm, bias_at + 1, -1.0),
                ];
                Ok(self.column(gain[0], Domain::NonNegative, entries))
            }
            "kv" if position || velocity => {
                self.index(1)?;
                let mut entries = vec![(Field::ActuatorBiasprm, bias_at + 2, -1.0)];
                if velocity {
                    entries.push((Field::ActuatorGainprm, gain_at, 1.0));
                }
                Ok(self.column(-bias[2], Domain::NonNegative, entries))
            }
            "kp" | "kv" => Err(parameter(
                self.target,
                &format!("the actuator is no servo with a gain `{attribute}` above 0"),
            )),
            _ => Err(self.no_attribute("kp, kv, gear, forcerange")),
        }
    }

    fn option(&self) -> Result<Column> {
        if self.target.attribute != "gravity" {
            return Err(self.no_attribute("gravity"));
        }
        let i = self.index(3)?;
        let nominal = self.model().opt().gravity[i];
        Ok(self.column(nominal, Domain::Any, vec![(Field::Gravity, i, 1.0)]))
    }
}

fn place(geoms: &BodyGeoms, geom: usize, target: &Target) -> Result<usize> {
    geoms
        .geoms
        .iter()
        .position(|&g| g == geom)
        .ok_or_else(|| parameter(target, "the geom is not found in the document"))
}
