//! Parameters: from a target's name to entries of model fields.
//!
//! Each target is resolved once, when a batch is made, into a [`Column`]: which
//! entries of which field take its value, or which part of which body's mass
//! properties it is. Setting values is then arithmetic.

use std::ffi::CStr;

use asid_core::layout::Target;
use asid_core::{Error, Result};
use mujoco_rs::mujoco_c::{mjtBias, mjtGain};
use mujoco_rs::wrappers::mj_model::{MjModel, MjtGeomBase};

use crate::ffi::{Batch, Expanded};
use crate::inertia::{BodyGeoms, BodyInertia, Origin, origin};
use crate::model::Compiled;

/// A field of `mjModel` that parameters change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum Field {
    GeomFriction,
    GeomPos,
    GeomSolref,
    BodyMass,
    BodyIpos,
    BodyIquat,
    BodyInertia,
    DofDamping,
    DofFrictionloss,
    DofArmature,
    JntStiffness,
    ActuatorGainprm,
    ActuatorBiasprm,
    ActuatorGear,
    Gravity,
}

impl Field {
    /// MuJoCo's name of it.
    fn name(self) -> &'static CStr {
        match self {
            Self::GeomFriction => c"geom_friction",
            Self::GeomPos => c"geom_pos",
            Self::GeomSolref => c"geom_solref",
            Self::BodyMass => c"body_mass",
            Self::BodyIpos => c"body_ipos",
            Self::BodyIquat => c"body_iquat",
            Self::BodyInertia => c"body_inertia",
            Self::DofDamping => c"dof_damping",
            Self::DofFrictionloss => c"dof_frictionloss",
            Self::DofArmature => c"dof_armature",
            Self::JntStiffness => c"jnt_stiffness",
            Self::ActuatorGainprm => c"actuator_gainprm",
            Self::ActuatorBiasprm => c"actuator_biasprm",
            Self::ActuatorGear => c"actuator_gear",
            Self::Gravity => c"opt.gravity",
        }
    }
}

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
enum Part {
    GeomMass(usize),
    GeomPosition(usize, usize),
    Mass,
    Center(usize),
    Moment(usize),
}

impl Part {
    fn of_geom(self) -> bool {
        matches!(self, Self::GeomMass(_) | Self::GeomPosition(..))
    }
}

/// A target, resolved in a model.
#[derive(Clone, Debug)]
pub struct Column {
    target: Target,
    /// Value in the scene as it is.
    pub nominal: f64,
    domain: Domain,
    /// Entries that take the value times a factor.
    entries: Vec<(Field, usize, f64)>,
    /// Part of a body's mass properties.
    part: Option<(usize, Part)>,
    geoms: Option<BodyGeoms>,
    /// Whether constants of the model follow from it.
    derives: bool,
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

    fn check(&self, value: f64) -> Result<()> {
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

fn parameter(target: &Target, message: &str) -> Error {
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
            return Err(parameter(self.target, "the world has no mass properties"));
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
            _ => return Err(self.no_attribute("mass, ipos, inertia")),
        };
        let mut column = self.column(nominal, domain, Vec::new());
        column.part = Some((body, part));
        column.derives = true;
        Ok(column)
    }

