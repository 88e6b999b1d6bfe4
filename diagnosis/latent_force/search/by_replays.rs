//! A look at laws by open-loop replays.
//!
//! A rotor that flies from one end of its gap to the other acts on its joint in a few rows and by what it has kept until then; columns about a
//! trajectory that no gap has made hardly show it, and none tells how wide the gap is. A friction that holds a joint shows what it is as large
//! as, and no more. A replay tells: it begins with the log and goes its own way.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use crate::latent_force::fit::Slopes;
use crate::latent_force::screen::Screened;

use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::set::Set;
use super::tolerances::Tolerances;

/// Candidates with a slope at their null that are replayed, at most, and as many without: each takes some replays of all logs.
const REPLAYED: usize = 8;
/// Parts of the way that a slope goes at which replays are asked: a slope over- or underrates what is large.
const PARTS: [f64; 5] = [0.25, 0.5, 0.75, 1.0, 2.0];
/// About the best of these, halvings of the distance to the next at which they are asked on both sides of it: what holds a joint does so from
/// some value on, and nearly does just below.
const HALVINGS: usize = 3;
/// Sets that are fitted to replays, and of these to the missing force, at most.
const TRIED: usize = 3;
/// Difference of a study's parameter that slopes of replays are taken over, in deviations of its prior.
pub(super) const STEP: f64 = 0.02;

/// What replays tell of the study's parameters, to first order.
pub(super) struct Given {
    slopes: DMatrix<f64>,
}

impl Given {
    /// Mean square that is left of residuals once the parameters have made up for what they can.
    pub(super) fn left(&self, residuals: Vec<f64>) -> f64 {
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

    /// Excess power that is left of residuals then.
    pub(super) fn excess(&self, residuals: Vec<f64>) -> f64 {
        excess(self.left(residuals))
    }
}

/// Excess power over that of the noise; infinite where it is no number.
pub(super) fn excess(power: f64) -> f64 {
    if power.is_nan() {
        f64::INFINITY
    } else {
        (power - 1.0).max(0.0)
    }
}

impl Upon<'_> {
    /// Sets that were `fitted` to the end, best first, and those single laws with which replays leave less than half of what they leave with the
    /// best of these and without any, by themselves and beside what an ordinary machine has of everything. Upon no effect, where the best leaves
    /// a gap of replays.
    pub(super) fn with_laws_by_replays(
        &self,
        fitted: Vec<Set>,
        (look, tolerances): (&Look, Option<&Tolerances>),
    ) -> Result<Vec<Set>> {
        if !self.asks_replays(&fitted)? {
            return Ok(fitted);
        }
        self.progress.note("replaying laws");
        let (mut stands, _) = (self.open_loop.fitted)(self.base)?;
        if let Some(best) = fitted.first() {
            stands = stands.min((self.open_loop.excess)(best)?);
        }
        let (mut rivals, mut found) = (Vec::new(), Vec::new());
        for set in self.replayed_laws(look, stands)?.into_iter().take(TRIED) {
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
            rivals.extend(tolerances.map(|t| t.begun_at_null(&set, self.candidates)));
            rivals.push(set.clone());
            found.push((left, set));
        }
        let mut sets = self.with_rivals(fitted, rivals)?;
        for set in &mut sets {
            let named = self.named_in(set);
            let like = found.iter().find(|(_, s)| self.named_in(s) == named);
            if let Some((left, replayed)) = like
                && !self.progress.is_stopped()
                && (self.open_loop.excess)(set)? > left / MOST
            {
                self.tell(set, replayed)?;
            }
        }
        Ok(self.in_order(sets))
    }

    /// Candidates of a set that are named.
    fn named_in(&self, set: &Set) -> Vec<usize> {
        let all = set.candidates.iter().copied();
        all.filter(|&c| !self.candidates[c].is_tolerance).collect()
    }

