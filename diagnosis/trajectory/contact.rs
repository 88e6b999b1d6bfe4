//! Contacts along replays: which pairs of bodies can touch, and which do.

use asid_core::layout::Recording;
use asid_core::{Control, Layout, Result, Rollout, Simulator};
use asid_mjcf::Plant;
use asid_readings::replay::ReplayPlan;

use super::Trajectory;

impl Trajectory {
    /// Whether the body of a geom touches anything in these episodes.
    #[must_use]
    pub fn touches(&self, plant: &Plant, geom: &str) -> bool {
        let Ok(geom) = plant.geom(geom) else {
            return false;
        };
        let body = plant.geoms[geom].body;
        let pairs = self.pairs.iter().zip(&self.touched);
        pairs.into_iter().any(|(p, &t)| t && p.contains(&body))
    }

    /// Whether two bodies touch here that do not touch in other episodes of the same machine.
    #[must_use]
    pub fn touches_more_than(&self, other: &Self) -> bool {
        let mut pairs = self.touched.iter().zip(&other.touched);
        pairs.any(|(here, there)| *here && !there)
    }
}

/// Returns the pairs of bodies that can touch.
pub(super) fn pairs_of(plant: &Plant) -> Vec<[usize; 2]> {
    let mut pairs: Vec<[usize; 2]> = plant
        .contacts
        .iter()
        .map(|&[a, b]| {
            let (x, y) = (plant.geoms[a].body, plant.geoms[b].body);
            [x.min(y), x.max(y)]
        })
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Returns the channel of the normal force between two bodies.
pub(super) fn contact_channel(layout: &Layout, [a, b]: [usize; 2]) -> String {
    format!("contact.{}/{}", layout.bodies[a], layout.bodies[b])
}

/// Replays an episode and marks the pairs in contact after each physics step: a tap is shorter than
/// the time between two rows.
pub(super) fn look_for_touches(
    simulator: &mut dyn Simulator,
    plan: &ReplayPlan,
    nu: usize,
    touches: &Recording,
    touched: &mut [bool],
) -> Result<()> {
    let width = touches.width();
    let mut out = vec![0.0; plan.substeps * width];
    for frame in 0..plan.frames {
        let ctrl = plan.ctrl[frame * nu..(frame + 1) * nu].repeat(plan.substeps);
        let control = Control::Shared(&ctrl);
        let rollout = Rollout::new(&[0], plan.substeps, 1, control, touches);
        simulator.rollout(&rollout, &mut out)?;
        for forces in out.chunks_exact(width) {
            for (t, force) in touched.iter_mut().zip(forces) {
                *t |= *force > 0.0;
            }
        }
    }
    Ok(())
}