    fn joint(&self) -> Result<Column> {
        let joint = self.compiled.layout.joint(&self.target.name)?;
        self.index(1)?;
        let dofs = joint.qvel..joint.qvel + joint.kind.qvel_len();
        let model = self.model();
        let (field, nominal) = match self.target.attribute.as_str() {
            "damping" => (Field::DofDamping, model.dof_damping()[joint.qvel]),
            "frictionloss" => (Field::DofFrictionloss, model.dof_frictionloss()[joint.qvel]),
            "armature" => (Field::DofArmature, model.dof_armature()[joint.qvel]),
            "stiffness" => {
                let id = self
                    .compiled
                    .layout
                    .joints
                    .iter()
                    .position(|j| j.name == joint.name)
                    .unwrap_or(0);
                let entry = (Field::JntStiffness, id, 1.0);
                return Ok(self.column(
                    model.jnt_stiffness()[id],
                    Domain::NonNegative,
                    vec![entry],
                ));
            }
            _ => return Err(self.no_attribute("damping, frictionloss, stiffness, armature")),
        };
        let entries = dofs.map(|dof| (field, dof, 1.0)).collect();
        let mut column = self.column(nominal, Domain::NonNegative, entries);
        column.derives = field == Field::DofArmature;
        Ok(column)
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
            _ => Err(self.no_attribute("kp, kv, gear")),
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

/// A body whose mass properties depend on some columns.
#[derive(Clone, Debug)]
struct BodyPlan {
    body: usize,
    nominal: BodyInertia,
    geoms: Option<BodyGeoms>,
    parts: Vec<(usize, Part)>,
}

impl BodyPlan {
    /// Mass properties for one simulation's values of all columns.
    fn inertia(&self, columns: &[Column], values: &[f64]) -> BodyInertia {
        // What the scene says stays what the engine compiled, to the bit.
        if self
            .parts
            .iter()
            .all(|&(c, _)| values[c] == columns[c].nominal)
        {
            return self.nominal.clone();
        }
        let mut out = self.nominal.clone();
        if let Some(geoms) = &self.geoms {
            let mut masses = geoms.masses.clone();
            for &(column, part) in &self.parts {
                match part {
                    Part::GeomMass(g) => masses[g].mass = values[column],
                    Part::GeomPosition(g, axis) => masses[g].position[axis] = values[column],
                    _ => {}
                }
            }
            out = BodyInertia::of_geoms(&masses);
        }
        // The mass first: it scales the moments that the scene has, and a moment
        // that is itself a parameter is then as given.
        for &(column, part) in &self.parts {
            if part == Part::Mass {
                let scale = values[column] / out.mass;
                out.mass = values[column];
                out.inertia = out.inertia.map(|moment| moment * scale);
            }
        }
        for &(column, part) in &self.parts {
            match part {
                Part::Center(axis) => out.ipos[axis] = values[column],
                Part::Moment(axis) => out.inertia[axis] = values[column],
                _ => {}
            }
        }
        out
    }
}

/// All parameters of a batch.
#[derive(Clone, Debug)]
pub struct Plan {
    columns: Vec<Column>,
    bodies: Vec<BodyPlan>,
}

impl Plan {
    /// Resolves the targets of a batch.
    ///
    /// # Errors
    /// As [`Column::resolve`], and where two targets set the same thing.
    pub fn new(compiled: &Compiled, targets: &[Target]) -> Result<Self> {
        let mut columns = Vec::with_capacity(targets.len());
        let mut bodies: Vec<BodyPlan> = Vec::new();
        for (i, target) in targets.iter().enumerate() {
            if targets[..i].contains(target) {
                return Err(parameter(target, "is named twice"));
            }
            let column = Column::resolve(compiled, target)?;
            if let Some((body, part)) = column.part {
                let found = bodies.iter().position(|b| b.body == body);
                let plan = match found {
                    Some(at) => &mut bodies[at],
                    None => {
                        bodies.push(BodyPlan {
                            body,
                            nominal: BodyInertia::of(&compiled.model, body),
                            geoms: None,
                            parts: Vec::new(),
                        });
                        let last = bodies.len() - 1;
                        &mut bodies[last]
                    }
                };
                if let Some(&(other, _)) = plan
                    .parts
                    .iter()
                    .find(|(_, p)| p.of_geom() != part.of_geom())
                {
                    return Err(parameter(
                        target,
                        &format!(
                            "sets the same mass properties as `{}`; use one of them",
                            targets[other]
                        ),
                    ));
                }
                plan.parts.push((i, part));
                plan.geoms = plan.geoms.take().or_else(|| column.geoms.clone());
            }
            columns.push(column);
        }
        Ok(Self { columns, bodies })
    }

    /// Number of columns.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// True where a body's centre or axes may move, so that no shortcut for
    /// bodies of diagonal inertia holds.
    #[must_use]
    pub fn moves_mass(&self) -> bool {
        !self.bodies.is_empty()
    }

    /// True where constants of the model follow from a column.
    #[must_use]
    pub fn derives(&self) -> bool {
        self.columns.iter().any(|c| c.derives)
    }

    /// Nominal values of all columns.
    pub fn nominal(&self) -> impl Iterator<Item = f64> {
        self.columns.iter().map(|c| c.nominal)
    }

    /// Gives the fields in use values of their own in each simulation.
    ///
    /// # Errors
    /// When the engine lacks a field.
    pub fn expand(&self, batch: &mut Batch) -> Result<Fields> {
        let mut wanted: Vec<Field> = self
            .columns
            .iter()
            .flat_map(|c| c.entries.iter().map(|e| e.0))
            .collect();
        if !self.bodies.is_empty() {
            wanted.extend([
                Field::BodyMass,
                Field::BodyIpos,
                Field::BodyIquat,
                Field::BodyInertia,
            ]);
        }
        wanted.sort_unstable();
        wanted.dedup();
        let mut handles = Vec::with_capacity(wanted.len());
        for field in wanted {
            let handle = batch.expand(field.name()).map_err(Error::Failed)?;
            handles.push((field, handle));
        }
        Ok(Fields(handles))
    }

    /// Checks one simulation's values.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value that is not finite or not physical.
    pub fn check(&self, values: &[f64]) -> Result<()> {
        for (column, &value) in self.columns.iter().zip(values) {
            column.check(value)?;
        }
        for plan in &self.bodies {
            if !plan.inertia(&self.columns, values).is_physical() {
                let (column, _) = plan.parts[0];
                return Err(parameter(
                    &self.columns[column].target,
                    "the body would have no mass, or moments of inertia that no body can have",
                ));
            }
        }
        Ok(())
    }

    /// Writes one simulation's values, checked before; `before` are the values it
    /// has. Returns whether constants of its model must be recomputed.
    pub fn write(
        &self,
        batch: &mut Batch,
        fields: &Fields,
        sim: usize,
        before: &[f64],
        values: &[f64],
    ) -> bool {
        let mut derives = false;
        for (i, column) in self.columns.iter().enumerate() {
            if values[i] == before[i] {
                continue;
            }
            derives |= column.derives;
            for &(field, entry, factor) in &column.entries {
                if let Some(handle) = fields.get(field) {
                    batch.field(handle, sim)[entry] = factor * values[i];
                }
            }
        }
        for plan in &self.bodies {
            if plan.parts.iter().all(|&(c, _)| values[c] == before[c]) {
                continue;
            }
            let inertia = plan.inertia(&self.columns, values);
            let mut put = |field, width: usize, data: &[f64]| {
                if let Some(handle) = fields.get(field) {
                    let at = plan.body * width;
                    batch.field(handle, sim)[at..at + width].copy_from_slice(data);
                }
            };
            put(Field::BodyMass, 1, &[inertia.mass]);
            put(Field::BodyIpos, 3, &inertia.ipos);
            put(Field::BodyIquat, 4, &inertia.iquat);
            put(Field::BodyInertia, 3, &inertia.inertia);
        }
        derives
    }
}

/// Expanded fields of a batch.
#[derive(Clone, Debug)]
pub struct Fields(Vec<(Field, Expanded)>);

impl Fields {
    fn get(&self, field: Field) -> Option<Expanded> {
        self.0.iter().find(|(f, _)| *f == field).map(|&(_, h)| h)
    }
}
