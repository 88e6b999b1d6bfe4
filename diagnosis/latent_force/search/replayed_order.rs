//! Order of a race by replays of whole logs, where bodies touch.
//!
//! A derivative at the null says little about a law that is large. A friction that stops a foot is
//! many times the friction over which its derivative was taken, and derivatives rank it far behind
//! other laws. If the model drops what the machine holds, derivatives rank all laws that keep it
//! held alike. A replay with the right law matches the log.
//!
//! So the sets that derivatives rank first are replayed at their predicted values. The better half
//! is replayed at further points of the same direction too (successive halving, Jamieson and
//! Talwalkar 2016). This half is then fitted to the replays, together with the study's parameters:
//! these stand in for what a model lacks, and must be free to move back. The sets that leave least
//! are raced before all others, from the values found. The evidence decides as always, but sets
//! that close the gap come first.

use asid_core::Result;

use crate::findings::{LEAST_GAP, NEGLIGIBLE};
use crate::latent_force::screen::Screened;

use super::by_replays::{Given, STEP, excess};
use super::line::Line;
use super::line_fit::{Value, fitted, power};
use super::open_loop::MOST;
use super::round::Upon;
use super::screening::Look;
use super::set::Set;

/// Most physics steps of these replays: about as many as a screening of a machine with contacts
/// takes.
const STEPS: usize = 1_600_000;
/// Approximate number of replays that a fit takes.
const OF_FIT: f64 = 12.0;
/// Further replays of each set of the better half.
const FURTHER: usize = 2;
/// Most values of a set that are fitted individually: a force has three.
///
/// Of more values only the common distance is fitted, which is no bound of what they could leave.
const FEW: usize = 3;
/// Step of a value, or of a fraction of the way, for derivatives of replays, relative to it.
const PART_STEP: f64 = 0.02;
/// Smoothed initial states replace the logged ones only if their replays leave less than this share
/// of the power.
///
/// Smoothed initial states make a model that lacks something look better than it is. But if nothing
/// shows how fast a ball spins, they are all there is.
const SMOOTHED: f64 = 0.25;
/// Excess power, relative to the least, up to which a set is among the first of a race: a gap of
/// 1.4 times the least.
const LEVEL: f64 = 2.0;
/// Standard deviations by which the mean square of readings that are noise alone may exceed 1 by
/// chance: 98 %.
const CHANCE: f64 = 2.0;

/// Residuals of replays of a set.
type Residuals<'r> = &'r dyn Fn(&Set) -> Result<Vec<f64>>;

/// A replayed set of a screening.
pub(super) struct Candidacy {
    /// Position in the ranking.
    pub(super) place: usize,
    /// The set at the values whose replays leave least, if these are not the predicted ones.
    pub(super) elsewhere: Option<Set>,
    /// Whether replays leave most of the gap there.
    ///
    /// Sets of few values count too if they leave far more than the least and another set leaves no
    /// more than chance does.
    pub(super) is_behind: bool,
}

/// What replays show of the sets of a screening.
#[derive(Default)]
pub(super) struct Replayed {
    /// The replayed sets: first those that a race begins with, then the others in ascending order
    /// of what they leave.
    pub(super) sets: Vec<Candidacy>,
    /// Number of sets that a race begins with.
    pub(super) first: usize,
    /// Whether a replayed set leaves no more than chance does.
    pub(super) closes: bool,
}

