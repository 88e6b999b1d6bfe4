//! What a sensor reads: a joint, the frame of a body, or something else.
//!
//! As in MuJoCo, `objtype="xbody"` is the frame of the body, and `objtype="body"` that of its
//! inertia, with its origin in the centre of mass. The second counts as the first where the two
//! coincide.

use asid_core::layout::Layout;
use mjcf_rs::Model as Document;
use mjcf_rs::body::{Body, GeomType, InertiaSpec};
use mjcf_rs::compiler::InertiaFromGeom;
use mjcf_rs::extras::Sensor;
use nalgebra::{Matrix3, Vector3};

use super::Reads;
use crate::mass::{GeomMass, MassProperties};

/// Largest distance (m) of a centre of mass from its body's frame that counts as none.
///
/// It allows for rounding in the sum over geoms, and is far below what a tracker resolves.
const SAME_PLACE: f64 = 1e-9;
/// Largest vector part of a quaternion that counts as no rotation; it allows for rounding.
const SAME_AXES: f64 = 1e-9;
/// Products of inertia, as a share of the moments, that count as none: rounding.
const ROUNDING: f64 = 1e-12;

/// What a sensor of the document reads.
pub(super) fn reads(document: &Document, layout: &Layout, sensor: &Sensor) -> Reads {
    let name = sensor.objname.as_deref().unwrap_or_default();
    let of_joint = ["joint", "ball"];
    if of_joint.iter().any(|kind| sensor.kind.starts_with(kind)) {
        let joint = layout.joints.iter().position(|j| j.name == name);
        return joint.map_or(Reads::Other, Reads::Joint);
    }
    if !sensor.kind.starts_with("frame") || sensor.refname.is_some() {
        return Reads::Other;
    }
    let Some(body) = layout.bodies.iter().position(|b| b == name) else {
        return Reads::Other;
    };
    let same = match sensor.objtype.as_deref() {
        Some("xbody") => true,
        Some("body") => document
            .bodies
            .get(body)
            .is_some_and(|entry| coincides(document, &entry.body, &sensor.kind)),
        _ => false,
    };
    if same {
        Reads::Body(body)
    } else {
        Reads::Other
    }
}

/// Whether a sensor of this kind reads the same in the frame of a body's inertia as in the body's.
fn coincides(document: &Document, body: &Body, kind: &str) -> bool {
    let Some((center, turned)) = inertial_frame(document, body) else {
        return false;
    };
    match kind {
        "framequat" | "framexaxis" | "frameyaxis" | "framezaxis" => !turned,
        // Both frames turn at the same rate.
        "frameangvel" | "frameangacc" => true,
        _ => center.norm() <= SAME_PLACE,
    }
}

