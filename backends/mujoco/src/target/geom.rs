//! Parameters of geoms and of bodies: contact, places and mass properties.

use asid_core::layout::JointKind;
use asid_core::{Error, Result, Target};
use mujoco_rs::wrappers::mj_model::MjtGeomBase;

use super::resolver::Resolver;
use super::{Column, Domain, Part, parameter};
use crate::compiled::Compiled;
use crate::contact::overruled;
use crate::field::Field;
use crate::inertia::{BodyGeoms, BodyInertia, Origin, origin};

impl Resolver<'_> {
    pub(super) fn geom(&self) -> Result<Column> {
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
                    return self.refuse(&format!("it would have no effect: {why}"));
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
            return self.refuse("the place of a mesh cannot be changed");
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
            Origin::Other(why) => return self.refuse(&why),
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
        self.refuse(&why)
    }

    fn origin(&self, body: usize) -> Result<Origin> {
        let Compiled {
            scene,
            model,
            layout,
        } = self.compiled;
        origin(scene, model, body, &layout.bodies[body])
    }

    pub(super) fn body(&self) -> Result<Column> {
        let body = self.compiled.layout.body(&self.target.name)?;
        if body == 0 {
            return self.refuse("the world has neither place nor mass properties");
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
            return self.refuse("the place of a free body is its state, and no parameter");
        }
        let entry = (Field::BodyPos, 3 * body + i, 1.0);
        let mut column = self.column(self.model().body_pos()[body][i], Domain::Any, vec![entry]);
        column.derives = true;
        Ok(column)
    }
}

fn place(geoms: &BodyGeoms, geom: usize, target: &Target) -> Result<usize> {
    geoms
        .geoms
        .iter()
        .position(|&g| g == geom)
        .ok_or_else(|| parameter(target, "the geom is not found in the document"))
}