impl Upon<'_> {
    /// Replays the single names that lead a screening, and orders them.
    ///
    /// A race begins with those that close most of the gap that the base leaves and leave about the
    /// least, the one with the fewest values first. There are none without segments, or if there is
    /// hardly a gap.
    pub(super) fn replayed(&self, look: &Look) -> Result<Replayed> {
        if !self.context.has_segments() {
            return Ok(Replayed::default());
        }
        let smoothed = (self.open_loop.excess)(self.base)?;
        let logged = excess(power(&(self.open_loop.as_logged)(self.base)?));
        let residuals = if logged.is_finite() && SMOOTHED * logged <= smoothed {
            self.open_loop.as_logged
        } else {
            self.open_loop.residuals
        };
        let given = self.given(residuals)?;
        let of_base = residuals(self.base)?;
        let chance = CHANCE * (2.0 / of_base.len().max(1) as f64).sqrt();
        let stands = given.excess(of_base);
        if !(stands.is_finite() && stands > NEGLIGIBLE * NEGLIGIBLE) {
            return Ok(Replayed::default());
        }
        let mut lines = self.lines(look, (residuals, &given))?;
        let least = lines.first().map_or(f64::INFINITY, Line::left);
        let closes = least <= chance;
        let level = LEVEL * least.max(LEAST_GAP * LEAST_GAP - 1.0);
        let leads = |l: &Line| l.left() <= level && l.left() < MOST * stands;
        let is_known = |l: &Line| l.was_fitted() && own_values(&l.set, self.base).len() <= FEW;
        let is_behind =
            |l: &Line| l.left() >= MOST * stands || closes && is_known(l) && l.left() > level;
        let first = lines.iter().take_while(|l| leads(l)).count();
        let first = first.min(self.breadth.raced.div_ceil(2));
        let values = |l: &Line| -> usize {
            let coefficients = look.ranked[l.place].coefficients.iter();
            coefficients.map(Vec::len).sum()
        };
        lines[..first].sort_by_key(values);
        let candidacy = |l: Line| {
            let along = || (l.part() != 1.0).then(|| self.at(&l.set, l.part()));
            Candidacy {
                place: l.place,
                elsewhere: l.fitted().cloned().or_else(along),
                is_behind: is_behind(&l),
            }
        };
        Ok(Replayed {
            sets: lines.into_iter().map(candidacy).collect(),
            first,
            closes,
        })
    }

    /// The single names that derivatives rank first, replayed; in ascending order of what they
    /// leave.
    fn lines(&self, look: &Look, (residuals, given): (Residuals<'_>, &Given)) -> Result<Vec<Line>> {
        let most = STEPS as f64 / self.open_loop.steps.max(1) as f64;
        let names = look.ranked.iter().enumerate();
        let single = |(_, s): &(usize, &Screened)| s.names == 1 && s.gain > self.breadth.least;
        let of_better = FURTHER as f64 + OF_FIT;
        let names = names.filter(single);
        let names = names.take((most / (1.0 + 0.5 * of_better)).ceil() as usize);
        let line = |(place, s)| Line::new(place, self.enlarged(look, s));
        let mut lines: Vec<Line> = names.map(line).collect();
        let n = lines.len();
        // All of them if there are few.
        let better = n.div_ceil(2).max((most / (1.0 + of_better)) as usize);
        for line in &mut lines {
            self.replay(line, 1.0, (residuals, given))?;
        }
        let sort = |lines: &mut [Line]| lines.sort_by(|a, b| a.left().total_cmp(&b.left()));
        sort(&mut lines);
        for line in lines.iter_mut().take(better) {
            for _ in 0..FURTHER {
                let Some(part) = line.next() else { break };
                self.replay(line, part, (residuals, given))?;
            }
        }
        sort(&mut lines);
        for line in lines.iter_mut().take(better) {
            if self.progress.is_stopped() {
                break;
            }
            let (left, set) = self.fitted_along(line, residuals)?;
            line.add_fitted(left, set);
        }
        sort(&mut lines);
        Ok(lines)
    }

    /// Replays a set at a fraction of its way, if there is time for it.
    ///
    /// A fraction whose values were replayed already, because they are at a bound, counts as
    /// leaving infinitely much.
    fn replay(
        &self,
        line: &mut Line,
        part: f64,
        (residuals, given): (Residuals<'_>, &Given),
    ) -> Result<()> {
        if self.progress.is_stopped() {
            return Ok(());
        }
        let moved = self.at(&line.set, part);
        let is_same = |p: f64| self.at(&line.set, p).fitted.theta == moved.fitted.theta;
        let left = if line.parts().any(is_same) {
            f64::INFINITY
        } else {
            given.excess(residuals(&moved)?)
        };
        line.add(part, left);
        Ok(())
    }

    /// Fits the values of a line and those of the base to replays, and returns the excess power
    /// that is left, with the set.
    ///
    /// Of a line with many values only the fraction of its way is fitted.
    fn fitted_along(&self, line: &Line, residuals: Residuals<'_>) -> Result<(f64, Set)> {
        let begin = self.at(&line.set, line.part());
        let unknowns = &begin.fitted.hypothesis.unknowns;
        let own = own_values(&line.set, self.base);
        let is_way = own.len() > FEW;
        let mut places = self.base.fitted.hypothesis.free();
        if !is_way {
            places.extend(&own);
        }
        let value = |&i: &usize| {
            let size = (begin.fitted.theta[i] - unknowns[i].center).abs();
            let step = STEP * unknowns[i].deviation;
            let is_small = own.contains(&i) && size > 0.0;
            Value {
                start: begin.fitted.theta[i],
                step: if is_small {
                    step.min(PART_STEP * size)
                } else {
                    step
                },
                bounds: unknowns[i].bounds,
            }
        };
        let mut values: Vec<Value> = places.iter().map(value).collect();
        if is_way {
            values.push(Value {
                start: line.part(),
                step: PART_STEP * line.part(),
                bounds: [0.0, f64::INFINITY],
            });
        }
        let set = |z: &[f64]| {
            let mut set = match z.get(places.len()) {
                Some(part) => self.at(&line.set, *part),
                None => begin.clone(),
            };
            let values = places.iter().zip(z);
            values.for_each(|(&i, value)| set.fitted.theta[i] = *value);
            set
        };
        let (found, left) = fitted(&|z| residuals(&set(z)), &values, self.progress)?;
        Ok((excess(power(&left)), set(&found)))
    }
}

/// Positions of the free values that a set adds to a base.
fn own_values(set: &Set, base: &Set) -> Vec<usize> {
    let all = set.fitted.hypothesis.free().into_iter();
    all.filter(|&i| i >= base.fitted.theta.len()).collect()
}
