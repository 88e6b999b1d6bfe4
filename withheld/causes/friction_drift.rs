//! `friction-drift`: sliding friction grows during an episode, by the factor `1 + rate t`.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct FrictionDrift;

struct Drift {
    geoms: Vec<usize>,
    rate: f64,
}

impl Force for Drift {
    fn before(&mut self, sim: &mut Sim) {
        let factor = 1.0 + self.rate * sim.time;
        for geom in &self.geoms {
            sim.scale_sliding_friction(*geom, factor);
        }
    }
    fn act(&mut self, _sim: &mut Sim) {}
}

impl Cause for FrictionDrift {
    fn name(&self) -> &'static str {
        "friction-drift"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.sliding)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        4.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        world.forces.push(Box::new(Drift {
            geoms: place.machine.touching_indices(place.site),
            rate: size,
        }));
        vec![("per_second", size)]
    }
}
