//! Bodies, joints, geoms and sites of a document in the header's form.

use asid_core::layout::{JointKind, Layout};
use asid_mjcf::mass::{GeomMass, MassProperties};
use mjcf_rs::Model;
use mjcf_rs::body::{Body, Geom, GeomType, InertiaSpec};
use mjcf_rs::compiler::{Compiler, InertiaFromGeom};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::{Texts, sites as all_sites};
use crate::table::{self, geom_kind, joint_kind};

/// Position and orientation w x y z of a pose of the parser.
fn parts(pose: &mjcf_rs::Pose) -> ([f64; 3], [f64; 4]) {
    let (p, q) = (pose.translation, pose.rotation);
    ([p.x, p.y, p.z], [q.w, q.x, q.y, q.z])
}

/// Bodies, the world first.
pub fn bodies(model: &Model, layout: &Layout, texts: &mut Texts) -> Vec<table::Body> {
    let entries = model.bodies.iter().zip(&layout.bodies).enumerate();
    entries
        .map(|(i, (entry, name))| {
            let body = &entry.body;
            let (pos, quat) = parts(&body.pose);
            let stated = stated(body, &model.compiler);
            let mass = match (i, &stated) {
                (0, _) => MassProperties::of_geoms(&[]),
                (_, Some(mass)) => mass.clone(),
                _ if model.compiler.inertia_from_geom == InertiaFromGeom::False => {
                    MassProperties::of_geoms(&[])
                }
                _ => {
                    let geoms = body.geoms.iter();
                    let geoms: Vec<_> = geoms.filter_map(|g| geom_mass(g, model)).collect();
                    MassProperties::of_geoms(&geoms)
                }
            };
            let mass = match i {
                0 => mass,
                _ => bounded(mass, &model.compiler),
            };
            let m = mass.inertia;
            let (moments, axes) = principal(body, stated.is_some(), &mass);
            let least = if i == 0 {
                0.0
            } else {
                model.compiler.bound_inertia
            };
            let moments = moments.map(|m| m.max(least));
            table::Body {
                name: texts.add(name),
                parent: entry.parent.map_or(table::NONE, |p| p as u64),
                pos,
                quat,
                mass: mass.mass,
                com: mass.center.into(),
                inertia: [
                    m[(0, 0)],
                    m[(1, 1)],
                    m[(2, 2)],
                    m[(0, 1)],
                    m[(0, 2)],
                    m[(1, 2)],
                ],
                moments: moments.into(),
                iquat: [axes.w, axes.i, axes.j, axes.k],
                inertial: i32::from(stated.is_some()),
                padding: 0,
            }
        })
        .collect()
}

