//! How long an episode of a machine that others modelled is: as long as its own time step can tell what it does.
//!
//! An arm with motors that do not hold it up falls into its stops, and what it does from there on depends on the last
//! digit. Before that it is as good a machine as any.

use crate::anatomy::Anatomy;
use crate::error::Result;
use crate::gap::Bench;
use crate::motion::{Motion, Style};
use crate::random::stream;
use crate::world::World;

/// Lengths that are tried, s, the longest first. The shortest still has 50 rows at the usual rate.
const LENGTHS: [f64; 3] = [1.5, 0.75, 0.5];
/// Gap that the time step may make, in noise floors: half of that by which a case is left out, since cases draw other motions
/// and lengths of up to 1.3 times these.
const STEP_GAP: f64 = 0.25;
/// Episodes that it is measured in: as many as a world is checked by.
const EPISODES: usize = 3;
/// Integrator that it is measured with: the one that differs least between steps.
const INTEGRATOR: &str = "implicitfast";

/// The longest length at which half the time step changes the readings by little; the shortest where none does, so
/// that the rules for all cases decide.
pub(super) fn of(anatomy: &Anatomy) -> f64 {
    let step = anatomy.timestep;
    for seconds in LENGTHS {
        let style = Style {
            seconds,
            rate: anatomy.machine.rate,
            vigour: 1.0,
            rest: 0.0,
        };
        let random = &mut stream(0, &["length", anatomy.machine.name]);
        let motions: Vec<Motion> = (0..EPISODES)
            .map(|_| Motion::draw(anatomy, style, random))
            .collect();
        let gap = || -> Result<f64> {
            let bench = Bench::new(anatomy, &[], &motions, step / 2.0, INTEGRATOR)?;
            let mut coarse = World::new(anatomy, &[], step, INTEGRATOR)?;
            Ok(bench.distance(&bench.run(&mut coarse)?, &bench.clean))
        };
        // A simulation that leaves all bounds is no gap that is small.
        if gap().is_ok_and(|gap| gap < STEP_GAP) {
            return seconds;
        }
    }
    LENGTHS[LENGTHS.len() - 1]
}
