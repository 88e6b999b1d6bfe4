//! Lengths of links and directions of joints.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Reference, Site};
use asid_core::layout::{Joint, JointKind};
use asid_core::{Result, Target};
use asid_mjcf::Plant;

use super::{target, values};

crate::register!(EffectEntry {
    name: "geometry",
    about: "a link is longer or shorter, or a joint's axis stands askew",
    make: || Box::new(Geometry),
});

/// Moves a body's frame by `x`, `y`, `z` in its parent's frame, and turns its joint axes.
///
/// The axes of its hinges and slides turn by the small angles `turn_x`, `turn_y`, `turn_z` about
/// the axes of its own frame: `a + turn x a`, normalised.
struct Geometry;

struct GeometryAt {
    /// Columns of the position, then of each axis.
    columns: Vec<usize>,
    shift: [f64; 3],
    turn: [f64; 3],
}

impl Acting for GeometryAt {
    fn set(&self, row: &mut [f64]) {
        let (place, axes) = self.columns.split_at(3);
        for (&column, shift) in place.iter().zip(self.shift) {
            row[column] += shift;
        }
        let [x, y, z] = self.turn;
        for axis in axes.chunks_exact(3) {
            let [a, b, c] = [row[axis[0]], row[axis[1]], row[axis[2]]];
            row[axis[0]] += y * c - z * b;
            row[axis[1]] += z * a - x * c;
            row[axis[2]] += x * b - y * a;
        }
    }
}

/// Three standard deviations of a length from its drawing, m: milled or printed parts, assembled.
const LENGTH_TOLERANCE: f64 = 3e-3;
/// Three standard deviations of an axis from its drawing, rad: 1.5 degrees.
const AXIS_TOLERANCE: f64 = 0.026;

/// Joints of a body that constrain it to its parent.
fn joints<'p>(plant: &'p Plant, body: &str) -> impl Iterator<Item = &'p Joint> {
    let all = plant.layout.joints.iter();
    let body = body.to_owned();
    all.filter(move |j| j.body == body && j.kind != JointKind::Free)
}

impl Effect for Geometry {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["center-of-mass", "payload", "gravity-tilt"],
            told_apart_by: "measure the link, or read the place of its end",
        }]
    }

    /// Makers measure lengths and axes first, and drawings show them, unlike forces, gains and
    /// masses.
    fn unusual_at(&self, _plant: &Plant, _site: &str) -> bool {
        true
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("x", "m", [-0.2, 0.2], 0.0),
                EffectParameter::new("y", "m", [-0.2, 0.2], 0.0),
                EffectParameter::new("z", "m", [-0.2, 0.2], 0.0),
                EffectParameter::new("turn_x", "rad", [-0.5, 0.5], 0.0),
                EffectParameter::new("turn_y", "rad", [-0.5, 0.5], 0.0),
                EffectParameter::new("turn_z", "rad", [-0.5, 0.5], 0.0),
            ]
        }
    }

    fn tolerance(&self, _: &Plant, _: &str, _: &dyn Fn(Reference) -> f64) -> Vec<[f64; 2]> {
        let within = |off: f64| [[-off, off]; 3];
        [within(LENGTH_TOLERANCE), within(AXIS_TOLERANCE)].concat()
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let bodies = plant.layout.bodies.iter().skip(1);
        bodies
            .filter(|b| joints(plant, b).next().is_some())
            .cloned()
            .collect()
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        let place = (0..3).map(|i| target("body", site, "pos", i));
        let turned = joints(plant, site).filter(|j| j.kind != JointKind::Ball);
        let axes = turned.flat_map(|j| (0..3).map(|i| target("joint", &j.name, "axis", i)));
        place.chain(axes).collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [x, y, z, a, b, c] = values(site)?;
        Ok(Box::new(GeometryAt {
            columns: site.columns.to_vec(),
            shift: [x, y, z],
            turn: [a, b, c],
        }))
    }
}
