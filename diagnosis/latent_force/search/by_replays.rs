//! A look at laws without a slope at their null, by open-loop replays.
//!
//! A rotor that flies from one end of its gap to the other acts on its joint in a few rows and by what it has kept until then; columns about a
//! trajectory that no gap has made hardly show it, and none tells how wide the gap is. A replay does: it begins with the log and goes its own way.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use crate::latent_force::fit::Slopes;
use crate::latent_force::screen::Screened;

use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Candidates that are replayed, at most: each takes as many replays of all logs as it has start values, and one more.
const REPLAYED: usize = 8;
/// Sets that are fitted to replays, and of these to the missing force, at most.
const TRIED: usize = 3;
/// Difference of a study's parameter that slopes of replays are taken over, in deviations of its prior.
const STEP: f64 = 0.02;

/// What replays tell of the study's parameters, to first order.
struct Given {
    slopes: DMatrix<f64>,
}

impl Given {
    /// Mean square that is left of residuals once the parameters have made up for what they can.
    fn left(&self, residuals: Vec<f64>) -> f64 {
        let r = DVector::from_vec(residuals);
        if self.slopes.ncols() == 0 || self.slopes.nrows() != r.len() {
            return r.norm_squared();
        }
        let gram = self.slopes.tr_mul(&self.slopes);
        let moment = self.slopes.tr_mul(&r);
        // Of what tells nothing there is nothing to take out.
        let taken = gram.svd(true, true).solve(&moment, f64::EPSILON.sqrt());
        let taken = taken.map_or(0.0, |x| x.dot(&moment));
        (r.norm_squared() - taken).max(0.0)
    }
}

impl Upon<'_> {
    /// Sets that were `fitted` to the end, best first, and those single laws without a slope at their null with which replays leave less than half of what
    /// they leave with the best of these and without any. Upon no effect, where the best leaves a gap of replays.
    pub(super) fn with_laws_by_replays(&self, fitted: Vec<Set>, look: &Look) -> Result<Vec<Set>> {
        if !self.asks_replays(&fitted)? {
            return Ok(fitted);
        }
        self.progress.note("replaying laws");
        let (mut stands, _) = (self.open_loop.fitted)(self.base)?;
        if let Some(best) = fitted.first() {
            stands = stands.min((self.open_loop.excess)(best)?);
        }
        let mut rivals = Vec::new();
        for set in self.replayed_laws(look)?.into_iter().take(TRIED) {
            if self.progress.is_stopped() {
                break;
            }
            let (left, mut set) = (self.open_loop.fitted)(&set)?;
            let states = (self.open_loop.states)(&set)?;
            if left >= MOST * stands || states.iter().flatten().any(|x| !x.is_finite()) {
                continue;
            }
            set.fitted.estimate.trajectory = states;
            set.fitted.slopes = Slopes::default();
            rivals.push(set);
        }
        self.with_rivals(fitted, rivals)
    }

    /// The laws without a slope at their null that lead a screening, each where replays leave least, the least first.
    fn replayed_laws(&self, look: &Look) -> Result<Vec<Set>> {
        let given = self.given()?;
        let is_law = |s: &&Screened| matches!(s.forms[..], [one] if look.is_secant(one));
        let mut laws = Vec::new();
        for screened in look.ranked.iter().filter(is_law).take(REPLAYED) {
            let mut nearest: Option<(f64, Set)> = None;
            for set in self.starts(look, screened) {
                if self.progress.is_stopped() {
                    break;
                }
                let left = given.left((self.open_loop.residuals)(&set)?);
                if nearest.as_ref().is_none_or(|(least, _)| left < *least) {
                    nearest = Some((left, set));
                }
            }
            laws.extend(nearest);
        }
        laws.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(laws.into_iter().map(|(_, set)| set).collect())
    }

    /// The base with a law, where a screening's slope has it and at each of its start values.
    fn starts(&self, look: &Look, law: &Screened) -> Vec<Set> {
        let forms = &look.columns.forms;
        let own = forms[law.forms[0]].candidate;
        let like = |&f: &usize| forms[f].candidate == own && look.is_secant(f);
        let at_start = |f: usize| {
            let mut start = law.clone();
            start.forms = vec![f];
            start.coefficients = vec![vec![1.0; forms[f].slopes.len()]];
            self.enlarged(look, &start)
        };
        let starts = (0..forms.len()).filter(like).map(at_start);
        std::iter::once(self.enlarged(look, law))
            .chain(starts)
            .collect()
    }

    /// Slopes of replays of the base in the values that it fits.
    fn given(&self) -> Result<Given> {
        let here = DVector::from_vec((self.open_loop.residuals)(self.base)?);
        let hypothesis = &self.base.fitted.hypothesis;
        let mut columns = Vec::new();
        for i in hypothesis.free() {
            let unknown = &hypothesis.unknowns[i];
            let mut moved = self.base.clone();
            let value = &mut moved.fitted.theta[i];
            let step = STEP * unknown.deviation;
            *value += if *value + step > unknown.bounds[1] {
                -step
            } else {
                step
            };
            let there = DVector::from_vec((self.open_loop.residuals)(&moved)?);
            let slope = (there - &here) / step;
            if slope.iter().all(|x| x.is_finite()) {
                columns.push(slope);
            }
        }
        let slopes = if columns.is_empty() {
            DMatrix::zeros(here.len(), 0)
        } else {
            DMatrix::from_columns(&columns)
        };
        Ok(Given { slopes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: of (3, 4, 0) a slope along the first axis takes 3, and one that does nothing takes nothing.
    #[test]
    fn the_studys_parameters_take_their_share_of_residuals() {
        let left = |columns: &[f64]| {
            let slopes = DMatrix::from_column_slice(3, columns.len() / 3, columns);
            Given { slopes }.left(vec![3.0, 4.0, 0.0])
        };
        assert!((left(&[]) - 25.0).abs() < 1e-12);
        assert!((left(&[2.0, 0.0, 0.0]) - 16.0).abs() < 1e-9);
        assert!((left(&[2.0, 0.0, 0.0, 0.0, 0.0, 0.0]) - 16.0).abs() < 1e-9);
        assert!(left(&[1.0, 1.0, 0.0, 1.0, -1.0, 0.0]) < 1e-9);
    }
}
