//! `geometry`: a link is longer or shorter, or a joint's axis is tilted.
//!
//! The size is a length in m, or an angle in rad if the fourth draw is above a half.

use crate::anatomy::{Anatomy, JointKind};
use crate::cause::{Cause, Place, Standing, Values};
use crate::world::World;

/// The cause.
pub struct Geometry;

impl Cause for Geometry {
    fn name(&self) -> &'static str {
        "geometry"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        let joints = machine.joints.iter();
        joints
            .filter(|j| j.kind != JointKind::Free)
            .map(|j| j.body.clone())
            .collect()
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.1
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let [x, y, z] = place.direction();
        if place.draw[3] < 0.5 {
            if let Some(body) = world.document.find_mut("body", Some(place.site)) {
                let mut pos = body.numbers("pos");
                pos.resize(3, 0.0);
                for (p, share) in pos.iter_mut().zip([x, y, z]) {
                    *p += share * size;
                }
                body.set_numbers("pos", &pos);
            }
            return vec![("x", x * size), ("y", y * size), ("z", z * size)];
        }
        let mut joints = place.machine.joints.iter();
        let joint = joints
            .find(|j| j.body == place.site)
            .map(|j| j.name.as_str());
        if let Some(element) = world.document.find_mut("joint", joint)
            && let [a, b, c] = element.numbers("axis")[..]
        {
            // Rotates the axis by a small angle about the drawn direction.
            let turned = [
                a + size * (y * c - z * b),
                b + size * (z * a - x * c),
                c + size * (x * b - y * a),
            ];
            element.set_numbers("axis", &turned);
        }
        vec![
            ("turn_x", x * size),
            ("turn_y", y * size),
            ("turn_z", z * size),
        ]
    }
}