/// The `<inertial>` of a body, if the compiler's settings use it.
fn stated(body: &Body, compiler: &Compiler) -> Option<MassProperties> {
    let given = body.inertial.as_ref()?;
    if compiler.inertia_from_geom == InertiaFromGeom::True && !body.geoms.is_empty() {
        return None;
    }
    let (center, [w, x, y, z]) = parts(&given.pose);
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let turn = turn.to_rotation_matrix().into_inner();
    let own = match given.inertia {
        InertiaSpec::Diagonal(moments) => Matrix3::from_diagonal(&Vector3::from(moments)),
        InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    Some(MassProperties {
        mass: given.mass,
        center: center.into(),
        inertia: turn * own * turn.transpose(),
    })
}

/// Principal moments and their axes, in the document's order where it states them.
fn principal(
    body: &Body,
    stated: bool,
    mass: &MassProperties,
) -> (Vector3<f64>, UnitQuaternion<f64>) {
    if let (true, Some(given)) = (stated, &body.inertial)
        && let InertiaSpec::Diagonal(moments) = given.inertia
    {
        let (_, [w, x, y, z]) = parts(&given.pose);
        let axes = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        return (Vector3::from(moments), axes);
    }
    mass.principal()
}

/// Applies the compiler's lower limits on masses and principal moments.
fn bounded(mut mass: MassProperties, compiler: &Compiler) -> MassProperties {
    mass.mass = mass.mass.max(compiler.bound_mass);
    let (moments, axes) = mass.principal();
    if moments.iter().any(|&m| m < compiler.bound_inertia) {
        let axes = axes.to_rotation_matrix().into_inner();
        let moments = moments.map(|m| m.max(compiler.bound_inertia));
        mass.inertia = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
    }
    mass
}

/// Mass properties of a primitive.
fn geom_mass(geom: &Geom, model: &Model) -> Option<GeomMass> {
    let mut geom = geom.clone();
    geom.density = geom.density.or(Some(model.compiler.inertia_density));
    GeomMass::of(&geom)
}

/// Joints with their indices in the rows.
pub fn joints(model: &Model, layout: &Layout, texts: &mut Texts) -> Vec<table::Joint> {
    let bodies = model.bodies.iter().enumerate();
    let joints = bodies.flat_map(|(i, b)| b.body.joints.iter().map(move |j| (i, j)));
    joints
        .zip(&layout.joints)
        .map(|((body, joint), place)| {
            let limited = joint
                .limited
                .resolve(model.compiler.autolimits, joint.range.is_some());
            let range = joint.range.unwrap_or_default();
            // The parser converts degrees of hinges to radians, but not those of balls.
            let degrees = place.kind == JointKind::Ball && model.compiler.angle_is_degree;
            let axis = Vector3::from(joint.axis);
            table::Joint {
                name: texts.add(&place.name),
                body: body as u64,
                kind: match place.kind {
                    JointKind::Free => joint_kind::FREE,
                    JointKind::Ball => joint_kind::BALL,
                    JointKind::Hinge => joint_kind::HINGE,
                    JointKind::Slide => joint_kind::SLIDE,
                },
                limited: i32::from(limited),
                qpos: place.qpos as u64,
                qvel: place.qvel as u64,
                pos: joint.pos,
                axis: axis.try_normalize(0.0).unwrap_or_else(Vector3::z).into(),
                range: if degrees {
                    range.map(f64::to_radians)
                } else {
                    range
                },
                ref_: joint.ref_,
                springref: joint.springref,
                stiffness: joint.stiffness,
                damping: joint.damping,
                armature: joint.armature,
                frictionloss: joint.frictionloss,
            }
        })
        .collect()
}

/// Geoms, with `fromto` resolved.
pub fn geoms(model: &Model, layout: &Layout, texts: &mut Texts) -> Vec<table::Geom> {
    let bodies = model.bodies.iter().enumerate();
    let geoms = bodies.flat_map(|(i, b)| b.body.geoms.iter().map(move |g| (i, g)));
    geoms
        .zip(&layout.geoms)
        .map(|((body, geom), name)| {
            let mass = geom_mass(geom, model);
            let (pos, quat) = mass.as_ref().map_or_else(
                || parts(&geom.pose),
                |m| {
                    let q = m.rotation;
                    (m.position.into(), [q.w, q.i, q.j, q.k])
                },
            );
            table::Geom {
                name: texts.add(name),
                body: body as u64,
                kind: geom_kind(geom.type_),
                condim: geom.condim.cast_signed(),
                pos,
                quat,
                size: size(geom),
                mass: mass.as_ref().map_or(0.0, |m| m.mass),
                inertia: mass.map_or([0.0; 3], |m| (m.unit_inertia * m.mass).into()),
                friction: geom.friction,
                contype: geom.contype,
                conaffinity: geom.conaffinity,
                priority: geom.priority,
                padding: 0,
            }
        })
        .collect()
}

fn geom_kind(kind: GeomType) -> i32 {
    match kind {
        GeomType::Plane => geom_kind::PLANE,
        GeomType::Hfield => geom_kind::HEIGHT_FIELD,
        GeomType::Sphere => geom_kind::SPHERE,
        GeomType::Capsule => geom_kind::CAPSULE,
        GeomType::Ellipsoid => geom_kind::ELLIPSOID,
        GeomType::Cylinder => geom_kind::CYLINDER,
        GeomType::Box => geom_kind::BOX,
        GeomType::Mesh | GeomType::Sdf => geom_kind::MESH,
    }
}

/// Size of a geom, as MJCF defines it without `fromto`.
pub fn size(geom: &Geom) -> [f64; 3] {
    let Some([x1, y1, z1, x2, y2, z2]) = geom.fromto else {
        return geom.size;
    };
    let half = Vector3::new(x2 - x1, y2 - y1, z2 - z1).norm() / 2.0;
    let across = geom.size[0];
    match geom.type_ {
        GeomType::Box | GeomType::Ellipsoid => [across, across, half],
        _ => [across, half, 0.0],
    }
}

/// Sites.
pub fn sites(model: &Model, texts: &mut Texts) -> Vec<table::Site> {
    all_sites(model)
        .enumerate()
        .map(|(i, (body, site))| {
            let (pos, quat) = parts(&site.pose);
            let name = site.name.clone().unwrap_or(format!("site{i}"));
            table::Site {
                name: texts.add(&name),
                body: body as u64,
                pos,
                quat,
            }
        })
        .collect()
}
