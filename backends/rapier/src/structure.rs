//! Parameters that are built into the bodies: masses and positions of geoms, and the resulting mass
//! properties of bodies.
//!
//! These are stored in rapier's collections and hence in a state, although parameters are not part
//! of a state. A state therefore remembers the values it was built with. A simulation that takes
//! over the state rebuilds only what differs from its own values. Where nothing differs, not a bit
//! changes.

use asid_mjcf::mass::{GeomMass, MassProperties};
use mjcf_rs::Model;
use mjcf_rs::body::{Body, InertiaSpec};
use mjcf_rs::compiler::{Compiler, InertiaFromGeom};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::convert;

/// Values of the structural parameters, of every geom and body.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// Position in its body (m) and mass (kg) of each geom.
    pub geoms: Vec<GeomValues>,
    /// Values that parameters set on each body directly.
    pub bodies: Vec<BodyValues>,
    /// Position of each body in its parent, m.
    pub places: Vec<Vector3<f64>>,
    /// Anchor of each joint in its body, m.
    pub anchors: Vec<Vector3<f64>>,
    /// Axis of each joint in its body. It has length one until a parameter changes it; only its
    /// direction matters.
    pub axes: Vec<Vector3<f64>>,
}

/// Structural values of one geom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeomValues {
    /// Position in its body, m.
    pub position: Vector3<f64>,
    /// Mass, kg; zero for a geom without mass.
    pub mass: f64,
}

/// Structural values set on one body; `None` follows from the document.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyValues {
    /// Mass, kg; the inertia is scaled with it.
    pub mass: Option<f64>,
    /// Centre of mass, m.
    pub center: [Option<f64>; 3],
    /// Principal moments, kg m².
    pub inertia: [Option<f64>; 3],
}

/// How the mass of each body is determined.
#[derive(Clone, Debug)]
pub struct MassModel {
    /// Per body: what the document states; `None` for the mass properties of its geoms.
    inertials: Vec<Option<Inertia>>,
    /// Per body: indices of its geoms.
    geoms_of: Vec<std::ops::Range<usize>>,
    /// Per geom: mass properties as in the document; `None` for a plane or a mesh.
    geoms: Vec<Option<GeomMass>>,
    bound_mass: f64,
    bound_inertia: f64,
}

/// Mass properties with their principal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, m.
    pub center: Vector3<f64>,
    /// Principal moments, kg m².
    pub moments: Vector3<f64>,
    /// `body_from_principal`.
    pub axes: UnitQuaternion<f64>,
}

impl MassModel {
    /// Reads from the document how masses are determined, and the nominal values.
    pub fn new(model: &Model) -> (Self, Structure) {
        let mut mass_model = Self {
            inertials: Vec::new(),
            geoms_of: Vec::new(),
            geoms: Vec::new(),
            bound_mass: model.compiler.bound_mass,
            bound_inertia: model.compiler.bound_inertia,
        };
        let joints = || model.bodies.iter().flat_map(|b| &b.body.joints);
        let mut structure = Structure {
            geoms: Vec::new(),
            bodies: vec![BodyValues::default(); model.bodies.len()],
            places: model
                .bodies
                .iter()
                .map(|b| convert::parts(&b.body.pose).0)
                .collect(),
            anchors: joints().map(|j| Vector3::from(j.pos)).collect(),
            axes: joints().map(|j| direction(j.axis)).collect(),
        };
        for entry in &model.bodies {
            let first = mass_model.geoms.len();
            for geom in &entry.body.geoms {
                let mut geom = geom.clone();
                geom.density = geom.density.or(Some(model.compiler.inertia_density));
                let mass = GeomMass::of(&geom);
                let position = mass
                    .as_ref()
                    .map_or_else(|| convert::parts(&geom.pose).0, |m| m.position);
                structure.geoms.push(GeomValues {
                    position,
                    mass: mass.as_ref().map_or(0.0, |m| m.mass),
                });
                mass_model.geoms.push(mass);
            }
            mass_model.geoms_of.push(first..mass_model.geoms.len());
            mass_model
                .inertials
                .push(inertial(&entry.body, &model.compiler));
        }
        (mass_model, structure)
    }

