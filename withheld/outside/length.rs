//! Episode length of a machine that other authors modelled: as long as its time step resolves the
//! motion.
//!
//! An arm whose motors do not hold it up falls into its stops. From there on its motion depends on
//! the last digit. Before that it is as good a machine as any.

use crate::anatomy::Anatomy;
use crate::error::Result;
use crate::gap::Bench;
use crate::motion::{Motion, Style};
use crate::random::stream;
use crate::world::World;

/// Lengths that are tried, s, longest first. The shortest still has 50 rows at the usual rate.
const LENGTHS: [f64; 3] = [1.5, 0.75, 0.5];
/// Gap that the time step may make, in noise floors.
///
/// It is half of the limit at which a case is left out, because cases draw other motions and
/// lengths of up to 1.3 times these.
const STEP_GAP: f64 = 0.25;
/// Episodes in which the gap is measured: as many as those by which a world is checked.
const EPISODES: usize = 3;
/// Integrator with which the gap is measured: the one that differs least between steps.
const INTEGRATOR: &str = "implicitfast";

/// The longest length at which half the time step changes the readings only a little.
///
/// If there is none, it is the shortest length, and the rules for all cases decide.
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
        // A simulation that diverges does not count as a small gap.
        if gap().is_ok_and(|gap| gap < STEP_GAP) {
            return seconds;
        }
    }
    LENGTHS[LENGTHS.len() - 1]
}
