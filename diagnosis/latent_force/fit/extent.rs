//! How far a fit goes.

use asid_core::Progress;

/// Linearisations over which the pace of a fit is told.
const PACE: usize = 2;
/// Linearisations from which on a fit may be given up for a rival's evidence: the first few raise it most.
const TRIED: usize = 4;

/// How far a fit goes.
#[derive(Clone, Copy)]
pub struct Extent<'p> {
    /// Most linearisations.
    pub rounds: usize,
    /// Evidence, natural logarithm, that it must come to; without it, all that there is.
    pub rival: Option<f64>,
    /// Whether the variances of missing forces are first settled joint by joint.
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
    /// Whether a fit does not come to its rival: at the pace of its last linearisations, of which each has raised the evidence to one of `reached`,
    /// and with what a step promises.
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
        // It has risen by 10 in each of the last two, and has 6 to go.
        let reached = [0.0, 50.0, 60.0, 70.0];
        assert!(!extent(Some(130.0)).is_out_of_reach(&reached, 0.0));
        assert!(extent(Some(131.0)).is_out_of_reach(&reached, 0.0));
        assert!(!extent(Some(131.0)).is_out_of_reach(&reached, 1.0));
        assert!(!extent(Some(1e9)).is_out_of_reach(&reached[..3], 0.0));
        assert!(!extent(None).is_out_of_reach(&reached, 0.0));
    }
}
