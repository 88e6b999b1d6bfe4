//! Comparison of laws by open-loop replays.
//!
//! A rotor that flies from one end of its gap to the other acts on its joint in few rows, and
//! through its memory of earlier ones. Columns about a trajectory without a gap hardly show it, and
//! none shows the width of the gap. A friction that holds a joint shows only the force that it
//! balances. A replay shows more, because it starts at the log and then runs freely.

use asid_core::Result;
use nalgebra::{DMatrix, DVector};

use crate::latent_force::fit::Slopes;
use crate::latent_force::screen::Screened;

use super::line_fit::least_squares;
use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::set::Set;
use super::tolerances::Tolerances;

/// Most candidates with a derivative at their null that are replayed, and most without: each takes
/// several replays of all logs.
const REPLAYED: usize = 8;
/// Fractions of the value that a derivative predicts at which laws are replayed: a derivative over-
/// or underestimates large values.
const PARTS: [f64; 5] = [0.25, 0.5, 0.75, 1.0, 2.0];
/// Halvings of the distance between fractions; after each, replays are tried on both sides of the
/// best.
///
/// A friction that holds a joint does so from some value on, and nearly does so just below.
const HALVINGS: usize = 3;
/// Most sets that are fitted to replays, and then to the missing force.
const TRIED: usize = 3;
/// Step of a study's parameter for derivatives of replays, in deviations of its prior.
pub(super) const STEP: f64 = 0.02;

/// Derivatives of replays with respect to the study's parameters.
pub(super) struct Given {
    slopes: DMatrix<f64>,
}

impl Given {
    /// Mean square of residuals after the parameters have made up for what they can, to first
    /// order; infinite if a replay diverges.
    pub(super) fn left(&self, residuals: Vec<f64>) -> f64 {
        let r = DVector::from_vec(residuals);
        let whole = r.norm_squared();
        if !whole.is_finite() {
            return f64::INFINITY;
        }
        if self.slopes.ncols() == 0 || self.slopes.nrows() != r.len() {
            return whole;
        }
        // Parameters that change no residual have nothing to remove.
        let taken = least_squares(&self.slopes, &r);
        let taken = taken.map_or(0.0, |x| x.dot(&self.slopes.tr_mul(&r)));
        (whole - taken).max(0.0)
    }

    /// Excess power of residuals after that.
    pub(super) fn excess(&self, residuals: Vec<f64>) -> f64 {
        excess(self.left(residuals))
    }
}

/// Excess power over that of the noise; infinite if the power is NaN.
pub(super) fn excess(power: f64) -> f64 {
    if power.is_nan() {
        f64::INFINITY
    } else {
        (power - 1.0).max(0.0)
    }
}

