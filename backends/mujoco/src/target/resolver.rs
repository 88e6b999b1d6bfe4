//! What the elements of the document have in common, and the options of the scene.

use asid_core::{Error, Result, Target};
use mujoco_rs::wrappers::mj_model::MjModel;

use super::{Column, Domain, parameter};
use crate::compiled::Compiled;
use crate::field::Field;

/// Resolves one target.
pub(super) struct Resolver<'a> {
    pub(super) compiled: &'a Compiled,
    pub(super) target: &'a Target,
}

impl Resolver<'_> {
    pub(super) fn model(&self) -> &MjModel {
        &self.compiled.model
    }

    /// Says why the target cannot be resolved.
    pub(super) fn refuse<T>(&self, why: &str) -> Result<T> {
        Err(parameter(self.target, why))
    }

    pub(super) fn no_attribute(&self, known: &str) -> Error {
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
    pub(super) fn index(&self, len: usize) -> Result<usize> {
        if self.target.index < len {
            return Ok(self.target.index);
        }
        self.refuse(&format!(
            "index {} of an attribute with {len} entries",
            self.target.index
        ))
    }

    pub(super) fn column(
        &self,
        nominal: f64,
        domain: Domain,
        entries: Vec<(Field, usize, f64)>,
    ) -> Column {
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

    pub(super) fn option(&self) -> Result<Column> {
        if self.target.attribute != "gravity" {
            return Err(self.no_attribute("gravity"));
        }
        let i = self.index(3)?;
        let nominal = self.model().opt().gravity[i];
        Ok(self.column(nominal, Domain::Any, vec![(Field::Gravity, i, 1.0)]))
    }
}
