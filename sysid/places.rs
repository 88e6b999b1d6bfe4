//! Points of the ranges at which a motion is looked at, and the best candidate that keeps its limits at all of them.

use asid_core::error::Result;

use crate::candidates::{BROKEN, breaks};
use crate::design::{Designer, joined, worst_of};
use crate::limits::Excess;

/// Points of the ranges at which limits are looked at.
pub(crate) struct Places<'p> {
    /// The middle, the ends and corners: where the answer keeps them.
    pub all: &'p [Vec<f64>],
    /// Those far from the middle at which each round looks.
    pub far: Vec<Vec<f64>>,
}

impl Designer<'_, '_> {
    /// The best candidate below a cost that keeps all limits at all points, of so many that are looked at; where all break one, that
    /// which does by the least. Points where better ones break a limit join those far from the middle, and their costs say so.
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