/// Origin (m) of the frame of a body's inertia in the body's frame, and whether its axes differ
/// from the body's, as MuJoCo chooses them.
///
/// `None` where the document does not show it: the inertia comes from meshes.
fn inertial_frame(document: &Document, body: &Body) -> Option<(Vector3<f64>, bool)> {
    let from_geoms = matches!(document.compiler.inertia_from_geom, InertiaFromGeom::True);
    if let Some(inertial) = body.inertial.as_ref().filter(|_| !from_geoms) {
        let (p, q) = (inertial.pose.translation, inertial.pose.rotation);
        let own = Vector3::new(q.x, q.y, q.z).norm() > SAME_AXES;
        let turned = match inertial.inertia {
            InertiaSpec::Diagonal(_) => own,
            InertiaSpec::Full([xx, yy, zz, xy, xz, yz]) => {
                own || has_other_axes(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
            }
        };
        return Some((Vector3::new(p.x, p.y, p.z), turned));
    }
    // A plane has no mass.
    let geoms = body.geoms.iter().filter(|g| g.type_ != GeomType::Plane);
    let masses: Vec<GeomMass> = geoms.map(GeomMass::of).collect::<Option<_>>()?;
    Some(match &masses[..] {
        [] => (Vector3::zeros(), false),
        // Of a single geom MuJoCo takes the frame as it is.
        [one] => (one.position, one.rotation.imag().norm() > SAME_AXES),
        _ => {
            let all = MassProperties::of_geoms(&masses);
            (all.center, has_other_axes(&all.inertia))
        }
    })
}

/// Whether the principal axes of a tensor, which MuJoCo orders by decreasing moment, differ from
/// the axes that it is stated in.
fn has_other_axes(inertia: &Matrix3<f64>) -> bool {
    let rounding = ROUNDING * inertia.trace();
    let off = inertia[(0, 1)].abs() + inertia[(0, 2)].abs() + inertia[(1, 2)].abs();
    let [x, y, z] = [0, 1, 2].map(|i| inertia[(i, i)]);
    off > rounding || x + rounding < y || y + rounding < z
}

#[cfg(test)]
mod tests {
    use asid_core::scene::Scene;

    use super::*;
    use crate::Plant;

    /// What the sensors of a document read that has a free body of these parts.
    fn of(parts: &str, sensors: &str) -> Vec<Reads> {
        let xml = format!(
            r#"<mujoco><worldbody><body name="b"><freejoint/>{parts}</body></worldbody><sensor>{sensors}</sensor></mujoco>"#
        );
        let scene = Scene::from_xml("sensor", &xml, &[]).unwrap();
        Plant::of(&scene).unwrap().sensors
    }

    /// Symptom: a free body began beside where a sensor had seen it.
    ///
    /// Cause: each frame sensor with the name of a body counted as reading the body's frame, also
    /// where it reads a geom or site of that name, the centre of mass, or a difference to another
    /// frame.
    #[test]
    fn a_sensor_of_another_frame_does_not_read_the_body() {
        let (other, body) = (Reads::Other, Reads::Body(1));
        let ball = r#"<geom name="b" size="0.1" mass="1"/><site name="b" pos="0 0 0.1"/>"#;
        for (sensor, expected) in [
            (r#"<framepos objtype="xbody" objname="b"/>"#, body),
            (r#"<framepos objtype="body" objname="b"/>"#, body),
            (r#"<framequat objtype="body" objname="b"/>"#, body),
            (r#"<framepos objtype="geom" objname="b"/>"#, other),
            (r#"<framepos objtype="site" objname="b"/>"#, other),
            (
                r#"<framepos objtype="xbody" objname="b" reftype="xbody" refname="world"/>"#,
                other,
            ),
        ] {
            assert_eq!(of(ball, sensor), [expected], "{sensor}");
        }
    }

    /// The place and the axes of a body's inertia are looked at by themselves.
    #[test]
    fn a_sensor_of_the_inertia_reads_the_body_where_both_coincide() {
        let sensors =
            r#"<framepos objtype="body" objname="b"/><framequat objtype="body" objname="b"/>"#;
        let (other, body) = (Reads::Other, Reads::Body(1));
        for (parts, expected) in [
            (r#"<geom size="0.1" pos="0 0 0.01"/>"#, [other, body]),
            (r#"<geom size="0.1" quat="0 1 0 0"/>"#, [body, other]),
            (
                r#"<geom size="0.1" pos="0.2 0 0"/><geom size="0.1" pos="-0.2 0 0"/>"#,
                [body, other],
            ),
            (
                r#"<geom size="0.1" pos="0 0 0.2"/><geom size="0.1" pos="0 0 -0.2"/>"#,
                [body, body],
            ),
            (
                r#"<inertial pos="0 0 0" mass="1" diaginertia="1 2 3"/><geom size="0.1" pos="1 0 0"/>"#,
                [body, body],
            ),
            (
                r#"<inertial pos="0 0.1 0" mass="1" fullinertia="3 3 3 1 0 0"/>"#,
                [other, other],
            ),
        ] {
            assert_eq!(of(parts, sensors), expected, "{parts}");
        }
    }
}
