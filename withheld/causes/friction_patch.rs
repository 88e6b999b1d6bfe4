//! `friction-patch`: sliding friction changes beyond a place, over an edge of four millimetres.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct FrictionPatch;

/// Width of the edge of a patch, m.
const EDGE: f64 = 0.004;

struct Patch {
    geoms: Vec<usize>,
    body: usize,
    axis: usize,
    edge: f64,
    ratio: f64,
}

impl Force for Patch {
    fn before(&mut self, sim: &mut Sim) {
        let beyond = (sim.body_position(self.body)[self.axis] - self.edge) / EDGE;
        let share = (beyond + 0.5).clamp(0.0, 1.0);
        let factor = 1.0 + share * (self.ratio - 1.0);
        for geom in &self.geoms {
            sim.scale_sliding_friction(*geom, factor);
        }
    }
    fn act(&mut self, _sim: &mut Sim) {}
}

impl Cause for FrictionPatch {
    fn name(&self) -> &'static str {
        "friction-patch"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.sliding)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        9.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let ratio = place.factor(size);
        let axis = usize::from(place.draw[1] > 0.7);
        let body = place.machine.mover(place.site);
        let [mean, spread] = place.whereabouts(body, axis);
        let edge = mean + place.between(2, -0.7, 0.7) * spread;
        world.forces.push(Box::new(Patch {
            geoms: place.machine.touching_indices(place.site),
            body,
            axis,
            edge,
            ratio,
        }));
        vec![("ratio", ratio), ("place", edge), ("axis", axis as f64)]
    }
}
