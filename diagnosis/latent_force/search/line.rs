//! A set of a screening along the way that its slopes promise.

use super::set::Set;

/// Ratio of two parts of the way between which no further one is tried: a fit goes on from there.
const NEAR: f64 = 1.1;

/// A set of a screening, replayed at some parts of the way that its slopes promise.
pub(super) struct Line<S = Set> {
    /// Place among those ranked.
    pub(super) place: usize,
    /// At the whole of the way.
    pub(super) set: S,
    /// Parts of the way, and the excess power that replays leave there, by parts.
    tried: Vec<(f64, f64)>,
    /// Where a fit to replays has come to, after what they leave there.
    fitted: Option<(f64, S)>,
}

impl<S> Line<S> {
    /// One that is not replayed yet.
    pub(super) fn new(place: usize, set: S) -> Self {
        Self {
            place,
            set,
            tried: Vec::new(),
            fitted: None,
        }
    }

    /// The part at which replays leave least, and its place among those tried.
    fn best(&self) -> (usize, f64, f64) {
        let all = self.tried.iter().enumerate();
        let best = all.min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        best.map_or((0, 1.0, f64::INFINITY), |(i, t)| (i, t.0, t.1))
    }

    /// The part of the way at which replays leave least.
    pub(super) fn part(&self) -> f64 {
        self.best().1
    }

    /// The least that replays leave.
    pub(super) fn left(&self) -> f64 {
        let fitted = self.fitted.as_ref().map_or(f64::INFINITY, |f| f.0);
        self.best().2.min(fitted)
    }

    /// Where a fit to replays has come to; `None` where there was none, or it leaves more than some part of the way.
    pub(super) fn fitted(&self) -> Option<&S> {
        let (left, set) = self.fitted.as_ref()?;
        (*left <= self.best().2).then_some(set)
    }

    /// Whether it was fitted to replays.
    pub(super) fn was_fitted(&self) -> bool {
        self.fitted.is_some()
    }

    /// Where to replay next: beyond the best part on the side where nothing was tried, or else in the wider gap beside it; `None` where its
    /// neighbours are near.
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

    /// Takes note of what replays leave at a part of the way.
    pub(super) fn add(&mut self, part: f64, left: f64) {
        let at = self.tried.partition_point(|t| t.0 < part);
        self.tried.insert(at, (part, left));
    }

    /// Takes note of where a fit to replays has come to, and what they leave there.
    pub(super) fn add_fitted(&mut self, left: f64, set: S) {
        self.fitted = Some((left, set));
    }

    /// Parts of the way at which it was replayed.
    pub(super) fn parts(&self) -> impl Iterator<Item = f64> {
        self.tried.iter().map(|t| t.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of nothing, replayed until no part is due, where replays leave the least at a `best` part.
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
