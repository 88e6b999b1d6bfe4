//! `unknown:gust`: a body is pushed once per episode for a fifth of a second, at another time in
//! each.

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, moving_bodies};
use crate::engine::Sim;
use crate::world::{Force, World};

/// The cause.
pub struct Gust;

/// Length of a gust, s.
const LENGTH: f64 = 0.2;
/// Range of its start, s from the start of a log.
const WHEN: [f64; 2] = [0.1, 0.7];

struct Push {
    body: usize,
    force: [f64; 3],
    seed: u64,
    from: f64,
}

impl Force for Push {
    fn begin(&mut self, sim: &mut Sim) {
        let names = ["gust", &sim.episode.to_string()];
        let random = &mut crate::random::stream(self.seed, &names);
        self.from = rand::Rng::random_range(random, WHEN[0]..WHEN[1]);
    }
    fn act(&mut self, sim: &mut Sim) {
        let share = (sim.time - self.from) / LENGTH;
        if (0.0..1.0).contains(&share) {
            // The force rises and falls smoothly.
            let now = (std::f64::consts::PI * share).sin().powi(2);
            sim.push_body(self.body, self.force.map(|f| now * f));
        }
    }
}

impl Cause for Gust {
    fn name(&self) -> &'static str {
        "unknown:gust"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        moving_bodies(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        30.0
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let force = place.direction().map(|share| share * size);
        world.forces.push(Box::new(Push {
            body: place.body(),
            force,
            seed: (place.draw[3] * 1e9) as u64,
            from: 0.0,
        }));
        vec![("x", force[0]), ("y", force[1]), ("z", force[2])]
    }
}
