//! Resolves a target's name into entries of model fields.
//!
//! Each target is resolved once, when a batch is made, into a [`Column`]. It says which entries of
//! which field take its value, or which part of which body's mass properties it is.

mod geom;
mod joint;
mod resolver;

use asid_core::{Error, Result, Target};

use crate::compiled::Compiled;
use crate::field::Field;
use crate::inertia::BodyGeoms;
use resolver::Resolver;

/// Valid values of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Domain {
    Any,
    NonNegative,
    Positive,
    Negative,
}

/// The part of its body's mass properties that a parameter sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Mass of one of its geoms.
    GeomMass(usize),
    /// Position of one of its geoms along an axis.
    GeomPosition(usize, usize),
    /// Its mass.
    Mass,
    /// Its centre along an axis.
    Center(usize),
    /// One of its principal moments.
    Moment(usize),
}

impl Part {
    /// Whether a geom is changed and the body follows.
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
    /// Value in the unchanged scene.
    pub nominal: f64,
    domain: Domain,
    /// Entries that take the value times a factor.
    pub entries: Vec<(Field, usize, f64)>,
    /// Part of a body's mass properties.
    pub part: Option<(usize, Part)>,
    /// The geoms of that body, if they determine its mass properties.
    pub geoms: Option<BodyGeoms>,
    /// Joint whose axis it belongs to, and the component.
    pub axis: Option<(usize, usize)>,
    /// Whether model constants depend on it.
    pub derives: bool,
}

impl Column {
    /// Finds what a target changes.
    ///
    /// # Errors
    /// [`Error::UnknownName`] when no element has the name, [`Error::Parameter`] when it has no
    /// such attribute to change.
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
    /// [`Error::Parameter`] when it is not finite or not physical.
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