/// The fraction at which least is `left`, a mean square, with what is left there; `None` if there
/// was no time for any.
///
/// It is refined if it leaves less excess power than `stands`.
fn best_part(left: &dyn Fn(f64) -> Result<Option<f64>>, stands: f64) -> Result<Option<(f64, f64)>> {
    let mut best: Option<(f64, f64)> = None;
    let look = |part: f64, best: &mut Option<(f64, f64)>| -> Result<()> {
        if let Some(here) = left(part)?
            && best.is_none_or(|(least, _)| here < least)
        {
            *best = Some((here, part));
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
    if let Some((_, part)) = best.filter(|(left, _)| excess(*left) < stands) {
        let mut by = apart(part);
        for _ in 0..HALVINGS {
            by *= 0.5;
            let about = best.map_or(part, |b| b.1);
            look(about - by, &mut best)?;
            look(about + by, &mut best)?;
        }
    }
    Ok(best)
}

impl Upon<'_> {
    /// Adds to the sets that were `fitted` to the end the single laws that close most of the gap in
    /// replays; best first.
    ///
    /// These laws leave less than half of what replays leave with the best of these sets, and less
    /// than half of what they leave without effects. Each is added by itself and with tolerances.
    /// This is done only upon the model without effects, if the best set leaves a gap of replays.
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

    /// Named candidates of a set.
    fn named_in(&self, set: &Set) -> Vec<usize> {
        let all = set.candidates.iter().copied();
        all.filter(|&c| !self.candidates[c].is_tolerance).collect()
    }

    /// Refits a set about the replay that was found for its law, with a prior of the law's values
    /// from the replays.
    ///
    /// This is for a fit to the missing force that has moved the values to where replays leave more
    /// than twice as much. A drive that hardly moves its joint against a friction of 0.93 of its
    /// force is an example. Its missing force is much like that of a drive that does not move at
    /// all, at 0.99. Where the joint goes over time is different. The new fit replaces the set only
    /// if it exceeds the base by the threshold and leaves less than half of what the set leaves.
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

    /// The single laws that lead a screening, each at the values whose replays leave least, in
    /// ascending order of what they leave.
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

    /// The set whose replays leave least, with what they leave; `None` if there was no time for
    /// any.
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

    /// A law of a screening at the fraction of its predicted values whose replays leave least, with
    /// what they leave.
    ///
    /// The fraction is refined if replays then leave less excess power than `stands`.
    fn along(&self, law: Set, (given, stands): (&Given, f64)) -> Result<Option<(f64, Set)>> {
        let left = |part: f64| -> Result<Option<f64>> {
            if self.progress.is_stopped() {
                return Ok(None);
            }
            let residuals = (self.open_loop.residuals)(&self.at(&law, part))?;
            Ok(Some(given.left(residuals)))
        };
        let best = best_part(&left, stands)?;
        Ok(best.map(|(left, part)| (left, self.at(&law, part))))
    }

    /// The base with a law at its screened values, and at each of its start values.
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

    /// Derivatives of `residuals` of replays of the base with respect to its fitted values.
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

    /// By hand: from (3, 4, 0) a derivative along the first axis removes 3, and a zero one removes
    /// nothing.
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

    /// Symptom: the order of laws changed with the unit of a parameter of the study. Cause: a
    /// column of small numbers counted as one of zeros.
    #[test]
    fn what_a_parameter_makes_up_for_does_not_depend_on_its_unit() {
        for unit in [1e-9, 1e-6, 1.0, 1e6] {
            let columns = [2.0 * unit, 0.0, 0.0, 1.0, 1.0, 0.0];
            let slopes = |n: usize| DMatrix::from_column_slice(3, n, &columns[..3 * n]);
            let left = |n: usize| Given { slopes: slopes(n) }.left(vec![3.0, 4.0, 5.0]);
            assert!((left(1) - 41.0).abs() < 1e-9, "{unit}: {}", left(1));
            assert!((left(2) - 25.0).abs() < 1e-9, "{unit}: {}", left(2));
        }
    }

    /// Symptom: a law whose replay diverges was ranked first. Cause: what the parameters make up
    /// for was NaN, and the larger of NaN and 0 is 0.
    #[test]
    fn a_replay_that_diverges_leaves_infinitely_much() {
        let residuals = || vec![3.0, f64::INFINITY, f64::INFINITY];
        for columns in [0, 1] {
            let slopes = DMatrix::from_element(3, columns, 1.0);
            let given = Given { slopes };
            assert_eq!(given.left(residuals()), f64::INFINITY);
            assert_eq!(given.excess(residuals()), f64::INFINITY);
        }
    }

    /// Symptom: a law that closes a small gap kept the coarse fraction of its value. Cause: a mean
    /// square, which is 1 for noise alone, was compared with an excess power.
    #[test]
    fn a_fraction_that_closes_most_of_a_small_gap_is_refined() {
        // Replays leave the noise alone at 0.6 of the predicted values.
        let left = |part: f64| -> Result<Option<f64>> { Ok(Some(1.0 + (part - 0.6).powi(2))) };
        let part = |stands: f64| best_part(&left, stands).unwrap().unwrap().1;
        // An excess of 0.01 is left at the fraction 0.5.
        assert_eq!(part(0.005), 0.5);
        assert!((part(0.3) - 0.6).abs() < 0.25 * 0.5_f64.powi(HALVINGS as i32));
        assert!(best_part(&|_| Ok(None), 0.3).unwrap().is_none());
    }
}
