//! `friction-trend`: in episode `n` sliding friction is `1 + rate n` times as large, as on a board
//! that wears.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Standing, Values};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct FrictionTrend;

struct Wear {
    geoms: Vec<usize>,
    rate: f64,
}

impl Force for Wear {
    fn before(&mut self, sim: &mut Sim) {
        let factor = 1.0 + self.rate * sim.episode as f64;
        for geom in &self.geoms {
            sim.scale_sliding_friction(*geom, factor);
        }
    }
    fn act(&mut self, _sim: &mut Sim) {}
}

impl Cause for FrictionTrend {
    fn name(&self) -> &'static str {
        "friction-trend"
    }
    fn standing(&self) -> Standing {
        Standing::Agreed
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        machine.contact_sites(|shows| shows.sliding)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        1.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        world.forces.push(Box::new(Wear {
            geoms: place.machine.touching_indices(place.site),
            rate: size,
        }));
        vec![("per_episode", size)]
    }
}
