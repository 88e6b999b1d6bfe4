//! Finds the size of a cause that gives a wanted excess gap.

use crate::error::{Error, Result};
use crate::gap::Bench;
use crate::world::World;

/// Difference between the logarithms of gap and target at which the search ends.
const NEAR: f64 = 0.08;
/// Largest such difference at which the case is kept.
const CLOSE: f64 = 0.25;
/// Maximum number of runs of a search.
const RUNS: usize = 12;
/// Share of the largest size at which the search begins.
const FIRST: f64 = 0.02;
/// Smallest share of the largest size.
const LEAST: f64 = 1e-7;
/// Number of corrections after the refit by replays.
const CORRECTIONS: usize = 2;

/// The result of a search.
#[derive(Clone, Debug)]
pub struct Sized {
    /// Share of the largest size.
    pub share: f64,
    /// Excess gap after the refit by replays.
    pub excess: f64,
}

/// Finds the share of the largest size at which a world has an excess gap; `None` if there is none.
///
/// The gap grows with the size by an unknown power: 1 for most causes, more for thresholds. The
/// search therefore takes secant steps on logarithms within a bracket.
///
/// # Errors
/// If the machine's model is wrong. A diverged simulation counts as a gap that is too large.
pub fn solve(
    bench: &Bench<'_>,
    target: f64,
    make: &dyn Fn(f64) -> Result<World>,
) -> Result<Option<Sized>> {
    let measure = |share: f64| -> Result<Option<Vec<f64>>> {
        match bench.run(&mut make(share)?) {
            Ok(readings) => Ok(Some(readings)),
            Err(Error::Diverged { .. }) => Ok(None),
            Err(other) => Err(other),
        }
    };
    let goal = target.ln();
    let mut search = Search::new(goal);
    let mut share = FIRST;
    for _ in 0..RUNS {
        let readings = measure(share)?;
        let gap = readings
            .as_deref()
            .map_or(f64::INFINITY, |r| bench.excess(r));
        if (gap.ln() - goal).abs() < NEAR {
            break;
        }
        match search.next(share, gap.ln()) {
            Some(next) => share = next,
            None => return Ok(None),
        }
    }
    for _ in 0..=CORRECTIONS {
        let Some(readings) = measure(share)? else {
            return Ok(None);
        };
        let excess = bench.refit(&readings)?.excess;
        let miss = excess.ln() - goal;
        if miss.abs() < CLOSE {
            return Ok(Some(Sized { share, excess }));
        }
        if !excess.is_normal() {
            return Ok(None);
        }
        share = (share * (-miss).exp()).clamp(LEAST, 1.0);
    }
    Ok(None)
}

/// Secant search on logarithms within a bracket.
struct Search {
    goal: f64,
    /// Logarithm of the largest share known to be too small, and its gap; the next field holds the
    /// smallest share known to be too large.
    low: Option<(f64, f64)>,
    high: Option<(f64, f64)>,
}

impl Search {
    fn new(goal: f64) -> Self {
        Self {
            goal,
            low: None,
            high: None,
        }
    }

    /// The next share to try; `None` if the bounds of the size are reached.
    fn next(&mut self, share: f64, gap: f64) -> Option<f64> {
        let at = share.ln();
        if gap < self.goal {
            if share >= 1.0 {
                return None;
            }
            self.low = Some((at, gap));
        } else {
            if share <= LEAST {
                return None;
            }
            self.high = Some((at, gap));
        }
        let next = match (self.low, self.high) {
            (Some((a, x)), Some((b, y))) if x.is_finite() && y.is_finite() => {
                let along = (self.goal - x) / (y - x);
                // Stay away from the ends, so that the bracket shrinks from both sides.
                a + (b - a) * along.clamp(0.1, 0.9)
            }
            (Some((a, _)), Some((b, _))) => (a + b) / 2.0,
            (Some((a, x)), None) if x.is_finite() => a + (self.goal - x).min(3.0) * 1.1,
            (None, Some((b, y))) if y.is_finite() => b + (self.goal - y).max(-7.0) * 1.1,
            (Some((a, _)), None) => a + 2.0,
            (_, Some((b, _))) => b - 2.0,
            (None, None) => at,
        };
        Some(next.exp().clamp(LEAST, 1.0))
    }
}
