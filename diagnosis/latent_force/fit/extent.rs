//! The extent of a fit.

use asid_core::Progress;

/// Linearisations over which the pace of a fit is measured.
const PACE: usize = 2;
/// Linearisations after which a fit may be given up for a rival's evidence: the first few raise it
/// most.
const TRIED: usize = 4;

/// The extent of a fit.
#[derive(Clone, Copy)]
pub struct Extent<'p> {
    /// Largest number of linearisations.
    pub rounds: usize,
    /// Evidence (natural logarithm) that the fit must be able to reach; `None` for no requirement.
    pub rival: Option<f64>,
    /// Whether the variances of missing forces are first fitted joint by joint.
    pub settles: bool,
    /// Work that may be stopped.
    pub progress: &'p dyn Progress,
}

impl<'p> From<(usize, &'p dyn Progress)> for Extent<'p> {
    fn from((rounds, progress): (usize, &'p dyn Progress)) -> Self {
        Self {
            rounds,
            rival: None,
            settles: false,
            progress,
        }
    }
}

impl Extent<'_> {
    /// Whether a fit will not reach its rival's evidence.
    ///
    /// The forecast extrapolates the pace of the last linearisations, whose best evidences are
    /// `reached`, and adds the gain that a step predicts.
    pub(super) fn is_out_of_reach(&self, reached: &[f64], promised: f64) -> bool {
        let n = reached.len();
        let Some(rival) = self.rival.filter(|_| n >= TRIED) else {
            return false;
        };
        let now = reached[n - 1];
        let pace = ((now - reached[n - 1 - PACE]) / PACE as f64).max(0.0);
        let further = self.rounds.saturating_sub(n) as f64;
        now + promised.max(0.0) + pace * further < rival
    }
}

#[cfg(test)]
mod tests {
    use asid_core::progress::Silent;

    use super::*;

    #[test]
    fn a_fit_is_given_up_where_its_pace_and_promise_do_not_come_to_its_rival() {
        let extent = |rival| Extent {
            rival,
            ..Extent::from((10, &Silent as &dyn Progress))
        };
        // It has risen by 10 in each of the last two linearisations, and has 6 left.
        let reached = [0.0, 50.0, 60.0, 70.0];
        assert!(!extent(Some(130.0)).is_out_of_reach(&reached, 0.0));
        assert!(extent(Some(131.0)).is_out_of_reach(&reached, 0.0));
        assert!(!extent(Some(131.0)).is_out_of_reach(&reached, 1.0));
        assert!(!extent(Some(1e9)).is_out_of_reach(&reached[..3], 0.0));
        assert!(!extent(None).is_out_of_reach(&reached, 0.0));
    }
}