    /// Fits a set once more about the replay that was found of its law, whose values it gives a prior of where they may lie by that: the missing force has
    /// led them elsewhere, where replays leave more than twice as much. A drive that hardly moves its joint against a friction of 0.93 of its force is, to the
    /// missing force, much like one that does not at 0.99; where the joint has gone to by and by is not. Leaves the set as it is where that closes no more
    /// than half of the gap between the two.
    fn tell(&self, set: &mut Set, replayed: &Set) -> Result<()> {
        let mut told = set.clone();
        let (fitted, by) = (&mut told.fitted, &replayed.fitted);
        fitted
            .estimate
            .trajectory
            .clone_from(&by.estimate.trajectory);
        fitted.slopes = Slopes::default();
        let of_law = self.base.fitted.theta.len()..by.theta.len();
        for (k, i) in by.hypothesis.free().into_iter().enumerate() {
            let deviation = by.covariance[(k, k)].sqrt();
            let unknown = &mut fitted.hypothesis.unknowns[i];
            if of_law.contains(&i) && deviation > 0.0 {
                fitted.theta[i] = by.theta[i];
                unknown.center = by.theta[i];
                unknown.deviation = unknown.deviation.min(deviation);
            }
        }
        told.fit(self.context, (self.breadth.rounds[1], self.progress))?;
        let excess = |s: &Set| (self.open_loop.excess)(s);
        if told.rises_above(self.base, self.threshold()) && excess(&told)? < MOST * excess(set)? {
            *set = told;
        }
        Ok(())
    }

    /// The single laws that lead a screening, each where replays leave least, the least first.
    fn replayed_laws(&self, look: &Look, stands: f64) -> Result<Vec<Set>> {
        let given = self.given(self.open_loop.residuals)?;
        let singles = |without_slope: bool| {
            let is_one = move |s: &&Screened| matches!(s.forms[..], [f] if look.is_secant(f) == without_slope);
            look.ranked.iter().filter(is_one).take(REPLAYED)
        };
        let mut laws = Vec::new();
        for law in singles(true).chain(singles(false)) {
            laws.extend(if look.is_secant(law.forms[0]) {
                self.nearest(self.starts(look, law), &given)?
            } else {
                self.along(self.enlarged(look, law), (&given, stands))?
            });
        }
        laws.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(laws.into_iter().map(|(_, set)| set).collect())
    }

    /// The set of some with which replays leave least, after that; `None` where there was no time for any.
    fn nearest(&self, sets: Vec<Set>, given: &Given) -> Result<Option<(f64, Set)>> {
        let mut nearest: Option<(f64, Set)> = None;
        for set in sets {
            if self.progress.is_stopped() {
                break;
            }
            let left = given.left((self.open_loop.residuals)(&set)?);
            if nearest.as_ref().is_none_or(|(least, _)| left < *least) {
                nearest = Some((left, set));
            }
        }
        Ok(nearest)
    }

    /// A law of a screening with its values at that part of the way that its slope goes at which replays leave least, after that; to a finer
    /// part where they leave less than what `stands` leaves.
    fn along(&self, law: Set, (given, stands): (&Given, f64)) -> Result<Option<(f64, Set)>> {
        let mut best: Option<(f64, f64)> = None;
        let look = |part: f64, best: &mut Option<(f64, f64)>| -> Result<()> {
            if !self.progress.is_stopped() {
                let left = given.left((self.open_loop.residuals)(&self.at(&law, part))?);
                if best.is_none_or(|(least, _)| left < least) {
                    *best = Some((left, part));
                }
            }
            Ok(())
        };
        for part in PARTS {
            look(part, &mut best)?;
        }
        let apart = |part: f64| {
            let others = PARTS.iter().map(|p| (p - part).abs());
            others.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min)
        };
        if let Some((_, part)) = best.filter(|(left, _)| *left < stands) {
            let mut by = apart(part);
            for _ in 0..HALVINGS {
                by *= 0.5;
                let about = best.map_or(part, |b| b.1);
                look(about - by, &mut best)?;
                look(about + by, &mut best)?;
            }
        }
        Ok(best.map(|(left, part)| (left, self.at(&law, part))))
    }

    /// The base with a law where a screening has it and at each of its start values.
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

    /// Slopes of `residuals` of replays of the base in the values that it fits.
    pub(super) fn given(&self, residuals: &dyn Fn(&Set) -> Result<Vec<f64>>) -> Result<Given> {
        let here = DVector::from_vec(residuals(self.base)?);
        let hypothesis = &self.base.fitted.hypothesis;
        let mut columns = Vec::new();
        for i in hypothesis.free() {
            let mut moved = self.base.clone();
            let value = &mut moved.fitted.theta[i];
            let unknown = &hypothesis.unknowns[i];
            let mut step = STEP * unknown.deviation;
            if *value + step > unknown.bounds[1] {
                step = -step;
            }
            *value += step;
            let there = DVector::from_vec(residuals(&moved)?);
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