    /// Whether a body's mass comes from its geoms.
    pub fn follows_geoms(&self, body: usize) -> bool {
        self.inertials[body].is_none()
    }

    /// Indices of a body's geoms.
    pub fn geoms_of(&self, body: usize) -> std::ops::Range<usize> {
        self.geoms_of[body].clone()
    }

    /// Whether a geom is a primitive, whose mass can be changed.
    pub fn is_primitive(&self, geom: usize) -> bool {
        self.geoms[geom].is_some()
    }

    /// Mass properties of a body's geoms, with the values of the document or others.
    fn of_geoms(&self, body: usize, structure: Option<&Structure>) -> Inertia {
        let geoms: Vec<GeomMass> = self.geoms_of[body]
            .clone()
            .filter_map(|g| {
                let mut mass = self.geoms[g].clone()?;
                if let Some(structure) = structure {
                    mass.mass = structure.geoms[g].mass;
                    mass.position = structure.geoms[g].position;
                }
                Some(mass)
            })
            .collect();
        let all = MassProperties::of_geoms(&geoms);
        let (moments, axes) = all.principal();
        Inertia {
            mass: all.mass,
            center: all.center,
            moments,
            axes,
        }
    }

    /// Mass properties of a body.
    ///
    /// If its geoms differ from the document, a centre of mass that is set moves by its difference
    /// from the document. A moment is scaled by its ratio to the document.
    pub fn inertia(&self, body: usize, structure: &Structure) -> Inertia {
        let given = self.inertials[body];
        let mut inertia = given.unwrap_or_else(|| self.of_geoms(body, Some(structure)));
        let values = &structure.bodies[body];
        let document = given.is_none().then(|| self.of_geoms(body, None));
        let document = document.filter(|document| *document != inertia);
        inertia.mass = inertia.mass.max(self.bound_mass);
        inertia.moments = inertia.moments.map(|m| m.max(self.bound_inertia));
        if let Some(mass) = values.mass {
            if inertia.mass > 0.0 {
                inertia.moments *= mass / inertia.mass;
            }
            inertia.mass = mass;
        }
        for axis in 0..3 {
            if let Some(center) = values.center[axis] {
                let moved = document.map_or(0.0, |was| inertia.center[axis] - was.center[axis]);
                inertia.center[axis] = center + moved;
            }
            if let Some(moment) = values.inertia[axis] {
                let scaled = document.map_or(1.0, |was| inertia.moments[axis] / was.moments[axis]);
                inertia.moments[axis] = moment * scaled;
            }
        }
        inertia
    }
}

/// The direction of an axis; the axis itself where it has none.
fn direction(axis: [f64; 3]) -> Vector3<f64> {
    let axis = Vector3::from(axis);
    axis.try_normalize(0.0).unwrap_or(axis)
}

/// The mass properties of a body that its geoms do not determine: those of its `<inertial>`, if the
/// compiler's settings use it.
///
/// Without one, a body has no mass where geoms have none (`inertiafromgeom="false"`).
fn inertial(body: &Body, compiler: &Compiler) -> Option<Inertia> {
    let Some(given) = body.inertial.as_ref() else {
        let massless = Inertia {
            mass: 0.0,
            center: Vector3::zeros(),
            moments: Vector3::zeros(),
            axes: UnitQuaternion::identity(),
        };
        return (compiler.inertia_from_geom == InertiaFromGeom::False).then_some(massless);
    };
    if compiler.inertia_from_geom == InertiaFromGeom::True && !body.geoms.is_empty() {
        return None;
    }
    let (center, frame) = convert::parts(&given.pose);
    let (moments, axes) = match given.inertia {
        InertiaSpec::Diagonal(d) => (Vector3::from(d), frame),
        InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
            let full = MassProperties {
                mass: given.mass,
                center,
                inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            };
            let (moments, axes) = full.principal();
            (moments, frame * axes)
        }
    };
    Some(Inertia {
        mass: given.mass,
        center,
        moments,
        axes,
    })
}
