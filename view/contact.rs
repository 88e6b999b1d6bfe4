//! Where bodies touch, from their shapes and poses alone.
//!
//! Engines report how hard two bodies press, not where, and a log reports neither. The contact
//! points are therefore those at which shapes that may touch are within [`NEAR`] of each other,
//! computed by `parry3d`. A mesh counts as its convex hull, as in MuJoCo.

use asid_mjcf::Plant;
use mjcf_rs::body::GeomType;
use nalgebra::Isometry3;
use parry3d::math::{Pose, Rotation, Vector};
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d::shape::{Capsule, ConvexPolyhedron, Cuboid, Cylinder, HalfSpace, SharedShape};

use crate::surface::Surface;

/// Distance up to which shapes count as touching, m: the gap that an engine leaves between bodies
/// at rest, and the resolution of real machines' sensors.
pub const NEAR: f32 = 1e-3;
/// Largest number of pairs for which contacts are computed; a picture of more would be unreadable.
const MOST_PAIRS: usize = 4000;
/// Largest number of points in a frame.
const MOST_POINTS: usize = 64;
/// Points along each angle of an ellipsoid, whose convex hull replaces it.
const FACETS: usize = 12;

/// A geom that may touch another.
struct Solid {
    part: usize,
    part_from_geom: Pose,
    shape: SharedShape,
    /// Radius of a ball around the geom's origin that contains it, m; infinite for a plane.
    radius: f32,
}

/// A geom's frame in its part, kind, size, and mesh.
pub(crate) type Framed = (Isometry3<f64>, GeomType, [f64; 3], Option<usize>);

/// Geometry of the shapes that may touch.
#[derive(Default)]
pub(crate) struct Touch {
    solids: Vec<Option<Solid>>,
    pairs: Vec<[usize; 2]>,
}

impl Touch {
    /// Prepares the geoms of a plant; `frames` are those of all geoms, in the plant's order.
    pub(crate) fn new(
        plant: &Plant,
        part_of: &[usize],
        frames: &[Framed],
        meshes: &[Surface],
    ) -> Self {
        if plant.contacts.len() > MOST_PAIRS {
            return Self::default();
        }
        let solid = |(g, framed): (usize, &Framed)| {
            let (frame, kind, size, mesh) = framed;
            let surface = mesh.map(|m| &meshes[m]);
            let (shape, turn) = shape(*kind, size.map(|x| x as f32), surface)?;
            let radius = match kind {
                GeomType::Plane => f32::INFINITY,
                _ => {
                    shape.compute_local_bounding_sphere().radius
                        + shape.compute_local_bounding_sphere().center.length()
                }
            };
            Some(Solid {
                part: part_of[plant.geoms[g].body],
                part_from_geom: pose(frame) * turn,
                shape,
                radius,
            })
        };
        Self {
            solids: frames.iter().enumerate().map(solid).collect(),
            pairs: plant.contacts.clone(),
        }
    }

    /// Points of contact; `parts` are the poses of all parts but the world.
    pub(crate) fn points(&self, parts: &[Isometry3<f64>]) -> Vec<[f64; 3]> {
        let mut found = Vec::new();
        let there = |p: &Isometry3<f64>| {
            p.translation
                .vector
                .iter()
                .chain(p.rotation.coords.iter())
                .all(|x| x.is_finite())
        };
        if !parts.iter().all(there) {
            return found;
        }
        let poses: Vec<Pose> = parts.iter().map(pose).collect();
        let place = |s: &Solid| match s.part {
            0 => s.part_from_geom,
            p => poses[p - 1] * s.part_from_geom,
        };
        let at: Vec<Option<Pose>> = self.solids.iter().map(|s| s.as_ref().map(place)).collect();
        for &[i, j] in &self.pairs {
            let (Some(a), Some(b), Some(p), Some(q)) =
                (&self.solids[i], &self.solids[j], at[i], at[j])
            else {
                continue;
            };
            if (p.translation - q.translation).length() > a.radius + b.radius + NEAR {
                continue;
            }
            let mut manifolds: Vec<ContactManifold<(), ()>> = Vec::new();
            let of = DefaultQueryDispatcher.contact_manifolds(
                &p.inv_mul(&q),
                &*a.shape,
                &*b.shape,
                NEAR,
                &mut manifolds,
                &mut None,
            );
            if of.is_err() {
                continue;
            }
            for point in manifolds
                .iter()
                .flat_map(|m| &m.points)
                .filter(|c| c.dist <= NEAR)
            {
                let world = p.transform_point(point.local_p1).to_array().map(f64::from);
                if world.iter().all(|x| x.is_finite()) {
                    found.push(world);
                }
            }
        }
        found.truncate(MOST_POINTS);
        found
    }
}

fn pose(p: &Isometry3<f64>) -> Pose {
    let (t, q) = (p.translation, p.rotation.coords.map(|x| x as f32));
    Pose::from_parts(
        Vector::new(t.x as f32, t.y as f32, t.z as f32),
        Rotation::from_xyzw(q.x, q.y, q.z, q.w),
    )
}

/// The shape, and its rotation relative to the geom's frame.
fn shape(
    kind: GeomType,
    [a, b, c]: [f32; 3],
    mesh: Option<&Surface>,
) -> Option<(SharedShape, Pose)> {
    let none = Pose::identity();
    Some(match kind {
        GeomType::Plane => (SharedShape::new(HalfSpace::new(Vector::Z)), none),
        GeomType::Sphere => (SharedShape::ball(a), none),
        GeomType::Box => (SharedShape::new(Cuboid::new(Vector::new(a, b, c))), none),
        GeomType::Capsule => (SharedShape::new(Capsule::new_z(b, a)), none),
        // A cylinder's axis is y in parry and z here.
        GeomType::Cylinder => (
            SharedShape::new(Cylinder::new(b, a)),
            Pose::from_rotation(Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2)),
        ),
        GeomType::Ellipsoid => (hull(&ellipsoid([a, b, c]))?, none),
        GeomType::Mesh => {
            let points: Vec<Vector> = (mesh?.vertices.iter())
                .map(|p| Vector::new(p[0] as f32, p[1] as f32, p[2] as f32))
                .collect();
            (hull(&points)?, none)
        }
        GeomType::Hfield | GeomType::Sdf => return None,
    })
}

fn hull(points: &[Vector]) -> Option<SharedShape> {
    Some(SharedShape::new(ConvexPolyhedron::from_convex_hull(
        points,
    )?))
}

/// Points on an ellipsoid.
fn ellipsoid([a, b, c]: [f32; 3]) -> Vec<Vector> {
    let angle = |i: usize| std::f32::consts::PI * (i as f32 + 0.5) / FACETS as f32;
    let along = |(i, j): (usize, usize)| {
        let (u, v) = (angle(i), angle(j));
        Vector::new(a * u.sin() * v.cos(), b * u.sin() * v.sin(), c * u.cos())
    };
    (0..FACETS)
        .flat_map(|i| (0..2 * FACETS).map(move |j| (i, j)))
        .map(along)
        .chain([Vector::new(0.0, 0.0, c), Vector::new(0.0, 0.0, -c)])
        .collect()
}
