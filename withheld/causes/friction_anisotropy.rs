//! `friction-anisotropy`: sliding friction depends on the direction of the velocity, by the factor
//! `1 + a cos 2f + b sin 2f` of its angle `f`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct FrictionAnisotropy;

struct Anisotropy {
    geoms: Vec<usize>,
    body: usize,
    cos: f64,
    sin: f64,
}

impl Force for Anisotropy {
    fn before(&mut self, sim: &mut Sim) {
        let (_, [x, y, _]) = sim.body_velocity(self.body);
        let (sin, cos) = (2.0 * y.atan2(x)).sin_cos();
        let factor = 1.0 + self.cos * cos + self.sin * sin;
        for geom in &self.geoms {
            sim.scale_sliding_friction(*geom, factor);
        }
    }
    fn act(&mut self, _sim: &mut Sim) {}
}

impl Cause for FrictionAnisotropy {
    fn name(&self) -> &'static str {
        "friction-anisotropy"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.sliding)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.9
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let [cos, sin] = place.heading(0);
        world.forces.push(Box::new(Anisotropy {
            geoms: place.machine.touching_indices(place.site),
            body: place.machine.mover(place.site),
            cos: size * cos,
            sin: size * sin,
        }));
        vec![("cos_2", size * cos), ("sin_2", size * sin)]
    }
}
