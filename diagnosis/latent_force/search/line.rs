//! A screened set at fractions of its predicted values.

use super::set::Set;

/// Ratio of two neighbouring fractions below which no fraction between them is tried: a fit
/// continues from there.
const NEAR: f64 = 1.1;

/// A screened set that was replayed at some fractions of its predicted values.
pub(super) struct Line<S = Set> {
    /// Position in the ranking.
    pub(super) place: usize,
    /// The set at its predicted values.
    pub(super) set: S,
    /// Fractions in ascending order, each with the excess power that replays leave there.
    tried: Vec<(f64, f64)>,
    /// The result of a fit to replays, with what the replays leave there.
    fitted: Option<(f64, S)>,
}

impl<S> Line<S> {
    /// A set that has not been replayed yet.
    pub(super) fn new(place: usize, set: S) -> Self {
        Self {
            place,
            set,
            tried: Vec::new(),
            fitted: None,
        }
    }

    /// Position among the fractions tried, fraction and excess power of the replays that leave
    /// least.
    fn best(&self) -> (usize, f64, f64) {
        let all = self.tried.iter().enumerate();
        let best = all.min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        best.map_or((0, 1.0, f64::INFINITY), |(i, t)| (i, t.0, t.1))
    }

    /// Fraction whose replays leave least.
    pub(super) fn part(&self) -> f64 {
        self.best().1
    }

    /// Least excess power of all replays.
    pub(super) fn left(&self) -> f64 {
        let fitted = self.fitted.as_ref().map_or(f64::INFINITY, |f| f.0);
        self.best().2.min(fitted)
    }

    /// The result of a fit to replays; `None` if there was no fit, or if it leaves more than some
    /// fraction.
    pub(super) fn fitted(&self) -> Option<&S> {
        let (left, set) = self.fitted.as_ref()?;
        (*left <= self.best().2).then_some(set)
    }

    /// Whether it was fitted to replays.
    pub(super) fn was_fitted(&self) -> bool {
        self.fitted.is_some()
    }

    /// Fraction to replay next; `None` if the neighbours of the best one are near.
    ///
    /// It lies beyond the best fraction on the side where nothing was tried, or else in the wider
    /// gap beside it.
    pub(super) fn next(&self) -> Option<f64> {
        let (i, part, _) = self.best();
        let above = self.tried.get(i + 1).map(|t| t.0);
        let below = i.checked_sub(1).map(|i| self.tried[i].0);
        let (Some(above), Some(below)) = (above, below) else {
            return Some(if above.is_none() {
                2.0 * part
            } else {
                0.5 * part
            });
        };
        let other = if above / part > part / below {
            above
        } else {
            below
        };
        let ratio = (other / part).max(part / other);
        (ratio > NEAR).then(|| (other * part).sqrt())
    }

    /// Records what replays leave at a fraction.
    pub(super) fn add(&mut self, part: f64, left: f64) {
        let at = self.tried.partition_point(|t| t.0 < part);
        self.tried.insert(at, (part, left));
    }

    /// Records the result of a fit to replays, and what replays leave there.
    pub(super) fn add_fitted(&mut self, left: f64, set: S) {
        self.fitted = Some((left, set));
    }

    /// Fractions that were replayed.
    pub(super) fn parts(&self) -> impl Iterator<Item = f64> {
        self.tried.iter().map(|t| t.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line without a set, replayed until no fraction is due, whose replays leave least at the
    /// fraction `best`.
    fn searched(best: f64) -> Line<()> {
        let mut line = Line::new(0, ());
        line.add(1.0, (1.0 / best).ln().abs());
        while let Some(part) = line.next() {
            line.add(part, (part / best).ln().abs());
        }
        line
    }

    #[test]
    fn a_line_is_searched_as_far_as_it_goes_and_as_near_as_it_matters() {
        for best in [0.04, 0.9, 1.0, 7.0, 90.0] {
            let line = searched(best);
            let found = line.part();
            assert!((found / best).max(best / found) < NEAR, "{best}: {found}");
            assert!(line.parts().count() < 20);
        }
    }

    #[test]
    fn a_fit_that_leaves_more_than_the_line_is_passed_over() {
        let mut line = searched(2.0);
        let left = line.left();
        line.add_fitted(left + 1.0, ());
        assert!(line.was_fitted() && line.fitted().is_none());
        assert_eq!(line.left(), left);
        line.add_fitted(0.0, ());
        assert!(line.fitted().is_some() && line.left() == 0.0);
    }
}
