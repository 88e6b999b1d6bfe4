//! Mass properties of a body that parameters change.
//!
//! A compiled model stores mass, centre and principal inertia of each body, but not the geoms they
//! came from. If a parameter changes a geom's position or mass, its body is rebuilt from its geoms
//! in the document, with the formulas that all engines share.

use asid_core::{Result, Scene};
use asid_mjcf::mass::{GeomMass, MassProperties};
use mujoco_rs::wrappers::mj_model::MjModel;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Relative difference below which the geoms explain a body's mass properties. It is far above the
/// rounding of two ways of summing them, and far below any meaningful difference.
const AGREEMENT: f64 = 1e-6;

/// Mass properties in the form of a compiled model.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyInertia {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, m.
    pub ipos: [f64; 3],
    /// `body_from_principal`, w x y z.
    pub iquat: [f64; 4],
    /// Principal moments, kg m².
    pub inertia: [f64; 3],
}

impl BodyInertia {
    /// Mass properties of a body of a compiled model.
    #[must_use]
    pub fn of(model: &MjModel, body: usize) -> Self {
        Self {
            mass: model.body_mass()[body],
            ipos: model.body_ipos()[body],
            iquat: model.body_iquat()[body],
            inertia: model.body_inertia()[body],
        }
    }

    /// Mass properties of a union of geoms.
    #[must_use]
    pub fn of_geoms(geoms: &[GeomMass]) -> Self {
        let all = MassProperties::of_geoms(geoms);
        let (moments, rotation) = all.principal();
        Self {
            mass: all.mass,
            ipos: all.center.into(),
            iquat: [rotation.w, rotation.i, rotation.j, rotation.k],
            inertia: moments.into(),
        }
    }

    /// Rank of a principal axis by its moment, the largest first.
    #[must_use]
    pub fn rank_of_axis(&self, axis: usize) -> usize {
        let own = self.inertia[axis];
        let before = |&i: &usize| {
            let other = self.inertia[i];
            other > own || (other == own && i < axis)
        };
        (0..3).filter(before).count()
    }

    /// The principal axis of a rank by moment, the largest first.
    #[must_use]
    pub fn axis_of_rank(&self, rank: usize) -> usize {
        (0..3)
            .find(|&axis| self.rank_of_axis(axis) == rank)
            .unwrap_or(rank)
    }

    /// Whether a body with these properties can exist: positive mass and moments, none larger than
    /// the sum of the other two.
    #[must_use]
    pub fn is_physical(&self) -> bool {
        let [a, b, c] = self.inertia;
        let slack = 1e-9 * (a + b + c);
        self.mass > 0.0
            && a > 0.0
            && b > 0.0
            && c > 0.0
            && a <= b + c + slack
            && b <= a + c + slack
            && c <= a + b + slack
    }

    /// Inertia along the body's axes.
    fn tensor(&self) -> Matrix3<f64> {
        let [w, x, y, z] = self.iquat;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
            .to_rotation_matrix()
            .into_inner();
        rotation * Matrix3::from_diagonal(&Vector3::from(self.inertia)) * rotation.transpose()
    }

    /// Whether both describe the same body, in any order of the principal axes.
    fn agrees(&self, other: &Self) -> bool {
        let scale = self.tensor().norm() / self.mass.max(f64::MIN_POSITIVE);
        let offset = (Vector3::from(self.ipos) - Vector3::from(other.ipos)).norm();
        (self.mass - other.mass).abs() <= AGREEMENT * self.mass
            && offset <= AGREEMENT * scale.sqrt()
            && (self.tensor() - other.tensor()).norm() <= AGREEMENT * self.tensor().norm()
    }
}

/// The geoms of a body, with their names as in the layout.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyGeoms {
    /// Indices of the geoms in the model.
    pub geoms: Vec<usize>,
    /// Their mass properties, in the same order.
    pub masses: Vec<GeomMass>,
}

/// Source of a body's mass properties.
#[derive(Clone, Debug, PartialEq)]
pub enum Origin {
    /// From its geoms, which explain them.
    Geoms(BodyGeoms),
    /// From an `<inertial>` element: geoms may move without changing them.
    Inertial,
    /// From something else, such as a mesh; the text says what is known.
    Other(String),
}

/// Finds the source of `body`'s mass properties by comparing the compiled ones with the sum of the
/// document's geoms.
///
/// # Errors
/// When the document cannot be read.
pub fn origin(scene: &Scene, model: &MjModel, body: usize, name: &str) -> Result<Origin> {
    if body == 0 {
        return Ok(Origin::Inertial);
    }
    let document = scene.description()?;
    let same_count = document.bodies.len() == model.nbody() as usize;
    let entry = document
        .bodies
        .iter()
        .find(|b| b.body.name.as_deref() == Some(name))
        .or_else(|| document.bodies.get(body).filter(|_| same_count));
    let Some(entry) = entry else {
        return Ok(Origin::Other(format!(
            "body `{name}` is not found in the document"
        )));
    };
    let compiled = BodyInertia::of(model, body);
    let first = model.body_geomadr()[body];
    let count = model.body_geomnum()[body] as usize;
    let masses: Option<Vec<GeomMass>> = entry.body.geoms.iter().map(GeomMass::of).collect();
    if let Some(masses) = masses.filter(|m| m.len() == count && count > 0)
        && compiled.agrees(&BodyInertia::of_geoms(&masses))
    {
        let first = first as usize;
        return Ok(Origin::Geoms(BodyGeoms {
            geoms: (first..first + count).collect(),
            masses,
        }));
    }
    Ok(if entry.body.inertial.is_some() {
        Origin::Inertial
    } else {
        Origin::Other(format!(
            "the mass of body `{name}` is not that of its geoms as primitives"
        ))
    })
}
