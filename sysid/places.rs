//! Points of the ranges at which limits are checked, and the best candidate that keeps them there.

use asid_core::error::Result;

use crate::candidates::{BROKEN, breaks};
use crate::design::{Designer, joined, worst_of};
use crate::limits::Excess;

/// Points of the ranges at which limits are checked.
pub(crate) struct Places<'p> {
    /// The middle, the ends and corners, at all of which the answer must keep the limits.
    pub all: &'p [Vec<f64>],
    /// Points far from the middle that each round checks.
    pub far: Vec<Vec<f64>>,
}

impl Designer<'_, '_> {
    /// The best candidate with a cost below `below` that keeps all limits at all points.
    ///
    /// At most `looks` candidates are checked. Where all break a limit at the points of the search,
    /// the answer is the one with the smallest violation. Points at which better candidates break a
    /// limit join `places.far`, and `costs` then contain the violation.
    ///
    /// # Errors
    /// When the engine fails.
    pub(crate) fn best(
        &mut self,
        candidates: &[Vec<f64>],
        costs: &mut [f64],
        (looks, below): (usize, f64),
        places: &mut Places<'_>,
    ) -> Result<Option<usize>> {
        for _ in 0..looks {
            let order = |&i: &usize, &j: &usize| costs[i].total_cmp(&costs[j]);
            let best = (0..costs.len()).min_by(order);
            let Some(k) = best.filter(|&k| costs[k] < below) else {
                return Ok(None);
            };
            if breaks(costs[k]) {
                return Ok(Some(k));
            }
            let all = self.excess_at(&candidates[k], 1.0, places.all)?;
            if all.iter().all(Excess::is_none) {
                return Ok(Some(k));
            }
            costs[k] = BROKEN * (1.0 + joined(&all).total);
            let worst = places.all[worst_of(&all)].clone();
            if !places.far.contains(&worst) {
                places.far.push(worst);
            }
        }
        Ok(None)
    }
}
